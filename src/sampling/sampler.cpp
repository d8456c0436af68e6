// SPDX-License-Identifier: Apache-2.0
#include "sampling/sampler.h"

#include "base/hash.h"
#include "sampling/owen.h"

namespace velatura::sampling {

namespace {

/// 64 random bits for (pixel, bounce, purpose, repeat). The stream has 24 + 8 + 32 bits; the odd
/// factor spreads it over all bits before it meets the pixel's, which are mixed already.
uint64_t stream_hash(uint64_t pixel_key, int bounce, Purpose purpose, uint32_t repeat) {
    const uint64_t stream = (uint64_t(uint32_t(bounce)) << 40) | (uint64_t(purpose) << 32) | repeat;
    return mix64(pixel_key ^ (stream * 0x9e3779b97f4a7c15ull));
}

}  // namespace

// The scrambles are keyed by the pixel, so that pixels are independent. With halves, even sample
// indices are half A and odd ones half B, and each walks its own sequence with its own scrambles,
// so that A − B is an honest estimate of error. In one sequence the halves make up for each other's
// errors, which A − B then shows too large.
PixelSampler::PixelSampler(
    uint64_t seed, int pixel_x, int pixel_y, uint64_t sample_index, SamplerKind kind)
    : pixel_key_(hash_combine(seed, (uint64_t(uint32_t(pixel_x)) << 32) | uint32_t(pixel_y))),
      is_independent_(kind == SamplerKind::Independent) {
    const uint64_t halves = kind == SamplerKind::SobolHalves ? 1 : 0;
    const uint64_t index = sample_index >> halves;
    reversed_index_ = reverse_bits(uint32_t(index));
    // The sequence repeats after 2^32 points: go on with fresh scrambles instead
    pixel_key_ = hash_combine(pixel_key_, (sample_index & halves) | (index >> 32 << 1));
    if (is_independent_) pixel_key_ = hash_combine(pixel_key_, sample_index);
}

uint32_t PixelSampler::bits_1d(int bounce, Purpose purpose, uint32_t repeat) const {
    const uint64_t key = stream_hash(pixel_key_, bounce, purpose, repeat);
    if (is_independent_) return uint32_t(key >> 32);
    const uint32_t index = reverse_bits(owen_hash_reversed(reversed_index_, uint32_t(key)));
    // Dimension 0 of Sobol' is the reversed index, so its reversed form is the index itself
    return reverse_bits(owen_hash_reversed(index, uint32_t(key >> 32)));
}

float PixelSampler::get_1d(int bounce, Purpose purpose, uint32_t repeat) const {
    return unit_float(bits_1d(bounce, purpose, repeat));
}

double PixelSampler::get_1d_fine(int bounce, Purpose purpose, uint32_t repeat) const {
    return double(bits_1d(bounce, purpose, repeat)) * 0x1p-32;
}

// Owen-scrambled Sobol' in two dimensions, padded: each use of random numbers has its own shuffle
// of the index and its own scrambles. Ref: Burley 2020, "Practical Hash-based Owen Scrambling",
// JCGT 9(4).
Vec2 PixelSampler::get_2d(int bounce, Purpose purpose, uint32_t repeat) const {
    const uint64_t key = stream_hash(pixel_key_, bounce, purpose, repeat);
    if (is_independent_) return {unit_float(uint32_t(key)), unit_float(uint32_t(key >> 32))};
    const uint32_t index = reverse_bits(owen_hash_reversed(reversed_index_, uint32_t(key)));
    const uint32_t seed_1 = uint32_t((key * 0xd6e8feb86659fd93ull) >> 32);
    // Both numbers are turned round in one word, which swaps them
    const uint64_t reversed = uint64_t(owen_hash_reversed(index, uint32_t(key >> 32))) |
                              uint64_t(owen_hash_reversed(sobol_1_reversed(index), seed_1)) << 32;
    const uint64_t bits = reverse_bits(reversed);
    return {unit_float(uint32_t(bits >> 32)), unit_float(uint32_t(bits))};
}

}  // namespace velatura::sampling
