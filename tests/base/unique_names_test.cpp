// SPDX-License-Identifier: Apache-2.0
#include "base/unique_names.h"

#include "base/hash.h"

#include <gtest/gtest.h>

#include <set>
#include <vector>

namespace velatura {

namespace {

/// The definition, trying one number after the other.
std::string first_free(std::string name,
                       const std::string& between,
                       size_t max_bytes,
                       std::set<std::string>& taken) {
    if (name.size() > max_bytes) name.resize(max_bytes);
    std::string candidate = name;
    for (int n = 2; !taken.insert(candidate).second; ++n) {
        const std::string suffix = between + std::to_string(n);
        candidate = name.substr(0, std::min(name.size(), max_bytes - suffix.size())) + suffix;
    }
    return candidate;
}

}  // namespace

TEST(UniqueNames, TakeTheFirstNumberThatIsFree) {
    // Names that are each other's numbers, and that shortening makes the same
    const std::vector<std::string> words = {"key", "key_2",       "key2",        "key_",      "",
                                            "2",   "a_long_name", "a_long_nick", "a_long__2", "k"};
    for (const std::string between : {"_", ""}) {
        for (const size_t longest : {std::string::npos, size_t(9), size_t(5)}) {
            UniqueNames names(between, longest);
            std::set<std::string> taken = {"key_3", "rest"};
            for (const std::string& name : taken) names.take(name);
            for (uint64_t i = 0; i < 400; ++i) {
                const std::string& word = words[hash_combine(3, i) % words.size()];
                ASSERT_EQ(names.make(word), first_free(word, between, longest, taken))
                    << i << ": " << word;
            }
            for (const std::string& name : taken) EXPECT_TRUE(names.has(name));
            EXPECT_FALSE(names.has("other"));
        }
    }
}

TEST(UniqueNames, ManyEqualOnesTakeNoLonger) {
    UniqueNames names;
    for (int i = 0; i < 200000; ++i) {
        const std::string name = names.make("SphereLight");
        ASSERT_EQ(name, i == 0 ? "SphereLight" : "SphereLight_" + std::to_string(i + 1));
    }
}

}  // namespace velatura
