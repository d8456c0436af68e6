// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"

#include <cstddef>

namespace velatura::geometry {

/// Balls around all points of a cubic Bézier curve, of a radius that is one too: a round curve with
/// round ends is what they fill.
struct Sweep {
    Vec3d p[4];
    double r[4];
};

/// Whether the outline of the sweep is that of a tube: its radius does not reach the center of its
/// bends anywhere. Then among balls next to each other that a line meets, those by which it enters
/// have one first, and between that and the last balls there is no other minimum:
/// |c'|² − r'² > r·(r'' + n·c'') for all n with n·c' = −r' says so, since it is the sign of the
/// second derivative at every extremum. Shown by the hulls of Bernstein polynomials, thus false
/// also for long parts of which it is true; true where one ball holds all others.
bool is_regular(const Sweep& sweep);

/// Box of all balls, but for rounding.
Box3d bounds_of(const Sweep& sweep);

/// Where a line enters or leaves a sweep: on the ball around the point at u.
struct SweepCrossing {
    double t = 0;
    double u = 0;  ///< of the sweep's own curve, exactly 0 or 1 on the balls that end it
    Vec3d n;       ///< unit, towards the outside
};

/// A line and a regular sweep. The line is inside of a ball along one interval; it is inside of the
/// sweep in the union of these. The balls that are met belong to stretches of the curve, at most
/// three, which lie between roots of a polynomial of degree 6; over each, entries have one minimum
/// and exits one maximum. Roots are isolated by changes of sign of Bernstein coefficients, the
/// extrema found by putting in place of the curve its tangent cone, of which they are known in
/// closed form, safely within brackets.
/// Ref: van Wijk 1984, "Ray Tracing Objects Defined by Sweeping a Sphere" (the surface); Reshetov,
/// Luebke 2018, "Phantom Ray-Hair Intersector", HPG (the iteration by cones).
class SweptRay {
  public:
    SweptRay(const Sweep& sweep, const Vec3d& o, const Vec3d& d);

    /// False where nothing is met between 0 and t_max, by boxes around the line.
    bool can_intersect(float t_max) const;

    /// Finds the stretches. Returns their number.
    int find_stretches();

    /// Where the line comes into the balls of a stretch, and where it leaves the last of them.
    SweepCrossing entry(int stretch) const { return extremum(stretches_[stretch], -1.0); }

    SweepCrossing exit(int stretch) const { return extremum(stretches_[stretch], 1.0); }

  private:
    /// Stretch of the curve the balls of which the line meets, between a and b. What is not met
    /// begins somewhere in between where an end is open.
    struct Stretch {
        double a, b;
        bool is_open_a, is_open_b;
        double inside;  ///< a place in it
    };

    void add_stretches(const double (&g)[7], double a, double b, int depth);
    SweepCrossing extremum(const Stretch& stretch, double side) const;

    Vec3d across_[2], along_;  ///< unit
    double length_;            ///< of d
    // Control values relative to o, along the three
    double x_[4], y_[4], z_[4], r_[4];
    double largest_r_;
    Stretch stretches_[4];
    int count_ = 0;
};

}  // namespace velatura::geometry
