// SPDX-License-Identifier: Apache-2.0
#include "geometry/sphere_set.h"

#include "geometry/absolute.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace velatura::geometry {

namespace {}  // namespace

std::shared_ptr<const SphereSet> SphereSet::make(const scene::Points& points) {
    auto set = std::make_shared<SphereSet>();
    bool has_any = false;
    set->spheres_.reserve(points.points.size());
    for (size_t i = 0; i < points.points.size(); ++i) {
        const float width = points.widths.size() == 1 ? points.widths[0] : points.widths[i];
        set->spheres_.push_back({points.points[i], 0.5f * width});
        has_any = has_any || width > 0.0f;
    }
    return has_any ? set : nullptr;
}

PrimitiveBounds SphereSet::bounds(uint32_t index) const {
    const Sphere& sphere = spheres_[index];
    PrimitiveBounds bounds;
    if (!(sphere.radius > 0.0f)) return bounds;
    for (int k = 0; k < 3; ++k) {
        const auto c = double(sphere.center[k]), r = double(sphere.radius);
        const double reach = r * (1.0 + 0x1p-44) + 0x1p-50 * std::abs(c);
        bounds.box.min[k] = c - reach;
        bounds.box.max[k] = c + reach;
    }
    return bounds;
}

/// Ref: Haines, Günther, Akenine-Möller 2019, "Precision Improvements for Ray/Sphere Intersection".
bool SphereSet::intersect_primitive(const Sphere& sphere,
                                    const Vec3d& o,
                                    const Vec3d& d,
                                    double t[2]) {
    const Vec3d q = o - Vec3d(sphere.center);
    const auto r = double(sphere.radius);
    const double a = d.dot(d), b = -q.dot(d);
    const Vec3d nearest = q + d * (b / a);
    const double square = r * r - nearest.dot(nearest);
    if (!(square >= 0.0)) return false;
    const double root = std::sqrt(a * square), s = b + std::copysign(root, b);
    const double c = (q.length() - r) * (q.length() + r);
    t[0] = s == 0.0 ? 0.0 : c / s;
    t[1] = s / a;
    if (t[1] < t[0]) std::swap(t[0], t[1]);
    return true;
}

std::optional<PrimitiveHit> SphereSet::intersect(uint32_t index,
                                                 const Vec3d& o,
                                                 const Vec3d& d,
                                                 float t_max) const {
    double ends[2];
    if (!intersect_primitive(spheres_[index], o, d, ends)) return std::nullopt;
    for (const double t : ends) {
        if (!(float(t) > 0.0f)) continue;
        if (!(float(t) < t_max)) return std::nullopt;
        return PrimitiveHit{t};
    }
    return std::nullopt;
}

PrimitiveSurface SphereSet::surface(uint32_t index,
                                    const Vec3d& o,
                                    const Vec3d& d,
                                    const PrimitiveHit& hit) const {
    const Sphere& sphere = spheres_[index];
    const Vec3d center(sphere.center);
    const auto r = double(sphere.radius);
    double ends[2];
    // A line that misses by rounding grazes: its nearest point is the place
    double t = (center - o).dot(d) / d.dot(d);
    if (intersect_primitive(sphere, o, d, ends))
        t = std::abs(ends[0] - hit.t) <= std::abs(ends[1] - hit.t) ? ends[0] : ends[1];
    PrimitiveSurface surface;
    surface.n = normalize(o + d * t - center);
    surface.p = center + surface.n * r;
    surface.error = (absolute(center) + Vec3d(r)) * (16.0 * 0x1p-53) + Vec3d(0x1p-46 * r);
    surface.normal_by_p = Mat3d() * (1.0 / r);
    return surface;
}

bool SphereSet::tangents(
    uint32_t index, uint32_t, const Vec3d& p, const PrimitiveHit&, Vec3d& dpdu, Vec3d& dpdv) const {
    const Vec3d q = p - Vec3d(spheres_[index].center);
    dpdu = Vec3d(-q.y, q.x, 0.0);
    dpdv = q.cross(dpdu);
    return dpdv != Vec3d(0.0);
}

PrimvarRows SphereSet::primvar_rows(uint32_t index,
                                    scene::Interpolation interpolation,
                                    const PrimitiveHit&) const {
    PrimvarRows rows;
    const bool is_by_point = interpolation == scene::Interpolation::Varying ||
                             interpolation == scene::Interpolation::Vertex;
    if (is_by_point) rows.row[0] = index;
    return rows;
}

double SphereSet::area(uint32_t index) const {
    const auto r = double(spheres_[index].radius);
    return 4.0 * pi_d * r * r;
}

Vec3d SphereSet::point(uint32_t index, const Vec2d& u) const {
    const double z = 2.0 * u.x - 1.0, turn = 2.0 * pi_d * u.y, r = safe_sqrt(1.0 - z * z);
    return Vec3d(spheres_[index].center) +
           Vec3d(r * std::cos(turn), r * std::sin(turn), z) * double(spheres_[index].radius);
}

}  // namespace velatura::geometry
