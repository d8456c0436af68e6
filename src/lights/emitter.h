// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "lights/light_bounds.h"
#include "lights/shaping.h"

#include <optional>

namespace velatura::lights {

/// LightSample in double, before the cast.
struct EmitterSample {
    Vec3d wi;  ///< unit, toward the light
    double distance = 0;
    Rgb Le = Rgb(0.0f);
    double pdf = 0;  ///< [1/sr]; 1 for a delta light
};

/// LightHit in double, before the cast.
struct EmitterHit {
    double t = 0;
    Rgb Le = Rgb(0.0f);
    double pdf = 0;  ///< [1/sr]
};

/// A point of a light, chosen without regard to who looks; of a light at infinity a direction.
struct EmitterPoint {
    Vec3d p = Vec3d(0.0);  ///< unused at infinity
    Vec3d n = Vec3d(
        0.0);  ///< unit: outward normal of the surface; at infinity the direction toward the light
    double pdf = 0;  ///< per area, at infinity [1/sr]; 1 when the light is a delta
};

/// One light, ready to be sampled. All in render space and double.
class Emitter {
  public:
    virtual ~Emitter() = default;
    /// A direction from p; nothing when the light does not reach p or the sample fell beside it.
    virtual std::optional<EmitterSample> sample(const Vec3d& p, const Vec2& u) const = 0;
    /// What the ray from o along the unit vector d sees at t > 0; pdf is the density of sample(o,
    /// ·) there.
    virtual std::optional<EmitterHit> intersect(const Vec3d& o, const Vec3d& d) const = 0;

    /// A point of the light by area, at infinity by solid angle, likelier where it faces along
    /// `facing` (unit) when that is given; nothing for kinds that have no such points.
    virtual std::optional<EmitterPoint> sample_point(const Vec2& u,
                                                     const std::optional<Vec3d>& facing) const {
        (void)u, (void)facing;
        return std::nullopt;
    }

    /// What a ray from o along d (unit) that passes through the point meets there: intersect()'s
    /// Le; black when it crosses the light elsewhere first.
    virtual Rgb radiance_at(const EmitterPoint& point, const Vec3d& o, const Vec3d& d) const {
        (void)point, (void)o, (void)d;
        return Rgb(0.0f);
    }

    /// See LightSet::power.
    virtual double power(double scene_radius) const = 0;

    /// Part of its light that sample() is there to find; BSDF sampling finds the rest. Below 1 only
    /// under MIS compensation.
    virtual double sampled_share() const { return 1.0; }

    virtual bool is_infinite() const { return false; }

    virtual bool is_delta() const { return false; }

    /// The light itself, without the filters in front of it.
    virtual const Emitter& unfiltered() const { return *this; }

    /// Box around a finite light.
    virtual Box3d bounds() const { return {}; }

    /// Where a finite light shines, and how strongly.
    virtual EmissionCone emission_cone() const { return {}; }
};

/// Affine frame of a shape: object point (a, b, c) lies at origin + a·x + b·y + c·z. Shapes are
/// sampled in object space, where they are simple; the density of a direction changes by how the
/// map stretches directions there.
struct ShapeFrame {
    Vec3d origin, x, y, z;
    Vec3d dual_x, dual_y, dual_z;  ///< rows of the inverse, transposed: a = (p − origin)·dual_x
    double volume = 0;             ///< |det|

    /// Nothing when the axes are not finite or span no volume in double precision.
    static std::optional<ShapeFrame> make(const Vec3d& origin,
                                          const Vec3d& x,
                                          const Vec3d& y,
                                          const Vec3d& z);

    Vec3d to_object_point(const Vec3d& p) const { return to_object_direction(p - origin); }

    Vec3d to_object_direction(const Vec3d& v) const {
        return {v.dot(dual_x), v.dot(dual_y), v.dot(dual_z)};
    }

    Vec3d from_object_direction(const Vec3d& v) const { return x * v.x + y * v.y + z * v.z; }

    /// Solid angle around an object direction ÷ the solid angle it becomes; `stretch` is the length
    /// in render space of the unit object direction.
    double density_ratio(double stretch) const { return stretch * stretch * stretch / volume; }
};

/// A direction in object space with the distance to the shape, both in object units.
struct ObjectSample {
    Vec3d wi;  ///< unit
    double distance = 0;
    double pdf = 0;
};

/// The same in render space, without radiance.
EmitterSample to_render(const ShapeFrame& frame, const ObjectSample& sample);

/// Point in the unit disk, area-preserving. Ref: Shirley & Chiu 1997, "A Low Distortion Map Between
/// Disk and Square".
Vec2d concentric_disk(const Vec2& u);

/// Unit direction within the cone around +z, uniform in solid angle and continuous in u.
/// Args: one_minus_cos of the cone's half angle, in (0, 2].
Vec3d sample_cone(const Vec2& u, double one_minus_cos);

/// Whether the upper 3×3 keeps angles, within a relative 1e-6.
bool is_similarity(const Mat4d& m);

/// Coordinates of `local` in a right-handed orthonormal frame whose z is the unit vector `axis`,
/// taken to render space.
Vec3d from_axis_frame(const Vec3d& axis, const Vec3d& local);

}  // namespace velatura::lights
