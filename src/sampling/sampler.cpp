// SPDX-License-Identifier: Apache-2.0
#include "sampling/sampler.h"

#include "base/hash.h"
#include "sampling/owen.h"
#include "sampling/pixel_shifts.h"

namespace velatura::sampling {

namespace {

/// 64 random bits for (pixel, bounce, purpose, repeat). The stream has 24 + 8 + 32 bits; the odd
/// factor spreads it over all bits before it meets the pixel's, which are mixed already.
uint64_t stream_hash(uint64_t key, int bounce, Purpose purpose, uint32_t repeat) {
    const uint64_t stream = (uint64_t(uint32_t(bounce)) << 40) | (uint64_t(purpose) << 32) | repeat;
    return mix64(key ^ (stream * 0x9e3779b97f4a7c15ull));
}

/// Bits of a key for more than its own 64.
uint64_t remixed(uint64_t key) {
    return key * 0xd6e8feb86659fd93ull;
}

uint32_t arrangement(uint64_t key) {
    return uint32_t(remixed(key) >> 20) % shift_arrangements;
}

bool is_blue(SamplerKind kind) {
    return kind == SamplerKind::BlueNoise || kind == SamplerKind::BlueNoiseHalves;
}

/// Bits 0, 2, 4 … of v side by side.
uint32_t even_bits(uint32_t v) {
    v &= 0x55555555u;
    v = (v | v >> 1) & 0x33333333u;
    v = (v | v >> 2) & 0x0f0f0f0fu;
    v = (v | v >> 4) & 0x00ff00ffu;
    return (v | v >> 8) & 0x0000ffffu;
}

uint64_t place_key(uint64_t seed, int x, int y) {
    return hash_combine(seed, (uint64_t(uint32_t(x)) << 32) | uint32_t(y));
}

}  // namespace

// The scrambles are keyed by the pixel, so that pixels are independent. With halves, even sample
// indices are half A and odd ones half B, and each walks its own sequence with its own scrambles,
// so that A − B is an honest estimate of error. In one sequence the halves make up for each other's
// errors, which A − B then shows too large. For blue noise the scrambles are those of a block of
// pixels, and what tells its pixels apart are the order of their samples and the shifts.
PixelSampler::PixelSampler(
    uint64_t seed, int pixel_x, int pixel_y, uint64_t sample_index, SamplerKind kind)
    : key_(place_key(seed, pixel_x, pixel_y)), kind_(kind) {
    const uint64_t halves = has_halves(kind) ? 1 : 0;
    const uint64_t index = sample_index >> halves;
    reversed_index_ = reverse_bits(uint32_t(index));
    // The sequence repeats after 2^32 points: go on with fresh scrambles instead
    const uint64_t sequence = (sample_index & halves) | (index >> 32 << 1);
    if (is_blue(kind)) {
        pixel_salt_ = uint32_t(hash_combine(key_, sequence));
        shifts_ = pixel_shifts(pixel_x, pixel_y);
        const auto block = [](int i) { return int(uint32_t(i) / shift_block); };
        key_ = place_key(~seed, block(pixel_x), block(pixel_y));
    }
    key_ = hash_combine(key_, sequence);
    if (is_independent()) key_ = hash_combine(key_, sample_index);
}

PixelSampler PixelSampler::branch(uint32_t index, uint32_t count) const {
    PixelSampler sampler = *this;
    const uint64_t point = uint64_t(reverse_bits(reversed_index_)) * count + index;
    sampler.reversed_index_ = reverse_bits(uint32_t(point));
    if (point >> 32) sampler.key_ = hash_combine(key_, point >> 32);
    if (is_independent()) sampler.key_ = hash_combine(key_, index);
    return sampler;
}

// Of every use another order, so that uses do not pair up. Blue noise keeps the samples below each
// power of two together: those of several pixels form a net.
uint32_t PixelSampler::shuffled_index(uint64_t key) const {
    const uint32_t seed = uint32_t(key) ^ pixel_salt_;
    const uint32_t reversed = owen_hash_reversed(reversed_index_, seed);
    return reverse_bits(shifts_ ? reversed ^ owen_hash_reversed(0, seed) : reversed);
}

uint32_t PixelSampler::bits_1d(int bounce, Purpose purpose, uint32_t repeat) const {
    const uint64_t key = stream_hash(key_, bounce, purpose, repeat);
    if (is_independent()) return uint32_t(key >> 32);
    // Dimension 0 of Sobol' is the reversed index, so its reversed form is the index itself
    uint32_t index = shuffled_index(key);
    if (shifts_) index ^= shifts_[arrangement(key)].x;
    return reverse_bits(owen_hash_reversed(index, uint32_t(key >> 32)));
}

float PixelSampler::get_1d(int bounce, Purpose purpose, uint32_t repeat) const {
    return unit_float(bits_1d(bounce, purpose, repeat));
}

double PixelSampler::get_1d_fine(int bounce, Purpose purpose, uint32_t repeat) const {
    return double(bits_1d(bounce, purpose, repeat)) * 0x1p-32;
}

RandomStream PixelSampler::stream(int bounce, Purpose purpose, uint32_t repeat) const {
    const uint64_t key = hash_combine(stream_hash(key_, bounce, purpose, repeat), pixel_salt_);
    const uint64_t seed = hash_combine(key, reversed_index_);
    // What the sequence leaves open of the number comes from the seed
    const double rest = double(remixed(seed) >> 43) * 0x1p-53;
    return {seed, get_1d_fine(bounce, purpose, repeat) + rest};
}

// Owen-scrambled Sobol' in two dimensions, padded: each use of random numbers has its own shuffle
// of the index and its own scrambles. Ref: Burley 2020, "Practical Hash-based Owen Scrambling",
// JCGT 9(4).
Vec2 PixelSampler::get_2d(int bounce, Purpose purpose, uint32_t repeat) const {
    const uint64_t key = stream_hash(key_, bounce, purpose, repeat);
    if (!is_net()) return classic_2d(key);
    const uint32_t index = shuffled_index(key);
    uint32_t x = index, y = sobol_1_reversed(index);
    if (shifts_) {
        const PixelShift& shift = shifts_[arrangement(key)];
        x ^= shift.x;
        y ^= shift.y;
    }
    // Both numbers are turned round in one word, which swaps them
    const uint64_t reversed = uint64_t(owen_hash_reversed(x, uint32_t(key >> 32))) |
                              uint64_t(owen_hash_reversed(y, uint32_t(remixed(key) >> 32))) << 32;
    const uint64_t bits = reverse_bits(reversed);
    return {unit_float(uint32_t(bits >> 32)), unit_float(uint32_t(bits))};
}

// Strata of 1/4^k of a stratified number in one dimension become the squares of a Morton curve.
Vec2 PixelSampler::classic_2d(uint64_t key) const {
    if (is_independent()) return {unit_float(uint32_t(key)), unit_float(uint32_t(key >> 32))};
    const uint32_t along =
        reverse_bits(owen_hash_reversed(shuffled_index(key), uint32_t(key >> 32)));
    // The curve has 16 bits to a side; those below are anything
    const uint32_t rest = uint32_t(hash_combine(key, reversed_index_) >> 32);
    return {unit_float(even_bits(along >> 1) << 16 | rest >> 16),
            unit_float(even_bits(along) << 16 | (rest & 0xffffu))};
}

}  // namespace velatura::sampling
