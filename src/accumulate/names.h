// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace velatura::accumulate {

/// Longest channel name that older EXR readers take.
inline constexpr size_t max_channel_name_bytes = 31;
/// Leaves room for `tail_` or `b999_` before and `_hA.R` behind.
inline constexpr size_t max_group_name_bytes = 21;

/// The same with `clamp_tail_` before.
inline constexpr size_t max_group_name_bytes_beside_clamps = 15;
/// Group and caster together, with `S_` before, `_` between and `_hA.R` behind.
inline constexpr size_t max_group_name_bytes_beside_casters = 11, max_caster_name_bytes = 12;
/// With `tail_` before, and `_subsurface` or `_emission` and `_hA.R` behind; with `clamp_`, too.
inline constexpr size_t max_group_name_bytes_beside_lobes = 10,
                        max_group_name_bytes_beside_clamped_lobes = 4;
/// Of surfaces that emit; no light is called so.
inline constexpr const char* emissive_group = "emissive";
/// Of what no named caster took.
inline constexpr const char* rest_caster = "rest";

/// Turns any text into a legal group name: [A-Za-z0-9_], not empty, not numeric, not a word of the
/// mixer (`all`, `direct`, `indirect`, `tail`, `env`, `shadow`, `b0`…), at most
/// max_group_name_bytes.
std::string legal_group_name(std::string_view text);

/// `[A-Za-z0-9_]` with at most one dot inside, at most 31 bytes, layer part not numeric.
bool is_legal_channel_name(std::string_view name);

}  // namespace velatura::accumulate
