// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "translate/context/instance_source.h"
#include "translate/motion/scoped_time.h"

#include <cstddef>
#include <vector>

namespace velatura::translate::instancing {

/// Whether light would have to be sampled from what moves, or volumes looked up in it.
bool must_stay(const Context& ctx, InstanceSource& what);

/// How far what is placed reaches from its origin, about.
double reach_of(InstanceSource& what);

/// Whether something of this reach, placed by m, is too far from where a straight line leads.
bool strays(const Mat4d& m, const Mat4d& straight, double reach);

bool fits_floats(const Mat4d& m);

/// f of the way from a to b.
Mat4d between(const Mat4d& a, const Mat4d& b, double f);

/// Segments, a power of two, as many as there are samples to turn at while the shutter is open:
/// those at `times`, and of transforms of the prim and what is above it in `frame`.
size_t fewest_segments(std::vector<double> times, Prim prim, Prim frame, const Shutter& shutter);

/// Gives the placement of a native instance the keys of its motion while the shutter is open: so
/// many that matrices between stray from straight lines by less than 2^-11 of what is placed. What
/// holds lights stays, and is named.
void read_placement_motion(Context& ctx,
                           Prim instance,
                           const InstanceSource& parent,
                           Placement& placement);

/// Keys of something that stands in something else; both may move.
std::vector<Mat4d> composed_motion(const Placement& inner,
                                   const Mat4d& outer,
                                   const std::vector<Mat4d>& outer_later);

/// Where it is asked, between two keys, how far the matrices are from a straight line.
inline constexpr double ways_between[] = {motion::probe_fraction, 0.5, 1 - motion::probe_fraction};

}  // namespace velatura::translate::instancing
