// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/diagnostics.h"
#include "base/math.h"
#include "geometry/surface_point.h"
#include "lights/light_filter.h"
#include "lights/shaping.h"
#include "scene/affine_motion.h"
#include "scene/scene.h"

#include <cstdint>
#include <functional>
#include <vector>

namespace velatura::geometry {
class GeometrySet;
}

namespace velatura::shading {
class MaterialEvaluator;
}

namespace velatura::lights {

/// Receiver of emitted light. A mesh light can have one radiance for the camera and another one for
/// illumination.
enum class EmissionReceiver : uint8_t {
    Camera,     ///< the camera, directly or by delta scattering
    Scattering  ///< a non-delta scattering event, by light or BSDF sampling: illumination
};

/// Reads the gobos of a mesh light.
using GobosOfLight = std::function<GoboLoader(const scene::MeshLight& light)>;

/// Emission of the surfaces of a scene, by their materials or as mesh lights. Immutable, safe to
/// share among threads; the scene, the geometry and the materials must outlive it.
class SurfaceEmission {
  public:
    /// A normalized light on a placement without area emits nothing, with a warning. gobos: reads
    /// textures of light filters.
    SurfaceEmission(const scene::Scene& scene,
                    const geometry::GeometrySet& geometry,
                    const shading::MaterialEvaluator& materials,
                    const GobosOfLight& gobos,
                    Diagnostics& diagnostics);

    /// True when some surface can illuminate the scene.
    bool has_any() const;

    /// True when triangles of this material on this shape can illuminate the scene.
    /// Args: instance: scene::none for shapes placed directly.
    bool can_light(uint32_t instance, uint32_t shape, scene::MaterialId material) const;

    /// True when the point can emit towards some receiver; two comparisons for most points.
    bool can_emit(const geometry::SurfacePoint& point) const;

    /// Emitted radiance towards wo (unit, render space), not multiplied by presence. filtered_for:
    /// position of the receiver, for light filters; null: without them.
    Rgb radiance(const geometry::SurfacePoint& point,
                 const Vec3& wo,
                 float footprint,
                 EmissionReceiver emission_receiver,
                 const Vec3* filtered_for) const;

    /// True when mean_radiance() is constant over triangles of this material.
    bool is_constant(uint32_t instance, uint32_t shape, scene::MaterialId material) const;

    /// Mesh light of the shape; null when it has none.
    const scene::MeshLight* light(uint32_t instance, uint32_t shape) const;

    /// Ratio of the emission of a shape on two instances of its prototype.
    double ratio(uint32_t instance, uint32_t other, uint32_t shape) const;

    /// Radiance for illumination, averaged over all directions.
    Rgb mean_radiance(const geometry::SurfacePoint& point, float footprint) const;

  private:
    /// A mesh light where it stands.
    struct Placed {
        Rgb Le = Rgb(0.0f);
        uint32_t light = scene::none;
        uint32_t shaping = scene::none;  // of shapings_
        uint32_t filters = scene::none;  // of filters_
        uint32_t motion = scene::none;   // of motions_: shaping and filters move
    };

    /// A shaping that is active, and the part of all emission that it leaves.
    struct Shaped {
        LightShaping shaping;
        float mean = 1;
    };

    Rgb unshaped(const Placed& placed,
                 const geometry::SurfacePoint& point,
                 const Vec3& wo,
                 float footprint) const;
    Rgb directed(const Placed& placed,
                 const scene::AffineMotion& motion,
                 const geometry::SurfacePoint& point,
                 const Vec3& wo,
                 const Vec3* filtered_for) const;
    const Placed* find(uint32_t instance, uint32_t shape) const;
    Placed place(uint32_t light,
                 double area,
                 const Mat4d& render_from_parent,
                 const scene::AffineMotion& motion,
                 const GobosOfLight& gobos);
    scene::AffineMotion motion_of(size_t instance, uint32_t light) const;
    void place_direct(const GobosOfLight& gobos);
    void place_instances(const GobosOfLight& gobos);
    void warn_without_area(uint32_t light, Diagnostics& diagnostics) const;

    const scene::Scene& scene_;
    const geometry::GeometrySet& geometry_;
    const shading::MaterialEvaluator& materials_;
    std::vector<Placed> placed_;
    std::vector<Shaped> shapings_;
    std::vector<FilterChain> filters_;
    std::vector<scene::AffineMotion> motions_;
    std::vector<uint32_t> of_shape_;  // [shape placed directly], of placed_
    std::vector<std::vector<uint32_t>>
        slot_;                           // [prototype][shape], among the lights of one placement
    std::vector<uint32_t> of_instance_;  // [instance], of placed_: slot 0
    std::vector<bool> lacks_area_;       // [mesh light], on some placement
};

}  // namespace velatura::lights
