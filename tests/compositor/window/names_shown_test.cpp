// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/names_shown.h"

#include <gtest/gtest.h>

namespace velatura::compositor::window {
namespace {

/// Room for so many bytes.
std::string shortened(const std::string& name, size_t bytes) {
    return shorten_middle(name, [&](const std::string& s) { return s.size() <= bytes; });
}

TEST(NamesShown, BothEndsOfALongNameStay) {
    EXPECT_EQ(shortened("key", 10), "key");
    // The dots are three bytes: 7 are left, the odd one for the head
    EXPECT_EQ(shortened("light_of_the_hero_017", 10), "ligh…017");
    EXPECT_EQ(shortened("light_of_the_hero_018", 10), "ligh…018");
    EXPECT_EQ(shortened("", 0), "");
}

TEST(NamesShown, CharactersAreNotCut) {
    // Two bytes each: 10 − 3 bytes hold three of them
    EXPECT_EQ(shortened("äöüäöüäöü", 10), "äö…ü");
    for (size_t bytes = 0; bytes < 20; ++bytes) {
        const std::string s = shortened("日本語の灯り", bytes);
        EXPECT_EQ((s.size() - (s.find("…") == std::string::npos ? 0 : 3)) % 3, 0u) << s;
    }
}

TEST(NamesShown, ASearchFindsEveryWordInAnyCase) {
    EXPECT_TRUE(is_found("CHAR_key_017", ""));
    EXPECT_TRUE(is_found("CHAR_key_017", "char 17"));
    EXPECT_TRUE(is_found("CHAR_key_017", "  17   KEY "));
    EXPECT_FALSE(is_found("CHAR_key_017", "key 018"));
    EXPECT_TRUE(is_found("a=b[c]", "=b["));
}

}  // namespace
}  // namespace velatura::compositor::window
