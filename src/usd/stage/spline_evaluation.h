// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/layer/spline.h"

#include <optional>

namespace velatura::usd::stage {

/// Value of a spline at a time of its layer; nullopt where it has none (segments and
/// extrapolations of mode none, no knots).
/// Tangents that would make a Bezier segment run back in time are shortened, both by one factor.
/// Linear extrapolation goes on in the direction of the nearest segment at its end; after held
/// segments it is flat. A knot's value counts from its time on.
/// Ref: AOUSD Core Specification 1.0.1, 7.4.2.4 and 12.5.3.
std::optional<double> evaluate_spline(const layer::SplineValue& spline, double time);

}  // namespace velatura::usd::stage
