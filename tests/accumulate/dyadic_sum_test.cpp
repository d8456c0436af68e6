// SPDX-License-Identifier: Apache-2.0
#include "accumulate/dyadic_sum.h"

#include "accumulate/sample_sums.h"
#include "base/hash.h"

#include <gtest/gtest.h>

#include <cmath>

namespace velatura::image {
namespace {

/// Values of many magnitudes and both signs, a third of them zero, so that any other order of
/// additions shows.
double value_of(uint64_t sample) {
    const uint64_t h = mix64(sample + 77);
    if (h % 3 == 0) return 0.0;
    const double mantissa = 1.0 + double(h >> 12) * 0x1p-52;
    return std::ldexp(h % 2 ? mantissa : -mantissa, int((h >> 8) % 40) - 20);
}

/// The definition: a node is the sum of its two children.
double tree(uint64_t begin, uint64_t size) {
    if (size == 1) return value_of(begin) + 0.0;
    return tree(begin, size / 2) + tree(begin + size / 2, size / 2);
}

/// Maximal aligned nodes by search from the largest size down.
std::vector<accumulate::DyadicNode> nodes_by_search(uint64_t begin, uint64_t end) {
    std::vector<accumulate::DyadicNode> list;
    while (begin < end) {
        uint64_t size = 64;
        while (begin % size != 0 || begin + size > end) size /= 2;
        list.push_back({begin, begin + size, false});
        begin += size;
    }
    return list;
}

std::vector<accumulate::NodeSums> range_sums(uint64_t begin, uint64_t end) {
    accumulate::SparseDyadicSum sum;
    for (uint64_t s = begin; s < end; ++s) sum.add(begin, s, {value_of(s), 1.0, 0.0});
    accumulate::NodeSums result;
    result.accumulator = accumulate::AccumulatorTable::beauty;
    sum.finish(begin, accumulate::DyadicRule(begin).nodes(begin, end), result.nodes);
    return {result};
}

accumulate::PixelRecord range(uint64_t begin, uint64_t end) {
    accumulate::PixelRecord r;
    r.first = begin;
    r.end = end;
    return r;
}

accumulate::LayerSet one_group() {
    accumulate::LayerSet set;
    set.groups.push_back({"key", {}, false});
    return set;
}

TEST(DyadicRule, CutsEveryRangeIntoItsMaximalAlignedNodes) {
    for (uint64_t a = 0; a <= 64; ++a) {
        for (uint64_t b = a; b <= 64; ++b)
            ASSERT_EQ(accumulate::DyadicRule(a).nodes(a, b), nodes_by_search(a, b))
                << a << " " << b;
    }
}

TEST(SparseDyadicSum, EqualsTheTreeForEveryRange) {
    for (uint64_t a = 0; a <= 64; ++a) {
        for (uint64_t b = a + 1; b <= 64; ++b) {
            const auto sums = range_sums(a, b);
            const auto nodes = nodes_by_search(a, b);
            ASSERT_EQ(sums[0].nodes.size(), nodes.size());
            for (size_t i = 0; i < nodes.size(); ++i) {
                ASSERT_EQ(sums[0].nodes[i].x, tree(nodes[i].begin, nodes[i].end - nodes[i].begin))
                    << a << " " << b;
                ASSERT_EQ(sums[0].nodes[i].y, double(nodes[i].end - nodes[i].begin));
            }
        }
    }
}

TEST(DenseDyadicSums, EqualsTheTreeForEveryRange) {
    // Every other column begins late, as layers do which the first samples do not touch
    constexpr size_t columns = accumulate::DenseDyadicSums::capacity;
    const auto begins = [](size_t column) { return column % 2 == 0 ? 0 : column / 2; };
    accumulate::DenseDyadicSums sums;
    for (uint64_t a = 0; a <= 64; a += 3) {
        for (uint64_t b = a + 1; b <= 64; ++b) {
            sums.begin(a);
            std::vector<size_t> column_of(columns, columns);
            for (uint64_t s = a; s < b; ++s) {
                for (size_t c = 0; c < columns; ++c) {
                    if (s - a < begins(c) || value_of(s + c) == 0.0) continue;
                    if (column_of[c] == columns) column_of[c] = sums.add_column();
                    sums.at(column_of[c]) += {value_of(s + c), 1.0, -0.0};
                }
                sums.next_sample();
            }
            for (size_t c = 0; c < columns; ++c) {
                if (column_of[c] == columns) continue;
                accumulate::SparseDyadicSum sparse;
                for (uint64_t s = a + begins(c); s < b; ++s) {
                    if (value_of(s + c) != 0.0) sparse.add(a, s, {value_of(s + c), 1.0, -0.0});
                }
                std::vector<accumulate::Triple> found, expected;
                sums.finish(column_of[c], found);
                sparse.finish(a, accumulate::DyadicRule(a).nodes(a, b), expected);
                ASSERT_EQ(found, expected) << a << " " << b << " " << c;
                for (const accumulate::Triple& t : found) ASSERT_FALSE(std::signbit(t.z));
            }
        }
    }
}

TEST(SampleSums, GivesTheBitsOfOneRunForEverySplitInTwo) {
    for (uint64_t a = 0; a < 64; a += 3) {
        for (uint64_t b = a + 1; b <= 64; ++b) {
            accumulate::SampleSums whole({0, 0, 1, 1}, one_group());
            whole.append(0, 0, range(a, b), range_sums(a, b));
            for (uint64_t m = a; m <= b; ++m) {
                accumulate::SampleSums split({0, 0, 1, 1}, one_group());
                split.append(0, 0, range(a, m), range_sums(a, m));
                split.append(0, 0, range(m, b), range_sums(m, b));
                ASSERT_EQ(split.total(0, 0, 0), whole.total(0, 0, 0)) << a << " " << m << " " << b;
                ASSERT_EQ(split.nodes_of(0, 0), whole.nodes_of(0, 0));
            }
        }
    }
}

TEST(SampleSums, GivesTheBitsOfOneRunSampleBySample) {
    // A plain left-to-right sum differs, so the comparison can fail
    double naive = 0;
    for (uint64_t s = 0; s < 61; ++s) naive += value_of(s);
    accumulate::SampleSums whole({0, 0, 1, 1}, one_group()), single({0, 0, 1, 1}, one_group());
    whole.append(0, 0, range(0, 61), range_sums(0, 61));
    for (uint64_t s = 0; s < 61; ++s) single.append(0, 0, range(s, s + 1), range_sums(s, s + 1));
    EXPECT_EQ(single.total(0, 0, 0), whole.total(0, 0, 0));
    EXPECT_NE(whole.total(0, 0, 0).x, naive);
}

TEST(SampleSums, KnowingTheLastSampleSavesNodesAndChangesNoBit) {
    for (uint64_t first : {0, 5}) {
        for (uint64_t final_end = first + 1; final_end <= 64; ++final_end) {
            accumulate::SampleSums known({0, 0, 1, 1}, one_group(), final_end);
            for (uint64_t s = first; s < final_end; ++s) {
                known.append(0, 0, range(s, s + 1), range_sums(s, s + 1));
                accumulate::SampleSums whole({0, 0, 1, 1}, one_group());
                whole.append(0, 0, range(first, s + 1), range_sums(first, s + 1));
                ASSERT_EQ(known.total(0, 0, 0), whole.total(0, 0, 0))
                    << first << " " << s << " " << final_end;
            }
            EXPECT_EQ(known.nodes_of(0, 0).size(), 1u);
        }
    }
}

TEST(SampleSums, KeepsNoStorageForLayersThatStayBlack) {
    accumulate::LayerSet many = one_group();
    for (int i = 0; i < 999; ++i) many.groups.push_back({"g" + std::to_string(i), {}, false});
    many.matrix_layers = true;
    accumulate::SampleSums few({0, 0, 64, 64}, one_group()), lots({0, 0, 64, 64}, many);
    for (accumulate::SampleSums* sums : {&few, &lots}) {
        for (int y = 0; y < 64; ++y) {
            for (int x = 0; x < 64; ++x) sums->append(x, y, range(0, 4), range_sums(0, 4));
        }
    }
    EXPECT_EQ(lots.memory_bytes(), few.memory_bytes());
    EXPECT_EQ(lots.used_accumulators().size(), 1u);
}

TEST(SampleSums, FreesNodesThatMergedAway) {
    accumulate::SampleSums sums({0, 0, 16, 16}, one_group());
    const auto add = [&sums](uint64_t a, uint64_t b) {
        for (int y = 0; y < 16; ++y) {
            for (int x = 0; x < 16; ++x) sums.append(x, y, range(a, b), range_sums(a, b));
        }
    };
    add(0, 4);
    const size_t one_node = sums.memory_bytes();
    add(4, 7);
    EXPECT_GT(sums.memory_bytes(), one_node);
    add(7, 8);
    // The list of later nodes keeps its room
    EXPECT_LE(sums.memory_bytes(), one_node + 8 * sizeof(void*));
}

TEST(SampleSums, MemoryFollowsThePixelsThatSeeALight) {
    accumulate::LayerSet set = one_group();
    for (int i = 1; i < 300; ++i) set.groups.push_back({"g" + std::to_string(i), {}, false});
    set.matrix_layers = true;
    accumulate::SampleSums sums({0, 0, 16, 16}, set);
    const auto sees = [](size_t pixel, uint32_t a) { return pixel * 7 % (a + 1) == 0; };
    for (const uint64_t pass : {0, 1}) {
        for (size_t pixel = 0; pixel < 256; ++pixel) {
            std::vector<accumulate::NodeSums> nodes;
            for (uint32_t a = 0; a < 300; ++a) {
                if (!sees(pixel, a)) continue;
                accumulate::NodeSums n = range_sums(pass, pass + 1).front();
                n.accumulator = a;
                nodes.push_back(n);
            }
            sums.append(int(pixel % 16), int(pixel / 16), range(pass, pass + 1), nodes);
        }
    }
    const accumulate::Triple expected =
        range_sums(0, 1).front().nodes[0] + range_sums(1, 2).front().nodes[0];
    for (uint32_t a = 0; a < 300; ++a) {
        accumulate::TileTotals totals;
        ASSERT_TRUE(sums.tile_totals(0, a, totals));
        for (size_t pixel = 0; pixel < 256; ++pixel) {
            const accumulate::Triple t = sees(pixel, a) ? expected : accumulate::Triple{};
            ASSERT_EQ(sums.total(int(pixel % 16), int(pixel / 16), a), t) << a << " " << pixel;
            ASSERT_EQ(totals[pixel], t) << a << " " << pixel;
        }
    }
    // A value and its place, with room to grow, for each pixel that sees it; a whole tile for few
    EXPECT_LT(sums.memory_bytes(), 300u * 256 * sizeof(accumulate::Triple) / 8);
}

}  // namespace
}  // namespace velatura::image
