// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/diagnostics.h"
#include "base/math.h"
#include "geometry/surface_point.h"
#include "lights/shaping.h"
#include "scene/scene.h"

#include <cstdint>
#include <vector>

namespace velatura::geometry {
class GeometrySet;
}

namespace velatura::shading {
class MaterialEvaluator;
}

namespace velatura::lights {

/// Who looks at an emissive surface. A mesh light may light the scene otherwise than it looks.
enum class Onlooker : uint8_t {
    Eye,        ///< the camera, also by way of delta scattering
    Scattering  ///< what scatters without delta, and may look by light sampling: it is lit
};

/// What the surfaces of a scene emit, by their materials or as mesh lights. Immutable, safe to
/// share among threads; the scene, the geometry and the materials must outlive it.
class SurfaceEmission {
  public:
    /// A normalized light on a placement without area emits nothing, with a warning.
    SurfaceEmission(const scene::Scene& scene,
                    const geometry::GeometrySet& geometry,
                    const shading::MaterialEvaluator& materials,
                    Diagnostics& diagnostics);

    /// Whether any surface may light the scene.
    bool has_any() const;

    /// Whether triangles of this material on this shape may light the scene. Args: instance: none
    /// for shapes placed directly.
    bool may_light(uint32_t instance, uint32_t shape, scene::MaterialId material) const;

    /// Whether somebody may see the point emit, at the cost of two comparisons for most points.
    bool may_emit(const geometry::SurfacePoint& point) const;

    /// Radiance towards wo (unit), not weighed by presence.
    Rgb radiance(const geometry::SurfacePoint& point,
                 const Vec3& wo,
                 float footprint,
                 Onlooker onlooker) const;

    /// Whether mean_radiance() is the same all over triangles of this material.
    bool is_constant(uint32_t instance, uint32_t shape, scene::MaterialId material) const;

    /// The light that the shape is; null when it is none.
    const scene::MeshLight* light(uint32_t instance, uint32_t shape) const;

    /// How much stronger the shape shines on one instance of its prototype than on another.
    double ratio(uint32_t instance, uint32_t other, uint32_t shape) const;

    /// Radiance by which the point lights the scene, averaged over all directions.
    Rgb mean_radiance(const geometry::SurfacePoint& point, float footprint) const;

  private:
    /// A mesh light where it stands.
    struct Placed {
        Rgb Le = Rgb(0.0f);
        uint32_t light = scene::none;
        uint32_t shaping = scene::none;  // of shapings_
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
    const Placed* find(uint32_t instance, uint32_t shape) const;
    Placed place(uint32_t light, double area, const Mat4d& render_from_holder);
    void place_direct();
    void place_instances();
    void warn_without_area(uint32_t light, Diagnostics& diagnostics) const;

    const scene::Scene& scene_;
    const geometry::GeometrySet& geometry_;
    const shading::MaterialEvaluator& materials_;
    std::vector<Placed> placed_;
    std::vector<Shaped> shapings_;
    std::vector<uint32_t> of_shape_;  // [shape placed directly], of placed_
    std::vector<std::vector<uint32_t>>
        slot_;                           // [prototype][shape], among the lights of one placement
    std::vector<uint32_t> of_instance_;  // [instance], of placed_: slot 0
    std::vector<bool> lacks_area_;       // [mesh light], on some placement
};

}  // namespace velatura::lights
