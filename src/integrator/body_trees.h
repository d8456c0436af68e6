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

/// Trees over one mesh each, in its own space: for rays that ask about one body, whatever else is
/// there. Instances of a prototype share them.
class BodyTrees {
  public:
    /// The tree over the mesh, which is built when it is new. The mesh must outlive it.
    const accel::Accelerator* add(const geometry::TriangleMesh& mesh);

    /// The same if there is one, else null.
    const accel::Accelerator* find(const geometry::TriangleMesh& mesh) const;

    size_t bytes() const;

  private:
    std::unordered_map<const geometry::TriangleMesh*, std::unique_ptr<const accel::Accelerator>>
        trees_;
};

/// A shape as it is placed; numbers as those of geometry::Hit.
struct PlacedBody {
    uint32_t instance = scene::none, shape = 0;
    const accel::Accelerator* tree = nullptr;  ///< over it alone, in its own space
};

/// What a ray of render space meets of the body within ray.t_max: the point, and how far away.
/// backward: to the space of the tree; null = the same.
struct BodyHit {
    geometry::SurfacePoint point;
    float t = 0;
};

std::optional<BodyHit> meet_body(const scene::Scene& scene,
                                 const geometry::GeometrySet& geometry,
                                 const PlacedBody& body,
                                 const Mat4d* backward,
                                 const geometry::Ray& ray);

/// Whether is_wanted(material) of some part of the shape, where an instance may give all of it
/// another material (none: it does not).
template <class IsWanted>
bool has_material(const scene::Shape& shape,
                  scene::MaterialId override_material,
                  const IsWanted& is_wanted) {
    if (override_material != scene::none) return is_wanted(override_material);
    if (is_wanted(shape.material)) return true;
    const auto* mesh = std::get_if<scene::Mesh>(&shape.geometry);
    return mesh && std::any_of(mesh->face_materials.begin(), mesh->face_materials.end(), is_wanted);
}

}  // namespace velatura::integrator
