// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

namespace velatura::test {

/// A small stage as text: shapes of every kind, materials, lights, placements, instances, motion
/// and a camera, all drawn by the seed and all valid, many of them at the ends of their ranges. One
/// seed is one stage for good.
std::string random_scene_usda(uint64_t seed);

}  // namespace velatura::test
