// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace velatura::sampling {

/// The bits of v in reverse order.
constexpr uint32_t reverse_bits(uint32_t v) {
    v = __builtin_bswap32(v);
    v = ((v >> 4) & 0x0f0f0f0fu) | ((v & 0x0f0f0f0fu) << 4);
    v = ((v >> 2) & 0x33333333u) | ((v & 0x33333333u) << 2);
    return ((v >> 1) & 0x55555555u) | ((v & 0x55555555u) << 1);
}

constexpr uint64_t reverse_bits(uint64_t v) {
    v = __builtin_bswap64(v);
    v = ((v >> 4) & 0x0f0f0f0f0f0f0f0full) | ((v & 0x0f0f0f0f0f0f0f0full) << 4);
    v = ((v >> 2) & 0x3333333333333333ull) | ((v & 0x3333333333333333ull) << 2);
    return ((v >> 1) & 0x5555555555555555ull) | ((v & 0x5555555555555555ull) << 1);
}

/// Owen scrambling of a number given with its bits reversed: every bit is flipped by a hash of the
/// bits below it. Ref: Laine & Karras 2011, "Stratified Sampling for Stochastic Transparency";
/// constants of Vegdahl 2021, "Building a Better LK Hash".
constexpr uint32_t owen_hash_reversed(uint32_t v, uint32_t seed) {
    v ^= v * 0x3d20adeau;
    v += seed;
    v *= (seed >> 16) | 1u;
    v ^= v * 0x05526c56u;
    v ^= v * 0x53a22864u;
    return v;
}

/// Second dimension of the Sobol' sequence with its bits reversed: Pascal's triangle modulo 2
/// applied to the index.
constexpr uint32_t sobol_1_reversed(uint32_t index) {
    index ^= (index & 0xaaaaaaaau) >> 1;
    index ^= (index & 0xccccccccu) >> 2;
    index ^= (index & 0xf0f0f0f0u) >> 4;
    index ^= (index & 0xff00ff00u) >> 8;
    index ^= (index & 0xffff0000u) >> 16;
    return index;
}

/// The upper 24 bits as a number in [0, 1): exact, so that no point leaves its stratum; at most
/// 0x1.fffffep-1.
constexpr float unit_float(uint32_t bits) {
    return float(bits >> 8) * 0x1p-24f;
}

}  // namespace velatura::sampling
