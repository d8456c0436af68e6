// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"

namespace velatura::camera {

/// The opening between the blades of a lens: a polygon with corners on the unit circle, its edges
/// bent towards that circle. At angle θ from the middle of an edge it reaches as far as
/// b(θ) = (1 − roundness)·cos(π/n)/cos(θ) + roundness.
class Aperture {
  public:
    /// Args: blades >= 3; rotation of a corner from +x towards +y, in degrees; roundness in [0, 1],
    ///       0 = straight edges, 1 = the circle.
    Aperture(int blades, double rotation_deg, double roundness);

    /// The point of the opening for one of the unit disk. Areas keep their ratios: what is even on
    /// the disk is even in the opening. Rings stay rings, sectors sectors.
    Vec2d from_disk(const Vec2d& disk) const;

    /// Area of the opening: π for the circle.
    double area() const;

  private:
    double reach(double angle) const;
    /// Integral of reach² from the middle of the edge.
    double integral(double angle) const;

    double blades_, roundness_;
    double first_edge_;  ///< angle of its middle
    double half_wedge_;  ///< angle from the middle of an edge to its end
    double edge_;        ///< distance of a straight edge, times 1 − roundness
    double whole_;       ///< integral(half_wedge_)
};

}  // namespace velatura::camera
