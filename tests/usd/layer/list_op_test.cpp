// SPDX-License-Identifier: Apache-2.0
#include "test_assets.h"
#include "usd/layer/value.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <filesystem>
#include <fstream>
#include <string>

namespace velatura::usd::layer {
namespace {

using Op = ListOp<std::string>;
using Items = std::vector<std::string>;

TEST(ListOp, AppliesInTheOrderOfTheStandard) {
    Op op;
    op.deleted = {"b"};
    op.added = {"x", "a"};
    op.prepended = {"p", "c"};
    op.appended = {"a", "z"};
    Items items = {"a", "b", "c"};
    op.apply_to(items);
    EXPECT_EQ(items, (Items{"p", "c", "x", "a", "z"}));
}

TEST(ListOp, ReordersRunsBehindTheOrderedItems) {
    Op op;
    op.ordered = {"d", "b", "nowhere", "b"};
    Items items = {"a", "b", "c", "d", "e"};
    op.apply_to(items);
    EXPECT_EQ(items, (Items{"a", "d", "e", "b", "c"}));
}

TEST(ListOp, ExplicitReplacesAndDropsDuplicates) {
    Items items = {"a"};
    Op::make_explicit({"x", "y", "x"}).apply_to(items);
    EXPECT_EQ(items, (Items{"x", "y"}));
}

TEST(ListOp, ComposedOpDoesWhatBothDo) {
    // Every pair of small ops over every small list, against applying one after the other
    std::vector<Op> ops;
    const std::vector<Items> lists = {{}, {"a"}, {"b", "a"}};
    for (const Items& d : lists) {
        for (const Items& p : lists) {
            for (const Items& a : lists) {
                Op op;
                op.deleted = d;
                op.prepended = p;
                op.appended = a;
                ops.push_back(op);
            }
        }
    }
    ops.push_back(Op::make_explicit({"b", "c"}));
    for (const Op& strong : ops) {
        for (const Op& weak : ops) {
            const auto both = strong.composed_over(weak);
            ASSERT_TRUE(both.has_value());
            for (const Items& start : {Items{}, Items{"a", "c", "b"}, Items{"d"}}) {
                Items expected = start;
                weak.apply_to(expected);
                strong.apply_to(expected);
                Items found = start;
                both->apply_to(found);
                EXPECT_EQ(found, expected);
            }
        }
    }
}

ListOp<int64_t> from_json(const nlohmann::json& j) {
    ListOp<int64_t> op;
    const auto read = [&](const char* key, std::vector<int64_t>& out) {
        if (j.contains(key)) out = j[key].get<std::vector<int64_t>>();
    };
    op.is_explicit = j.contains("explicit_items");
    read("explicit_items", op.explicit_items);
    read("appended_items", op.appended);
    read("prepended_items", op.prepended);
    read("deleted_items", op.deleted);
    return op;
}

/// The same edits with no item in two lists: appended beats prepended beats deleted.
ListOp<int64_t> reduced(ListOp<int64_t> op) {
    for (auto* list : {&op.explicit_items, &op.prepended, &op.appended, &op.deleted})
        unique_in_order(*list);
    erase_all(op.prepended, op.appended);
    erase_all(op.deleted, op.prepended);
    erase_all(op.deleted, op.appended);
    return op;
}

TEST(ListOp, PassesTheAousdCombineChains) {
    const std::filesystem::path folder = test_assets() / "aousd/data_types/tests/combine_chain";
    if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no test assets at " << folder;
    int cases = 0;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
        if (entry.path().extension() != ".json") continue;
        std::ifstream in(entry.path());
        for (const auto& test : nlohmann::json::parse(in)) {
            const auto& chain = test["chain"];
            // Strongest first
            ListOp<int64_t> found = from_json(chain[0]);
            for (size_t i = 1; i < chain.size(); ++i) {
                const auto next = found.composed_over(from_json(chain[i]));
                ASSERT_TRUE(next.has_value());
                found = *next;
            }
            EXPECT_TRUE(reduced(found) == from_json(test["combined_reduced"]))
                << entry.path().filename() << ": " << test["description"];
            ++cases;
        }
    }
    std::printf("AOUSD combine chains: %d cases\n", cases);
    EXPECT_GT(cases, 20);
}

}  // namespace
}  // namespace velatura::usd::layer
