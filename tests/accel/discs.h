// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "geometry/primitive_set.h"

#include <memory>
#include <vector>

namespace velatura::accel::test {

/// Round discs, many to a set: a kind of primitive that no tier knows, as a plugin may bring it.
/// Parameters are coordinates in the disc's plane.
class Discs final : public geometry::PrimitiveSet {
  public:
    struct Disc {
        Vec3d center, x, y;  ///< x, y: unit, perpendicular
        double radius;       ///< 0 or less: not there
    };

    explicit Discs(std::vector<Disc> discs) : discs_(std::move(discs)) {}

    const char* kind() const override { return "disc"; }

    uint32_t size() const override { return uint32_t(discs_.size()); }

    geometry::PrimitiveBounds bounds(uint32_t index) const override {
        const Disc& disc = discs_[index];
        geometry::PrimitiveBounds bounds;
        if (!(disc.radius > 0)) return bounds;
        // Room for the rounding of places on it
        const Vec3d half(disc.radius * (1 + 1e-9) + 1e-12 * disc.center.length());
        bounds.box = {disc.center - half, disc.center + half};
        return bounds;
    }

    std::optional<geometry::PrimitiveHit> intersect(uint32_t index,
                                                    const Vec3d& o,
                                                    const Vec3d& d,
                                                    float t_max) const override {
        const Disc& disc = discs_[index];
        const Vec3d n = disc.x.cross(disc.y), q = disc.center - o;
        const double across = d.dot(n);
        if (across == 0) return std::nullopt;
        const double t = q.dot(n) / across;
        const Vec3d p = d * t - q;
        const double u = p.dot(disc.x), v = p.dot(disc.y);
        if (!(float(t) > 0 && float(t) < t_max) || u * u + v * v > disc.radius * disc.radius)
            return std::nullopt;
        return geometry::PrimitiveHit{t, float(u), float(v)};
    }

    geometry::PrimitiveSurface surface(uint32_t index,
                                       const Vec3d&,
                                       const Vec3d&,
                                       const geometry::PrimitiveHit& hit) const override {
        const Disc& disc = discs_[index];
        geometry::PrimitiveSurface surface;
        surface.p = disc.center + disc.x * double(hit.u) + disc.y * double(hit.v);
        surface.error = Vec3d(1e-7 * (disc.radius + disc.center.length()));
        surface.n = disc.x.cross(disc.y);
        surface.normal_by_p = Mat3d(0.0);
        return surface;
    }

    bool tangents(uint32_t index,
                  uint32_t,
                  const Vec3d&,
                  const geometry::PrimitiveHit&,
                  Vec3d& dpdu,
                  Vec3d& dpdv) const override {
        dpdu = discs_[index].x;
        dpdv = discs_[index].y;
        return true;
    }

    size_t bytes() const override { return discs_.size() * sizeof(Disc); }

    double area(uint32_t index) const override {
        return pi_d * discs_[index].radius * discs_[index].radius;
    }

    Vec3d point(uint32_t index, const Vec2d& u) const override {
        const double r = discs_[index].radius * std::sqrt(u.x), turn = 2 * pi_d * u.y;
        return discs_[index].center + discs_[index].x * (r * std::cos(turn)) +
               discs_[index].y * (r * std::sin(turn));
    }

  private:
    std::vector<Disc> discs_;
};

}  // namespace velatura::accel::test
