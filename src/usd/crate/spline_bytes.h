// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/crate/cursor.h"
#include "usd/layer/spline.h"

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace velatura::usd::crate {

/// Custom data of knots by their times.
using KnotData = std::vector<std::pair<double, layer::Dictionary>>;

/// Reads a spline's own bytes; false with the problem, whose place counts from their beginning.
/// Ref: AOUSD Core Specification 1.0.1, 16.3.10.33 (its mask of post-extrapolation has two bits,
/// which cannot hold its seven modes: three are read); version 2, with tangent algorithms, from
/// OpenUSD.
bool decode_spline(std::string_view blob,
                   KnotData custom_data,
                   layer::SplineValue& out,
                   Problem& problem);

/// The bytes of a spline, empty for one without anything in it.
std::string encode_spline(const layer::SplineValue& spline);

/// The bytes hold tangent algorithms, which need version 0.13.
bool has_tangent_algorithms(const layer::SplineValue& spline);

}  // namespace velatura::usd::crate
