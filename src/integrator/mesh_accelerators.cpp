// SPDX-License-Identifier: Apache-2.0
#include "integrator/mesh_accelerators.h"

#include "accel/bvh.h"

namespace velatura::integrator {

const accel::Accelerator* MeshAccelerators::add(const geometry::TriangleMesh& mesh) {
    std::unique_ptr<const accel::Accelerator>& tree = trees_[&mesh];
    if (!tree) {
        accel::SoupScene soup;
        soup.shapes.push_back(
            {mesh.positions(), mesh.triangles(), mesh.shared_primitives(), mesh.later_positions()});
        tree = accel::build_bvh(soup);
    }
    return tree.get();
}

const accel::Accelerator* MeshAccelerators::find(const geometry::TriangleMesh& mesh) const {
    const auto it = trees_.find(&mesh);
    return it == trees_.end() ? nullptr : it->second.get();
}

size_t MeshAccelerators::bytes() const {
    size_t total = 0;
    for (const auto& [mesh, tree] : trees_) total += tree->stats().bytes;
    return total;
}

std::optional<PlacedMeshHit> intersect_placed_mesh(const scene::Scene& scene,
                                                   const geometry::GeometrySet& geometry,
                                                   const PlacedMesh& solid,
                                                   const Mat4d* backward,
                                                   const geometry::Ray& ray) {
    geometry::Ray local = ray;
    if (backward) {
        local.o = to_float(transform_point(Vec3d(ray.o), *backward));
        local.d = to_float(transform_direction(Vec3d(ray.d), *backward));
    }
    geometry::Hit hit = solid.tree->intersect(local);
    if (!hit.is_valid()) return std::nullopt;
    hit.instance = solid.instance;
    hit.shape = solid.shape;
    return PlacedMeshHit{geometry::make_surface_point(scene, geometry, ray, hit), hit.t};
}

}  // namespace velatura::integrator
