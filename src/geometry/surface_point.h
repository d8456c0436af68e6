// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "geometry/primitive_set.h"
#include "scene/ids.h"

#include <cstdint>
#include <limits>
#include <optional>

namespace velatura::scene {
struct Scene;
}

namespace velatura::geometry {

class TriangleMesh;
class GeometrySet;

/// A ray in render space: points o + t·d for 0 < t < t_max. d need not be unit; t is in multiples
/// of |d|.
struct Ray {
    Vec3 o;
    Vec3 d;
    float t_max = std::numeric_limits<float>::infinity();
    float time = 0;  ///< of the shutter, in [0, 1): where what moves is met, see motion.h
};

/// Where a ray meets a triangle or a primitive of a PrimitiveSet, as traversal reports it.
struct Hit {
    float t = std::numeric_limits<float>::infinity();
    float b1 = 0, b2 = 0;  ///< barycentric weights of the triangle's second and third corner;
                           ///< PrimitiveHit::u and v of a primitive
    uint32_t instance = scene::none;  ///< index into Scene::instances; none = placed directly
    uint32_t shape = scene::none;     ///< index into the prototype's or the scene's shapes
    uint32_t triangle = scene::none;  ///< index into the shape's TriangleMesh or PrimitiveSet

    bool is_valid() const { return triangle != scene::none; }
};

/// A surface where light scatters, in render space. All vectors unit.
struct SurfacePoint {
    Vec3 p;
    Vec3 p_error;  ///< absolute bound of the rounding error of p, per axis
    Vec3 ng;       ///< geometric normal, on the outside by orientation
    Vec3 ns;       ///< interpolated normal, in the hemisphere of ng
    float b1 = 0, b2 = 0;
    float time = 0;                      ///< of the ray, and of those that leave from here
    const TriangleMesh* mesh = nullptr;  ///< without triangles where it has primitives
    uint32_t triangle = 0;               ///< or primitive
    uint32_t face = 0;                   ///< authored polygon; PrimitiveSurface::face
    int8_t side = 0;  ///< rays start on the side of ng (1), of −ng (−1) or of their direction (0)
    scene::MaterialId material = scene::none;
    uint32_t instance = scene::none;
    uint32_t shape = scene::none;
    bool double_sided = false;
    scene::ProvenanceId provenance = scene::none;
};

/// The surface at a valid hit of a ray. p comes from the barycentric weights, not from t, in
/// double, and is rounded once; p_error bounds that rounding and, for instances, that of carrying a
/// ray into prototype space. Of a primitive p is found anew along the ray, also in double. ng
/// follows winding, flip_normals and mirroring; ns is ng where the mesh is faceted, and on
/// primitives without a facet_n. Of what moves all of it is that of the ray's time. Ref: Pharr,
/// Jakob, Humphreys 2023, "Physically Based Rendering" 4th ed., section 6.8.
SurfacePoint make_surface_point(const scene::Scene& scene,
                                const GeometrySet& geometry,
                                const Ray& ray,
                                const Hit& hit);

/// How the texture coordinates run over a surface. Unit vectors, render space.
struct Tangents {
    Vec3 dpds;  ///< along ∂p/∂s
    Vec3 dpdt;  ///< along ∂p/∂t, not made perpendicular
};

/// Tangents at a point by the texture coordinates of its material's normal map, else by those of
/// the mesh; of a primitive those that it has by itself. A frame around ns where they do not span
/// the surface.
Tangents tangents(const scene::Scene& scene, const SurfacePoint& point);

/// The point where rays leave a surface that is seen from wo and does not transmit: above the
/// facet, near the curved surface that its interpolated normals stand for, so that facets do not
/// shadow their own lit side at the terminator. p moves by the mean of its distances from the
/// tangent planes of the corners, towards wo only: twice the height of the arc, which clears the
/// neighboring facets. Nothing where the surface is flat or hollow towards wo, where
/// normals turn by less than half a degree from the facet (neighbors by 1), and where they turn by
/// more than 45 degrees: those do not tell of a curved surface. Every ray of the path must leave
/// from here, also those of light sampling. Ref: Hanika 2021, "Hacking the Shadow Terminator", Ray
/// Tracing Gems II, chapter 4.
std::optional<SurfacePoint> lifted(const GeometrySet& geometry,
                                   const SurfacePoint& point,
                                   const Vec3& wo);

/// The surface of the primitive that was hit, where o + t·d meets it nearest to hit.t, in render
/// space: see PrimitiveSet::surface. n is on the outside by orientation. The ray need not be the
/// one that was traced, only near it.
PrimitiveSurface primitive_surface(
    const GeometrySet& geometry, const Hit& hit, const Vec3d& o, const Vec3d& d, float time = 0);

/// Primvar at the point: the mesh's own, else what the instance hands down.
/// Writes the floats that the primvar has and leaves the rest of `out` alone; false when there is
/// none.
bool primvar(const scene::Scene& scene,
             const SurfacePoint& point,
             scene::PrimvarId id,
             float out[4]);

/// Point beside the surface, on point.side, else on the side to which w points, from which a ray
/// along w cannot meet the surface again. Moves along ng by the error bound and then outward by a
/// float or two; no constant distance is involved. Ref: Pharr et al. 2023, section 6.8.6.
Vec3 offset_ray_origin(const SurfacePoint& point, const Vec3& w);

/// Ray that leaves the surface along d.
Ray spawn_ray(const SurfacePoint& point, const Vec3& d);

/// Ray from a surface towards p1 (render space): p1 is at t = 1 = t_max.
Ray spawn_ray_to(const SurfacePoint& point, const Vec3& p1);

/// Ray between two surfaces that meets neither; t_max = 1.
Ray spawn_ray_to(const SurfacePoint& p0, const SurfacePoint& p1);

}  // namespace velatura::geometry
