// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string_view>

namespace velatura {

/// 64-bit finaliser with full avalanche. Ref: Stafford 2011, "Better Bit Mixing", variant 13 (as in
/// SplitMix64).
constexpr uint64_t mix64(uint64_t v) {
    v ^= v >> 30;
    v *= 0xbf58476d1ce4e5b9ull;
    v ^= v >> 27;
    v *= 0x94d049bb133111ebull;
    v ^= v >> 31;
    return v;
}

constexpr uint64_t hash_combine(uint64_t seed, uint64_t value) {
    return mix64(seed + 0x9e3779b97f4a7c15ull + mix64(value));
}

/// 64-bit FNV-1a of the bytes; stable across machines and runs.
constexpr uint64_t hash_string(std::string_view s) {
    uint64_t h = 14695981039346656037ull;
    for (const char c : s) h = (h ^ uint64_t(static_cast<unsigned char>(c))) * 1099511628211ull;
    return h;
}

}  // namespace velatura
