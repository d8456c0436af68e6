// SPDX-License-Identifier: Apache-2.0
#include "integrator/caster_shapes.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <span>
#include <utility>

namespace velatura::integrator {

namespace {

double square(double x) {
    return x * x;
}

}  // namespace

BoundingSphere sphere_around(const Box3d& box) {
    const Vec3d half = (box.max - box.min) * 0.5;
    return {box.min + half, half.dot(half)};
}

CasterShapes::CasterShapes(const World& world, std::vector<double> material_weights)
    : world_(world), weights_(std::move(material_weights)) {
    std::vector<double> weights;
    // keys: of the placement
    const auto add = [&](uint32_t instance, uint32_t shape, const geometry::TriangleMesh& mesh,
                         uint32_t pieces, std::span<const Mat4d> keys) {
        if (pieces == scene::none) return;
        // Weight over the mesh's own area, times how much the transform enlarges areas about
        const double area = pieces_[pieces].integral() * double(pieces_[pieces].size());
        if (!(area > 0.0)) return;
        const Box3 local = mesh.bounds();
        Box3d box;
        double enlarged = 0;
        for (const Mat4d& forward : keys) {
            enlarged = std::max(enlarged, square(std::cbrt(std::abs(determinant3(forward)))));
            for (int i = 0; i < 8; ++i) {
                const Vec3 corner(i & 1 ? local.max.x : local.min.x,
                                  i & 2 ? local.max.y : local.min.y,
                                  i & 4 ? local.max.z : local.min.z);
                box.extendBy(transform_point(Vec3d(corner), forward));
            }
        }
        if (!(enlarged > 0.0)) return;
        const BoundingSphere sphere = sphere_around(box);
        casters_.push_back({instance, shape, pieces, sphere});
        weights.push_back(area * enlarged);
    };
    const geometry::GeometrySet& geometry = world_.geometry;
    for (uint32_t s = 0; s < geometry.shapes().size(); ++s) {
        const geometry::TriangleMesh& mesh = geometry.shapes()[s];
        const Mat4d stays;
        add(scene::none, s, mesh, add_pieces(mesh, scene::none), {&stays, 1});
    }
    // Placements of one shape with one material share its pieces
    std::map<std::pair<std::pair<uint32_t, uint32_t>, scene::MaterialId>, uint32_t> known;
    for (uint32_t i = 0; i < geometry.instances().size(); ++i) {
        const scene::Instance& instance = world_.scene.instances[i];
        std::vector<Mat4d> keys = {Mat4d(instance.render_from_prototype)};
        for (const Mat4& key : instance.later_render_from_prototype) keys.emplace_back(key);
        if (keys.size() == 1 && !geometry.instances()[i].is_invertible) continue;
        const auto& shapes = geometry.prototypes()[instance.prototype];
        const scene::MaterialId override = instance.material_override;
        for (uint32_t s = 0; s < shapes.size(); ++s) {
            const auto key = std::make_pair(std::make_pair(instance.prototype, s), override);
            auto found = known.find(key);
            if (found == known.end())
                found = known.emplace(key, add_pieces(shapes[s], override)).first;
            add(i, s, shapes[s], found->second, keys);
        }
    }
    // By area, but half of it in equal shares: a bead beside a lake must be found, too
    double total = 0;
    for (const double w : weights) total += w;
    for (double& w : weights) w = 0.5 * w / total + 0.5 / double(weights.size());
    choice_ = sampling::Distribution1D(std::span<const double>(weights));
}

/// Returns: an index into pieces_, or none.
uint32_t CasterShapes::add_pieces(const geometry::TriangleMesh& mesh, scene::MaterialId override) {
    const geometry::PrimitiveSet* primitives = mesh.primitives();
    // The largest one at the keys of its motion and halfway between
    const auto area = [&](uint32_t i) {
        if (primitives) return primitives->area(i);
        double largest = 0;
        for (uint32_t k = 0; k <= 2 * mesh.segments(); ++k) {
            const float time = k == 0 ? 0.0f : float(k) / float(2 * mesh.segments());
            const Vec3d c0(mesh.corner(i, 0, time)), c1(mesh.corner(i, 1, time)),
                c2(mesh.corner(i, 2, time));
            largest = std::max(largest, 0.5 * (c1 - c0).cross(c2 - c0).length());
        }
        return largest;
    };
    // Most meshes cast nothing, and need no memory
    const size_t count = primitives ? primitives->size() : mesh.triangle_count();
    std::vector<double> weights;
    for (uint32_t i = 0; i < count; ++i) {
        const double of_material = weight(override != scene::none ? override : mesh.material(i));
        if (!(of_material > 0.0)) continue;
        weights.resize(count);
        weights[i] = of_material * area(i);
    }
    if (weights.empty()) return scene::none;
    pieces_.emplace_back(std::span<const double>(weights));
    return uint32_t(pieces_.size() - 1);
}

const geometry::TriangleMesh& CasterShapes::mesh(const Caster& caster) const {
    const geometry::GeometrySet& geometry = world_.geometry;
    if (caster.instance == scene::none) return geometry.shapes()[caster.shape];
    return geometry.prototypes()[geometry.instances()[caster.instance].prototype][caster.shape];
}

}  // namespace velatura::integrator
