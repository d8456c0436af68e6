// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "translate/context/context.h"

#include <cstddef>
#include <optional>
#include <vector>

namespace velatura::translate::motion {

/// How the elements of an array go on from one of its samples, whatever the next sample holds.
struct Velocities {
    TimeCode since;                     ///< of the sample
    std::vector<double> values;         ///< [element][3] units, or degrees, per second
    std::vector<double> accelerations;  ///< [element][3] per second²; empty: none
    double seconds_per_time = 0;        ///< with motion:velocityScale

    /// What is to be added to row i, number k, at a time: s·(v + s·a/2).
    double way(size_t i, size_t k, double time) const {
        const double seconds = (time - since.value()) * seconds_per_time;
        double v = values[3 * i + k];
        if (!accelerations.empty()) v += 0.5 * seconds * accelerations[3 * i + k];
        return seconds * v;
    }
};

/// Time of the sample at or before a time, of the first one where there is none; the default time
/// for what has no samples.
TimeCode held_time(const Attribute& attribute, TimeCode time);

/// Velocities of what `carried` holds at the frame's instant. Only those count whose samples around
/// that instant are at the same times as those of `carried`, and which are as many; else a warning
/// says why. The same holds for accelerations beside them.
/// Args: names of the attributes; none for accelerations where there is no such thing.
/// Ref:  UsdGeomPointBased::ComputePointsAtTimes,
///       UsdGeomPointInstancer::ComputeInstanceTransformsAtTimes, UsdGeomMotionAPI.
std::optional<Velocities> read_velocities(Context& ctx,
                                          const Attribute& carried,
                                          size_t elements,
                                          const char* velocities,
                                          const char* accelerations = nullptr);

/// Number that the prim or the nearest one above authors, for attributes of UsdGeomMotionAPI.
double inherited_number(Context& ctx, Prim prim, const char* name, double fallback);

}  // namespace velatura::translate::motion
