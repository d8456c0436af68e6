// SPDX-License-Identifier: Apache-2.0
#include "geometry/geometry_set.h"

#include "base/tasks.h"
#include "geometry/motion.h"
#include "geometry/shape_list.h"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

namespace velatura::geometry {

namespace {

/// The first name that texture coordinates go by and that is there, else the first two-number
/// primvar.
scene::PrimvarId default_texture_coordinates(const scene::Scene& scene, const TriangleMesh& mesh) {
    for (const std::string_view name : scene::texture_coordinate_names) {
        const scene::PrimvarId id = scene::find_primvar(scene, name);
        if (id != scene::none && mesh.has_primvar(id)) return id;
    }
    for (const scene::Primvar& primvar : mesh.primvars())
        if (primvar.width == 2) return primvar.name;
    return scene::none;
}

/// Inverse of an affine matrix by cofactors; false when there is none.
bool invert_affine(const Mat4d& m, Mat4d& inverse) {
    const double det = determinant3(m);
    if (!(std::abs(det) > 0.0) || !std::isfinite(1.0 / det)) return false;
    const Mat3d cofactors = cofactor_matrix(m);
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) inverse[i][j] = cofactors[j][i] / det;
    for (int j = 0; j < 3; ++j) {
        inverse[3][j] =
            -(m[3][0] * inverse[0][j] + m[3][1] * inverse[1][j] + m[3][2] * inverse[2][j]);
    }
    return true;
}

bool is_quadric(const scene::Shape& shape) {
    using Kind = scene::Gprim::Kind;
    const auto* gprim = std::get_if<scene::Gprim>(&shape.geometry);
    return gprim && gprim->kind != Kind::Cube && gprim->kind != Kind::Plane;
}

InstanceTransform make_instance_transform(uint32_t prototype, const Mat4& matrix) {
    InstanceTransform out;
    out.prototype = prototype;
    out.render_from_prototype = matrix;
    const Mat4d forward(matrix);
    Mat4d backward;
    out.is_mirrored = determinant3(forward) < 0.0;
    out.is_invertible = invert_affine(forward, backward);
    if (!out.is_invertible) return out;
    out.prototype_from_render = backward;
    Mat4d bound(0.0);
    for (int i = 0; i < 4; ++i)
        for (int k = 0; k < 3; ++k)
            for (int j = 0; j < 3; ++j)
                bound[i][k] += std::abs(backward[i][j]) * std::abs(forward[j][k]);
    out.round_trip_bound = bound;
    return out;
}

}  // namespace

Mat4 render_from_prototype(const scene::Instance& instance, float time) {
    const std::vector<Mat4>& later = instance.later_render_from_prototype;
    if (later.empty()) return instance.render_from_prototype;
    const MotionTime at = motion_time(time, uint32_t(later.size()));
    const Mat4& from = at.segment == 0 ? instance.render_from_prototype : later[at.segment - 1];
    return moved(from, later[at.segment], at.f);
}

GeometrySet::GeometrySet(const scene::Scene& scene,
                         const TessellationOptions& options,
                         Refinement refined)
    : shapes_(scene.shapes.size()), prototypes_(scene.prototypes.size()) {
    for (size_t i = 0; i < scene.prototypes.size(); ++i)
        prototypes_[i].resize(scene.prototypes[i].shapes.size());
    const std::vector<ListedShape> list = list_shapes(scene);
    const auto mesh_of = [&](const ListedShape& l) -> TriangleMesh& {
        return l.prototype == scene::none ? shapes_[l.index] : prototypes_[l.prototype][l.index];
    };
    parallel_for(list.size(), [&](size_t i) {
        const ListedShape& listed = list[i];
        std::optional<TriangleMesh> mesh;
        if (std::optional<TriangleMeshData>* data = refined.find(listed.prototype, listed.index)) {
            mesh = make_triangle_mesh(*listed.shape, std::move(**data));
            data->reset();
        }
        const bool can_be_triangles = std::holds_alternative<scene::Mesh>(listed.shape->geometry) ||
                                      std::holds_alternative<scene::Gprim>(listed.shape->geometry);
        if (!mesh && (!can_be_triangles || (!listed.is_light && !options.all_quadrics)))
            mesh = make_primitive_mesh(*listed.shape);
        if (!mesh) mesh = make_triangle_mesh(*listed.shape, options);
        mesh->set_texture_coordinates(default_texture_coordinates(scene, *mesh));
        mesh_of(listed) = std::move(*mesh);
    });
    for (const ListedShape& listed : list)
        tessellated_quadrics_ += is_quadric(*listed.shape) && !mesh_of(listed).primitives();
    place_instances(scene);
}

void GeometrySet::place_instances(const scene::Scene& scene) {
    instances_.clear();
    moving_.clear();
    instances_.reserve(scene.instances.size());
    for (const scene::Instance& instance : scene.instances) {
        if (!instance.later_render_from_prototype.empty())
            moving_.emplace(uint32_t(instances_.size()), instance);
        instances_.push_back(
            make_instance_transform(instance.prototype, instance.render_from_prototype));
    }
}

const InstanceTransform& GeometrySet::instance(uint32_t index,
                                               float time,
                                               std::optional<InstanceTransform>& storage) const {
    if (moving_.empty()) return instances_[index];
    const auto found = moving_.find(index);
    if (found == moving_.end()) return instances_[index];
    const scene::Instance& moving = found->second;
    return storage.emplace(
        make_instance_transform(moving.prototype, render_from_prototype(moving, time)));
}

const TriangleMesh& GeometrySet::mesh(const Hit& hit) const {
    if (hit.instance == scene::none) return shapes_[hit.shape];
    return prototypes_[instances_[hit.instance].prototype][hit.shape];
}

bool GeometrySet::has_motion() const {
    const auto moves = [](const TriangleMesh& mesh) { return mesh.segments() > 0; };
    const auto has_one = [&](const std::vector<TriangleMesh>& meshes) {
        return std::any_of(meshes.begin(), meshes.end(), moves);
    };
    return !moving_.empty() || has_one(shapes_) ||
           std::any_of(prototypes_.begin(), prototypes_.end(), has_one);
}

size_t GeometrySet::triangle_count() const {
    size_t count = 0;
    for (const TriangleMesh& mesh : shapes_) count += mesh.triangle_count();
    for (const auto& prototype : prototypes_)
        for (const TriangleMesh& mesh : prototype) count += mesh.triangle_count();
    return count;
}

std::map<std::string, size_t> GeometrySet::primitive_counts() const {
    std::map<std::string, size_t> counts;
    const auto add = [&](const TriangleMesh& mesh) {
        if (mesh.primitives()) counts[mesh.primitives()->kind()] += mesh.primitives()->size();
    };
    for (const TriangleMesh& mesh : shapes_) add(mesh);
    for (const auto& prototype : prototypes_)
        for (const TriangleMesh& mesh : prototype) add(mesh);
    return counts;
}

size_t GeometrySet::bytes() const {
    size_t total = instances_.capacity() * sizeof(InstanceTransform);
    for (const auto& [index, moving] : moving_)
        total += sizeof(moving) + moving.later_render_from_prototype.capacity() * sizeof(Mat4);
    for (const TriangleMesh& mesh : shapes_) total += mesh.bytes();
    for (const auto& prototype : prototypes_)
        for (const TriangleMesh& mesh : prototype) total += mesh.bytes();
    return total;
}

}  // namespace velatura::geometry
