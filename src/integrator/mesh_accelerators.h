// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accel/accelerator.h"
#include "geometry/geometry_set.h"
#include "geometry/surface_point.h"
#include "scene/scene.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <unordered_map>
#include <variant>

namespace velatura::integrator {

/// One BVH per mesh, in object space, shared by all instances of a prototype: for rays that
/// intersect a single mesh and ignore the rest of the scene.
class MeshAccelerators {
  public:
    /// BVH of the mesh, built at the first call. The mesh must outlive it.
    const accel::Accelerator* add(const geometry::TriangleMesh& mesh);

    /// BVH of the mesh; null when it was not built.
    const accel::Accelerator* find(const geometry::TriangleMesh& mesh) const;

    size_t bytes() const;  ///< memory

  private:
    std::unordered_map<const geometry::TriangleMesh*, std::unique_ptr<const accel::Accelerator>>
        trees_;
};

/// A mesh as placed in the scene; indices as in geometry::Hit.
struct PlacedMesh {
    uint32_t instance = scene::none, shape = 0;
    const accel::Accelerator* tree = nullptr;  ///< its own BVH, in object space
};

/// Hit of a ray with a PlacedMesh.
struct PlacedMeshHit {
    geometry::SurfacePoint point;  ///< render space
    float t = 0;                   ///< distance along the ray
};

/// Intersects a ray of render space with one placed mesh, within ray.t_max.
/// Args:    backward: transform from render space to the space of the BVH; null = identity.
/// Returns: the nearest hit; nullopt: none.
std::optional<PlacedMeshHit> intersect_placed_mesh(const scene::Scene& scene,
                                                   const geometry::GeometrySet& geometry,
                                                   const PlacedMesh& solid,
                                                   const Mat4d* backward,
                                                   const geometry::Ray& ray);

/// True when is_wanted(material) for some face of the shape.
/// Args: override_material: material that an instance gives to the whole shape; none: no override.
template <class IsRequested>
bool has_material(const scene::Shape& shape,
                  scene::MaterialId override_material,
                  const IsRequested& is_wanted) {
    if (override_material != scene::none) return is_wanted(override_material);
    if (is_wanted(shape.material)) return true;
    const auto* mesh = std::get_if<scene::Mesh>(&shape.geometry);
    return mesh && std::any_of(mesh->face_materials.begin(), mesh->face_materials.end(), is_wanted);
}

}  // namespace velatura::integrator
