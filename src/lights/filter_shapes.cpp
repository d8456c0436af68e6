// SPDX-License-Identifier: Apache-2.0
#include "lights/filter_shapes.h"

#include "lights/length_of.h"

#include <algorithm>
#include <cmath>

namespace velatura::lights {

using scene::FilterProjection;

double coverage(const scene::RoundedBox& box, const Vec3d& p) {
    Vec3d outside, edges;
    for (int i = 0; i < 3; ++i) {
        const double x = p[i] / double(box.scale[i]);
        const double below = double(box.lower[i]) - x, above = x - double(box.upper[i]);
        outside[i] = std::max({below, above, 0.0});
        edges[i] = double(below > above ? box.edge_lower[i] : box.edge_upper[i]);
    }
    const double distance = length_of(outside);
    if (!(distance > double(box.radius))) return 1.0;
    // Both lengths along the way out of the box: what scale makes of one unit, and the edge there
    const Vec3d out = outside / distance;
    Vec3d stretched, edge;
    for (int i = 0; i < 3; ++i) {
        stretched[i] = out[i] * double(box.scale[i]);
        edge[i] = out[i] * edges[i];
    }
    const double width = double(box.edge) * length_of(edge);
    const double t = (distance - double(box.radius)) * length_of(stretched) / width;
    // Written so that a width of 0 is caught
    return t < 1.0 ? 1.0 - t * t * (3.0 - 2.0 * t) : 0.0;
}

namespace {

/// Receivers that no light reaches through the plane, and with them lights.
std::optional<PlaneCrossing> not_passed(FilterProjection::Before before) {
    if (before == FilterProjection::Before::Black) return PlaneCrossing{Vec2d(0.0), true};
    return std::nullopt;
}

std::optional<PlaneCrossing> crossing_of_segment(const FilterProjection& projection,
                                                 const FilterSegment& segment) {
    const Vec3d &p = segment.p, &w = segment.wi;
    const double t = -p.z / w.z;
    if (!std::isfinite(t)) return not_passed(projection.before);
    const bool is_met = t > 0.0 && t < segment.distance;
    // Behind the receiver, as seen from the light
    const bool is_extended = t <= 0.0 && projection.before == FilterProjection::Before::Extended;
    if (!is_met && !is_extended) return not_passed(projection.before);
    return PlaneCrossing{{p.x + w.x * t, p.y + w.y * t}};
}

}  // namespace

std::optional<PlaneCrossing> plane_crossing(const FilterProjection& projection,
                                            const FilterSegment& segment) {
    if (projection.kind == FilterProjection::Kind::Segment)
        return crossing_of_segment(projection, segment);
    const Vec3d& p = segment.p;
    if (p.z > 0.0 && projection.before != FilterProjection::Before::Extended)
        return not_passed(projection.before);
    if (projection.kind == FilterProjection::Kind::Parallel) return PlaneCrossing{{p.x, p.y}};
    const double apex = double(projection.apex), height = apex - p.z;
    if (!(height > 0.0)) return not_passed(projection.before);
    return PlaneCrossing{{p.x * (apex / height), p.y * (apex / height)}};
}

}  // namespace velatura::lights
