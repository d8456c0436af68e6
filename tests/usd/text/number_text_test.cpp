// SPDX-License-Identifier: Apache-2.0
#include "usd/text/number_text.h"

#include "usd/text/reader.h"

#include <gtest/gtest.h>

#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <random>
#include <string>
#include <vector>

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

/// A decimal of up to 25 digits with or without point, zeros and exponent.
std::string random_decimal(std::mt19937_64& random) {
    const auto below = [&](size_t n) { return size_t(random() % n); };
    std::string text = below(2) == 0 ? "-" : "";
    const size_t digits = 1 + below(25);
    const size_t point = below(2 * digits);
    for (size_t i = 0; i < digits; ++i) {
        if (i == point) text += '.';
        text += char('0' + (below(8) == 0 ? 0 : below(10)));
    }
    constexpr const char* exponents[] = {"e", "E", "e-", "e+"};
    if (below(3) == 0)
        text += exponents[below(4)] + std::to_string(below(below(4) == 0 ? 400 : 30));
    return text;
}

TEST(Numbers, AreRoundedExactlyInArraysAsByTheCLibrary) {
    std::mt19937_64 random(2);
    std::vector<std::string> decimals = {"9007199254740993",
                                         "9007199254740992e22",
                                         "1e23",
                                         "-0.0",
                                         "123456789012345678901234567890",
                                         "4.9e-324",
                                         "1e-400",
                                         "1e400",
                                         ".5",
                                         "5.",
                                         "00001",
                                         "1e0000000000001"};
    while (decimals.size() < 20000) decimals.push_back(random_decimal(random));
    std::string text = "#usda 1.0\ndef \"A\" {\ndouble[] d = [";
    for (const std::string& decimal : decimals) text += decimal + ", ";
    text += "]\nfloat[] f = [";
    for (const std::string& decimal : decimals) text += decimal + ",\n";
    Diagnostics diagnostics;
    const auto layer = read_text_layer(text + "]\n}\n", "numbers.usda", diagnostics);
    ASSERT_TRUE(layer.has_value()) << diagnostics.format(diagnostics.all().at(0));
    const layer::Token name("default");
    const auto doubles = (*layer)->field(layer::Path::from("/A.d"), name)->as_array<double>();
    const auto floats = (*layer)->field(layer::Path::from("/A.f"), name)->as_array<float>();
    ASSERT_EQ(doubles.size(), decimals.size());
    ASSERT_EQ(floats.size(), decimals.size());
    for (size_t i = 0; i < decimals.size(); ++i) {
        const double expected = std::strtod(decimals[i].c_str(), nullptr);
        ASSERT_EQ(std::bit_cast<uint64_t>(doubles[i]), std::bit_cast<uint64_t>(expected))
            << decimals[i];
        ASSERT_EQ(std::bit_cast<uint32_t>(floats[i]), std::bit_cast<uint32_t>(float(expected)))
            << decimals[i];
    }
}

TEST(Numbers, IntegersKeepAllTheirDigitsAndTheirBounds) {
    Diagnostics diagnostics;
    const auto layer = read_text_layer(
        "#usda 1.0\ndef \"A\" {\nint64[] a = [9223372036854775807, -9223372036854775808, 12, 1e3, "
        "2.0]\n"
        "uint64[] b = [18446744073709551615, 999999999999999999, 0]\n}\n",
        "numbers.usda", diagnostics);
    ASSERT_TRUE(layer.has_value());
    const layer::Token name("default");
    const auto a = (*layer)->field(layer::Path::from("/A.a"), name)->as_array<int64_t>();
    const auto b = (*layer)->field(layer::Path::from("/A.b"), name)->as_array<uint64_t>();
    EXPECT_EQ(std::vector<int64_t>(a.begin(), a.end()),
              (std::vector<int64_t>{INT64_MAX, INT64_MIN, 12, 1000, 2}));
    EXPECT_EQ(std::vector<uint64_t>(b.begin(), b.end()),
              (std::vector<uint64_t>{UINT64_MAX, 999999999999999999u, 0}));
    for (const char* bad : {"int x = 2147483648", "uint x = -1", "uchar x = 256", "int x = 1.5"}) {
        const std::string text = std::string("#usda 1.0\ndef \"A\" {\n") + bad + "\n}\n";
        EXPECT_FALSE(read_text_layer(text, "bad.usda", diagnostics).has_value()) << bad;
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
