// SPDX-License-Identifier: Apache-2.0
#include "usd/crate/coding.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <vector>

namespace velatura::usd::crate {
namespace {

template <class Int>
std::vector<Int> there_and_back(const std::vector<Int>& integers) {
    std::string coded;
    encode_integers(std::span<const Int>(integers), coded);
    std::vector<Int> result(integers.size());
    std::string scratch;
    EXPECT_TRUE(decode_integers(coded, std::span<Int>(result), scratch));
    return result;
}

TEST(IntegerCoding, GivesTheBytesOfTheStandardsExample) {
    // AOUSD Core Specification 1.0.1, 16.3.7.2.2; the array of 16.3.7.2.1
    const std::vector<int32_t> input = {123, 124, 125, 100125, 100125, 100126, 100126};
    std::string compressed;
    encode_integers(std::span<const int32_t>(input), compressed);
    std::string plain(64, '\0');
    size_t size = 0;
    ASSERT_TRUE(decompress(compressed, plain, size));
    plain.resize(size);
    // Most common 1; of the codes the first is in the lowest bits
    const std::string expected(
        "\x01\x00\x00\x00"
        "\xc1\x11"
        "\x7b"
        "\xa0\x86\x01\x00"
        "\x00\x00",
        13);
    // 1 and 0 are equally common but for the example's choice: 1, 1, 1 against 0, 0
    EXPECT_EQ(plain, expected);
}

TEST(IntegerCoding, BringsIntegersOfEveryWidthBack) {
    using Limits = std::numeric_limits<int32_t>;
    using Limits64 = std::numeric_limits<int64_t>;
    EXPECT_TRUE(there_and_back<int32_t>({}).empty());
    const std::vector<int32_t> a = {0, Limits::min(), Limits::max(), -1, 127, -128, 128, 32768};
    EXPECT_EQ(there_and_back(a), a);
    const std::vector<int64_t> b = {0, Limits64::min(), Limits64::max(), -1, 40000, 3000000000};
    EXPECT_EQ(there_and_back(b), b);
    std::mt19937_64 random(1);
    for (size_t n : {1, 2, 3, 4, 5, 1000, 1023}) {
        std::vector<int32_t> c(n);
        std::vector<int64_t> d(n);
        for (size_t i = 0; i < n; ++i) {
            d[i] = int64_t(random() >> (random() % 64));
            c[i] = int32_t(uint32_t(d[i]));
        }
        EXPECT_EQ(there_and_back(c), c);
        EXPECT_EQ(there_and_back(d), d);
    }
}

TEST(IntegerCoding, RefusesWhatCannotHoldAsManyIntegers) {
    std::string coded;
    const std::vector<int32_t> seven(7, 7);
    encode_integers(std::span<const int32_t>(seven), coded);
    std::string scratch;
    std::vector<int32_t> more(1000000);
    EXPECT_FALSE(decode_integers(coded, std::span<int32_t>(more), scratch));
    more.resize(100);
    EXPECT_FALSE(decode_integers(coded, std::span<int32_t>(more), scratch));
    EXPECT_FALSE(decode_integers("", std::span<int32_t>(more), scratch));
    EXPECT_FALSE(decode_integers(coded.substr(0, 3), std::span<int32_t>(more), scratch));
}

TEST(Compression, ReadsSeveralChunks) {
    // Two chunks by hand: their number, then size and LZ4 of each
    std::string a;
    std::string b;
    compress("hello ", a);
    compress("world", b);
    std::string chunks(1, '\2');
    for (const std::string& block : {a.substr(1), b.substr(1)}) {
        const auto size = int32_t(block.size());
        chunks.append(reinterpret_cast<const char*>(&size), sizeof size).append(block);
    }
    std::string out(32, '\0');
    size_t size = 0;
    ASSERT_TRUE(decompress(chunks, out, size));
    EXPECT_EQ(out.substr(0, size), "hello world");
    chunks[1] = '\x7f';
    EXPECT_FALSE(decompress(chunks, out, size));
    chunks[4] = '\x80';
    EXPECT_FALSE(decompress(chunks, out, size));
    EXPECT_FALSE(decompress("", out, size));
}

}  // namespace
}  // namespace velatura::usd::crate
