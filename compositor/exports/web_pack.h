// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace velatura::compositor::exports {

/// Numbers of 16 bits without loss, as the page reads them (web/planes.js): halves of a layer or
/// the entries of a LUT, [height][width][3].
///
/// Halves are taken as signed whole numbers in the order of their values, whose differences are
/// small where light is smooth, and which differ from channel to channel by little. What is stored
/// are G, R − G and B − G, each less what its neighbors predict, as bytes in planes, in zlib's
/// format: predictors of the three (left, median of gradients, mean), then low and high bytes of
/// each.
std::string pack_planes(std::span<const uint16_t> rgb, int width, int height);

}  // namespace velatura::compositor::exports
