// SPDX-License-Identifier: Apache-2.0
#include "geometry/triangle_mesh.h"

#include "base/check.h"

#include <algorithm>
#include <utility>

namespace velatura::geometry {

namespace {

template <class T>
size_t vector_bytes(const std::vector<T>& v) {
    return v.capacity() * sizeof(T);
}

// Authored lengths do not weigh: every corner's normal counts as a direction.
void make_unit(std::vector<Vec3>& normals) {
    for (Vec3& n : normals) n = is_finite(n) && n != Vec3(0.0f) ? normalize(n) : Vec3(0.0f);
}

// Keys that are all alike are no motion.
void drop_if_still(const std::vector<Vec3>& first, std::vector<std::vector<Vec3>>& later) {
    for (const std::vector<Vec3>& key : later) {
        VELATURA_CHECK(key.size() == first.size(), "a key of motion with another topology");
    }
    if (std::all_of(later.begin(), later.end(), [&](const auto& key) { return key == first; }))
        later.clear();
}

}  // namespace

TriangleMesh::TriangleMesh(TriangleMeshData data) : data_(std::move(data)) {
    make_unit(data_.normals);
    for (std::vector<Vec3>& key : data_.later_normals) make_unit(key);
    drop_if_still(data_.positions, data_.later_positions);
    drop_if_still(data_.normals, data_.later_normals);
    extend_bounds(data_.positions);
    for (const std::vector<Vec3>& key : data_.later_positions) extend_bounds(key);
    for (uint32_t i = 0; data_.primitives && i < data_.primitives->size(); ++i) {
        const Box3d box = data_.primitives->bounds(i).box;
        if (box.isEmpty()) continue;
        for (int k = 0; k < 3; ++k) {
            bounds_.min[k] = std::min(bounds_.min[k], next_float_down(float(box.min[k])));
            bounds_.max[k] = std::max(bounds_.max[k], next_float_up(float(box.max[k])));
        }
    }
}

void TriangleMesh::extend_bounds(const std::vector<Vec3>& positions) {
    for (const auto& triangle : data_.triangles)
        for (const uint32_t vertex : triangle) bounds_.extendBy(positions[vertex]);
}

Vec3 TriangleMesh::moved_position(uint32_t vertex, float time) const {
    const MotionTime at = motion_time(time, segments());
    const std::vector<Vec3>& from =
        at.segment == 0 ? data_.positions : data_.later_positions[at.segment - 1];
    return moved(from[vertex], data_.later_positions[at.segment][vertex], at.f);
}

const scene::Primvar* TriangleMesh::find(scene::PrimvarId id) const {
    for (const scene::Primvar& primvar : data_.primvars)
        if (primvar.name == id) return &primvar;
    return nullptr;
}

uint32_t TriangleMesh::element(scene::Interpolation interpolation, uint32_t triangle, int k) const {
    switch (interpolation) {
        case scene::Interpolation::Constant:
            return 0;
        case scene::Interpolation::Uniform:
            return face(triangle);
        case scene::Interpolation::Varying:
        case scene::Interpolation::Vertex:
            return data_.triangles[triangle][size_t(k)];
        case scene::Interpolation::FaceVarying:
            return data_.corners.empty() ? 3 * triangle + uint32_t(k)
                                         : data_.corners[triangle][size_t(k)];
    }
    return 0;
}

/// False where it is missing.
bool TriangleMesh::corner_normal(uint32_t triangle, int k, float time, Vec3d& n) const {
    size_t row = element(data_.normal_interpolation, triangle, k);
    if (!data_.normal_indices.empty()) {
        if (row >= data_.normal_indices.size()) return false;
        row = data_.normal_indices[row];
    }
    if (row >= data_.normals.size()) return false;
    n = Vec3d(data_.normals[row]);
    if (data_.later_normals.empty()) return true;
    const MotionTime at = motion_time(time, uint32_t(data_.later_normals.size()));
    if (at.segment > 0) n = Vec3d(data_.later_normals[at.segment - 1][row]);
    n += (Vec3d(data_.later_normals[at.segment][row]) - n) * double(at.f);
    return true;
}

Vec3d TriangleMesh::normal(uint32_t triangle, float b1, float b2, float time) const {
    if (data_.normals.empty()) return Vec3d(0.0);
    const double weights[3] = {1.0 - double(b1) - double(b2), double(b1), double(b2)};
    Vec3d n(0.0);
    for (int k = 0; k < 3; ++k) {
        Vec3d stored;
        if (!corner_normal(triangle, k, time, stored)) return Vec3d(0.0);
        n += stored * weights[k];
    }
    return n;
}

bool TriangleMesh::corner_normals(uint32_t triangle, Vec3d out[3], float time) const {
    if (data_.normals.empty()) return false;
    for (int k = 0; k < 3; ++k) {
        if (!corner_normal(triangle, k, time, out[k]) || out[k] == Vec3d(0.0)) return false;
    }
    return true;
}

/// Numbers of the primvar at corner k; null when they do not reach it.
const float* TriangleMesh::row(const scene::Primvar& primvar, uint32_t triangle, int k) const {
    return numbers(primvar, element(primvar.interpolation, triangle, k));
}

/// Those of an element.
const float* TriangleMesh::numbers(const scene::Primvar& primvar, size_t element) const {
    size_t row = element;
    if (!primvar.indices.empty()) {
        if (row >= primvar.indices.size()) return nullptr;
        row = primvar.indices[row];
    }
    const size_t width = primvar.width;
    return (row + 1) * width <= primvar.values.size() ? &primvar.values[row * width] : nullptr;
}

bool TriangleMesh::primvar_corners(scene::PrimvarId id, uint32_t triangle, float out[3][4]) const {
    const scene::Primvar* primvar = find(id);
    if (primvar == nullptr) return false;
    for (int k = 0; k < 3; ++k) {
        const float* values = row(*primvar, triangle, k);
        if (values == nullptr) return false;
        std::copy_n(values, primvar->width, out[k]);
    }
    return true;
}

/// The same of a shape of primitives.
bool TriangleMesh::primitive_primvar(
    const scene::Primvar& primvar, uint32_t primitive, float u, float v, float out[4]) const {
    const PrimvarRows rows =
        data_.primitives->primvar_rows(primitive, primvar.interpolation, {0.0, u, v});
    double sum[4] = {0, 0, 0, 0};
    for (int k = 0; k < rows.count; ++k) {
        const float* values = numbers(primvar, rows.row[k]);
        if (values == nullptr) return false;
        for (size_t i = 0; i < primvar.width; ++i)
            sum[i] += double(rows.weight[k]) * double(values[i]);
    }
    for (size_t i = 0; i < primvar.width; ++i) out[i] = float(sum[i]);
    return true;
}

bool TriangleMesh::primvar(
    scene::PrimvarId id, uint32_t triangle, float b1, float b2, float out[4]) const {
    const scene::Primvar* primvar = find(id);
    if (primvar == nullptr) return false;
    if (data_.primitives) return primitive_primvar(*primvar, triangle, b1, b2, out);
    const float* first = row(*primvar, triangle, 0);
    if (first == nullptr) return false;
    if (primvar->interpolation == scene::Interpolation::Constant ||
        primvar->interpolation == scene::Interpolation::Uniform) {
        std::copy_n(first, primvar->width, out);
        return true;
    }
    const float* second = row(*primvar, triangle, 1);
    const float* third = row(*primvar, triangle, 2);
    if (second == nullptr || third == nullptr) return false;
    // Differences against corner 0: equal corners interpolate to themselves exactly
    for (size_t i = 0; i < primvar->width; ++i)
        out[i] = first[i] + b1 * (second[i] - first[i]) + b2 * (third[i] - first[i]);
    return true;
}

size_t TriangleMesh::bytes() const {
    const size_t primitives = data_.primitives ? data_.primitives->bytes() : 0;
    return sizeof(*this) + bytes_of(data_) + primitives;
}

size_t bytes_of(const TriangleMeshData& data) {
    size_t total = vector_bytes(data.positions) + vector_bytes(data.triangles) +
                   vector_bytes(data.faces) + vector_bytes(data.corners) +
                   vector_bytes(data.face_materials) + vector_bytes(data.normals) +
                   vector_bytes(data.normal_indices) + vector_bytes(data.primvars);
    for (const auto* later : {&data.later_positions, &data.later_normals})
        for (const std::vector<Vec3>& key : *later) total += vector_bytes(key);
    for (const scene::Primvar& primvar : data.primvars)
        total += vector_bytes(primvar.values) + vector_bytes(primvar.indices);
    return total;
}

}  // namespace velatura::geometry
