// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "translate/context/instance_source.h"
#include "translate/motion/scoped_time.h"

#include <cstddef>
#include <vector>

namespace velatura::translate::instancing {

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

/// Where a prim is while the shutter is open.
struct PrimMotion {
    const Vec3d& origin;  ///< of what is placed
    const Mat4d& matrix;  ///< from there into the space of the parent, at the frame's instant
    double reach = 0;     ///< see reach_of()
};

/// Keys of the motion of a prim that is carried by its transforms and those above it, the first
/// when the shutter opens: so many that matrices between stray from straight lines by less than
/// 2^-11 of what is placed. Empty: it stays, or cannot be followed and is named.
std::vector<Mat4d> read_carried_keys(Context& ctx,
                                     Prim prim,
                                     const InstanceSource& parent,
                                     const PrimMotion& placed);

/// Gives the placement of a native instance the keys of its motion.
void read_placement_motion(Context& ctx,
                           Prim instance,
                           const InstanceSource& parent,
                           Placement& placement);

/// Gives a light the keys of its motion; of one at infinity only what turns it.
void read_light_motion(Context& ctx, const InstanceSource& parent, LightSite& site);

/// Gives a volume the keys of its motion.
void read_volume_motion(Context& ctx,
                        Prim prim,
                        const InstanceSource& parent,
                        scene::Volume& volume);

/// How far a volume reaches from its origin, as far as its extent tells.
double reach_of(const scene::Volume& volume);

/// Something that stands in something else.
struct InnerMotion {
    const Mat4d& matrix;
    const std::vector<Mat4d>& later;
    double reach = 0;
};

/// Keys of something that stands in something else; both may move.
std::vector<Mat4d> composed_motion(const InnerMotion& inner,
                                   const Mat4d& outer,
                                   const std::vector<Mat4d>& outer_later);

/// Where it is asked, between two keys, how far the matrices are from a straight line.
inline constexpr double ways_between[] = {motion::probe_fraction, 0.5, 1 - motion::probe_fraction};

}  // namespace velatura::translate::instancing
