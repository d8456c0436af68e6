// SPDX-License-Identifier: Apache-2.0
#include "usd/text/number_text.h"

#include <gtest/gtest.h>

#include <bit>
#include <charconv>
#include <cmath>
#include <limits>
#include <random>

namespace velatura::usd::text {
namespace {

template <class T>
std::string number(T v) {
    std::string out;
    append_number(out, v);
    return out;
}

std::string quoted(std::string_view text) {
    std::string out;
    append_quoted(out, text);
    return out;
}

TEST(NumberText, FollowsTheExamplesOfTheStandard) {
    EXPECT_EQ(number(0.000001), "0.000001");
    EXPECT_EQ(number(0.0000001), "1e-7");
    EXPECT_EQ(number(10000000000000000.0), "1e16");
    EXPECT_EQ(number(1e15), "1e15");
    EXPECT_EQ(number(999999999999999.0), "999999999999999");
    EXPECT_EQ(number(1000.0), "1000");
    EXPECT_EQ(number(0.0), "0");
    EXPECT_EQ(number(-1.25e-9), "-1.25e-9");
    EXPECT_EQ(number(0.1f), "0.1");
    EXPECT_EQ(number(std::numeric_limits<double>::infinity()), "inf");
    EXPECT_EQ(number(-std::numeric_limits<float>::infinity()), "-inf");
    EXPECT_EQ(number(std::nan("")), "nan");
}

TEST(NumberText, ReadsBackToTheSameBits) {
    std::mt19937_64 random(1);
    for (int i = 0; i < 20000; ++i) {
        const double v = std::bit_cast<double>(random());
        if (!std::isfinite(v)) continue;
        const std::string text = number(v);
        double back = 0.0;
        std::from_chars(text.data(), text.data() + text.size(), back);
        EXPECT_EQ(std::bit_cast<uint64_t>(back), std::bit_cast<uint64_t>(v)) << text;
    }
}

TEST(Quoted, PicksQuotesAndEscapes) {
    EXPECT_EQ(quoted("a"), "\"a\"");
    EXPECT_EQ(quoted("say \"hi\""), "'say \"hi\"'");
    EXPECT_EQ(quoted("it's \"it\""), "\"it's \\\"it\\\"\"");
    EXPECT_EQ(quoted("two\nlines"), "\"\"\"two\nlines\"\"\"");
    EXPECT_EQ(quoted("tab\t\x01"), "\"tab\\t\\x01\"");
    EXPECT_EQ(quoted("\xc3\xbc\xff"), "\"\xc3\xbc\\xff\"");
}

}  // namespace
}  // namespace velatura::usd::text
