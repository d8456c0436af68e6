// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "geometry/geometry_set.h"
#include "geometry/surface_point.h"
#include "integrator/mesh_accelerators.h"
#include "integrator/ray_counts.h"
#include "sampling/sampler.h"
#include "scene/scene.h"
#include "shading/material_evaluator.h"

#include <cstdint>
#include <optional>

namespace velatura::integrator {

/// Walks of light below surfaces: from scattering to scattering until it comes out of the same
/// mesh, whatever else lies inside. Made only for scenes with such materials. Immutable, safe to
/// share among threads; what it was made from must outlive it. Ref: Chiang, Kutz & Burley 2016,
/// "Practical and Controllable Subsurface Scattering for Production Path Tracing"; Wrenninge,
/// Villemin & Hery 2017, "Path Traced Subsurface Scattering using Anisotropic Phase Functions and
/// Non-Exponential Free Flights", section 3.
class SubsurfaceWalk {
  public:
    SubsurfaceWalk(const scene::Scene& scene,
                   const geometry::GeometrySet& geometry,
                   const shading::MaterialEvaluator& materials);

    /// Walks are given up after this many scatterings, which in solids up to some hundred mean free
    /// paths wide hardly any get to.
    static constexpr uint32_t max_steps = 1u << 16;

    struct Exit {
        geometry::SurfacePoint point;
        Vec3 wo;         ///< unit normal there, on the outside
        Rgb throughput;  ///< radiance towards the entry over what comes out
    };

    /// From a point that is seen from wo, into the side behind the unit normal n, which faces wo.
    /// Nothing: absorbed. bounce, repeat: see PixelSampler.
    std::optional<Exit> walk(const geometry::SurfacePoint& from,
                             const Vec3& n,
                             const Vec3& wo,
                             const shading::Subsurface& below,
                             const sampling::PixelSampler& sampler,
                             int bounce,
                             uint32_t repeat,
                             RayCounts& counts) const;

    size_t bytes() const;

  private:
    /// One mesh that is walked in.
    struct Solid {
        PlacedMesh placed;
        float outside;  ///< 1 or −1: the side of its normals that is outside
        std::optional<geometry::InstanceTransform> storage;
        const Mat4d* backward = nullptr;  ///< to the space of the tree; null: the same
    };

    /// Where the ray comes out no further away than ray.t_max.
    std::optional<geometry::SurfacePoint> find_exit(const Solid& solid,
                                                    const geometry::Ray& ray,
                                                    float& t) const;

    const scene::Scene& scene_;
    const geometry::GeometrySet& geometry_;
    MeshAccelerators trees_;
};

}  // namespace velatura::integrator
