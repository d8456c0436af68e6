// SPDX-License-Identifier: Apache-2.0
#include "base/json_depth.h"

#include <gtest/gtest.h>

#include <string>

namespace velatura {

namespace {

std::string nested(const std::string& begin, const std::string& end, int depth) {
    std::string text;
    for (int i = 0; i < depth; ++i) text += begin;
    for (int i = 0; i < depth; ++i) text += end;
    return text;
}

}  // namespace

TEST(JsonDepth, CountsArraysAndObjectsInEachOther) {
    for (const auto& [begin, end] :
         {std::pair<std::string, std::string>{"[", "]"}, {"{\"a\":[", "]}"}}) {
        const int each = begin.size() == 1 ? 1 : 2;
        EXPECT_FALSE(is_json_too_deep(nested(begin, end, deepest_json / each)));
        EXPECT_TRUE(is_json_too_deep(nested(begin, end, deepest_json / each + 1)));
    }
    // Beside each other, however many
    std::string list = "[";
    for (int i = 0; i < 1000; ++i) list += "[{}],";
    EXPECT_FALSE(is_json_too_deep(list + "0]"));
}

TEST(JsonDepth, BracketsInStringsDoNotCount) {
    const std::string many(1000, '[');
    EXPECT_FALSE(is_json_too_deep("{\"" + many + "\": \"" + many + "\\\"" + many + "\"}"));
    // A string that ends in a backslash
    EXPECT_TRUE(is_json_too_deep("[\"\\\\\"," + many));
    EXPECT_FALSE(is_json_too_deep(""));
    EXPECT_FALSE(is_json_too_deep("\"\\"));
}

}  // namespace velatura
