// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "geometry/refinement.h"
#include "geometry/surface_point.h"
#include "geometry/tessellate.h"
#include "geometry/triangle_mesh.h"
#include "scene/scene.h"

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

namespace velatura::geometry {

/// How an instance maps between its prototype's space and render space.
struct InstanceTransform {
    uint32_t prototype = 0;
    Mat4 render_from_prototype;
    /// Inverse of the above, in double. Traversal carries rays through it in double too: the error
    /// bounds of SurfacePoint count on that.
    Mat4d prototype_from_render;
    /// Entries |prototype_from_render|·|render_from_prototype| (upper 3×3 and translation row, in
    /// absolute values): times the roundoff, how far the rounding of a ray in prototype space
    /// reaches in render space.
    Mat4d round_trip_bound;
    bool is_mirrored = false;    ///< negative determinant
    bool is_invertible = false;  ///< an instance that is not cannot be hit
};

/// Where an instance is at a time (Ray::time).
Mat4 render_from_prototype(const scene::Instance& instance, float time);

/// TriangleMeshes of the scene's shapes and of each prototype: what acceleration structures are
/// built over. Does not refer to the scene after construction. Immutable but for place_instances,
/// safe to share among threads.
class GeometrySet {
  public:
    GeometrySet() = default;
    /// Tessellates in parallel; the result does not depend on the number of threads. Quadrics stay
    /// what they are, but for those that are sampled as lights, triangle by triangle, and those
    /// that are too distorted. Curves and points are never triangles. Meshes
    /// with a subdivision scheme or displacement are what `refined` has for them, else their
    /// polygons.
    explicit GeometrySet(const scene::Scene& scene,
                         const TessellationOptions& options = {},
                         Refinement refined = {});

    /// Places the instances as the scene does, whose shapes and prototypes are those that this was
    /// made from. Not while it is looked at.
    void place_instances(const scene::Scene& scene);

    /// [shape of Scene::shapes], render space.
    const std::vector<TriangleMesh>& shapes() const { return shapes_; }

    /// [prototype][shape of the prototype], prototype space.
    const std::vector<std::vector<TriangleMesh>>& prototypes() const { return prototypes_; }

    /// [instance of Scene::instances]; of those that move, as when the shutter opens.
    const std::vector<InstanceTransform>& instances() const { return instances_; }

    /// The transform at a time (Ray::time). `storage` holds it where the instance moves.
    const InstanceTransform& instance(uint32_t index,
                                      float time,
                                      std::optional<InstanceTransform>& storage) const;

    /// The mesh that was hit.
    const TriangleMesh& mesh(const Hit& hit) const;

    bool has_motion() const;  ///< whether a mesh or an instance moves while the shutter is open

    size_t triangle_count() const;  ///< stored ones, prototypes once
    /// The same of what is not made of triangles, by PrimitiveSet::kind().
    std::map<std::string, size_t> primitive_counts() const;

    /// Spheres, cylinders, cones and capsules that are triangles all the same.
    size_t tessellated_quadrics() const { return tessellated_quadrics_; }

    size_t bytes() const;

  private:
    std::vector<TriangleMesh> shapes_;
    std::vector<std::vector<TriangleMesh>> prototypes_;
    std::vector<InstanceTransform> instances_;
    std::unordered_map<uint32_t, scene::Instance> moving_;  ///< those that move, by index
    size_t tessellated_quadrics_ = 0;
};

}  // namespace velatura::geometry
