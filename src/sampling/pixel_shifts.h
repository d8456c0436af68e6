// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace velatura::sampling {

/// What to add (xor) to the digits of the Sobol' points of one pixel, both dimensions with their
/// bits reversed: the lowest bit is the first digit.
struct PixelShift {
    uint32_t x = 0, y = 0;
};

/// Different arrangements of the shifts over a block; uses of random numbers with one in common
/// pair up alike in all its pixels.
constexpr uint32_t shift_arrangements = 64;
/// Edge of a block in pixels; blocks are independent.
constexpr int shift_block = 16;

/// The shifts of a pixel by its place in its block, [arrangement].
///
/// A digital net over pixels and samples at once: for all a and b up to 8, the first 4^a samples of
/// an aligned square of 4^b pixels of a block, taken together, put one point into each of the
/// 4^(a+b) square cells, as the 4^a samples of each pixel do with theirs. Errors of neighbors thus
/// make up for each other, however many samples there are. The idea of ordering pixels by
/// hierarchy: Ahmed & Wonka 2020, "Screen-space blue-noise diffusion of Monte Carlo sampling error
/// via hierarchical ordering of pixels", ACM TOG 39(6); there one sequence is dealt out to pixels
/// in blocks of fixed length.
const PixelShift* pixel_shifts(int x, int y);

}  // namespace velatura::sampling
