// SPDX-License-Identifier: Apache-2.0
#include "sampling/pixel_shifts.h"

#include "base/hash.h"

#include <array>
#include <utility>
#include <vector>

namespace velatura::sampling {

namespace {

constexpr int levels = 4;  ///< of squares within squares in a block

/// Columns of the shift for the bits of a pixel's number in Z order, lowest first. Found one after
/// the other: each must be linearly independent, in the first digits of both dimensions, of the
/// columns before it and of the first columns of Sobol', one linear equation for every number of
/// those (up to 10).
constexpr PixelShift columns[2 * levels] = {
    {0x63b45, 0xde4fe}, {0xc2d7e, 0xa35a5}, {0xe01e4, 0x0fe81}, {0x4aea0, 0x24a1b},
    {0x39252, 0x3a75e}, {0x146ad, 0x9fb88}, {0xe7718, 0x3ad69}, {0xecf72, 0x63c63}};

/// One of the 24 orders of four things.
std::array<uint32_t, 4> order(uint64_t hash) {
    std::array<uint32_t, 4> out = {0, 1, 2, 3};
    for (uint32_t k = 3; k > 0; --k) {
        std::swap(out[k], out[hash % (k + 1)]);
        hash /= k + 1;
    }
    return out;
}

/// Number in Z order of a pixel in its block, every square's quarters in an order of their own.
uint32_t shuffled_number(uint32_t x, uint32_t y, uint64_t arrangement) {
    uint32_t number = 0;
    for (int level = levels - 1; level >= 0; --level) {
        const uint32_t quarter = (x >> level & 1) | (y >> level & 1) << 1;
        const uint64_t square = uint64_t(level) << 16 | (x >> (level + 1)) << 8 | y >> (level + 1);
        number |= order(hash_combine(arrangement, square) >> 8)[quarter] << (2 * level);
    }
    return number;
}

std::vector<PixelShift> make_table() {
    std::vector<PixelShift> table;
    table.reserve(size_t(shift_block) * shift_block * shift_arrangements);
    for (uint32_t y = 0; y < uint32_t(shift_block); ++y) {
        for (uint32_t x = 0; x < uint32_t(shift_block); ++x) {
            for (uint32_t arrangement = 0; arrangement < shift_arrangements; ++arrangement) {
                const uint32_t number = shuffled_number(x, y, arrangement);
                PixelShift shift;
                for (int bit = 0; bit < 2 * levels; ++bit) {
                    if ((number >> bit & 1) == 0) continue;
                    shift.x ^= columns[bit].x;
                    shift.y ^= columns[bit].y;
                }
                table.push_back(shift);
            }
        }
    }
    return table;
}

}  // namespace

const PixelShift* pixel_shifts(int x, int y) {
    static const std::vector<PixelShift> table = make_table();
    const uint32_t column = uint32_t(x) % shift_block, row = uint32_t(y) % shift_block;
    return &table[size_t(row * shift_block + column) * shift_arrangements];
}

}  // namespace velatura::sampling
