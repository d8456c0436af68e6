// SPDX-License-Identifier: Apache-2.0
#include "plugins/subdivision/face_evaluator.h"

#include <algorithm>
#include <cmath>

namespace velatura::plugins::subdivision {

namespace {

/// Unit, or zero where derivatives do not span a plane: where a smooth boundary rounds a corner
/// they are parallel but for rounding.
Vec3 unit_normal(const double* du, const double* dv) {
    constexpr double parallel = 1e-5;  // of the sine
    const Vec3d u(du[0], du[1], du[2]), v(dv[0], dv[1], dv[2]);
    if (u == Vec3d(0.0) || v == Vec3d(0.0)) return Vec3(0.0f);
    const Vec3d n = normalize(u).cross(normalize(v));
    return n.length2() > parallel * parallel ? to_float(normalize(n)) : Vec3(0.0f);
}

Vec3 to_point(const double* p) {
    return {float(p[0]), float(p[1]), float(p[2])};
}

}  // namespace

void FaceEvaluator::Patches::prepare(const Surface& surface, const Channel& channel) {
    const int width = int(channel.width);
    points.resize(size_t(surface.GetNumPatchPoints()) * channel.width);
    p.resize(channel.width);
    du.resize(channel.width);
    dv.resize(channel.width);
    surface.PreparePatchPoints(channel.rows.data(), width, points.data(), width);
}

FaceEvaluator::FaceEvaluator(const SurfaceFactory& factory, const Channels& channels)
    : factory_(factory),
      channels_(channels),
      face_varying_(channels.face_varying.size()),
      face_varying_patches_(channels.face_varying.size()) {}

bool FaceEvaluator::start(uint32_t face) {
    const bool has_varying = !channels_.varying.parts.empty();
    const bool is_good =
        factory_.InitSurfaces(int(face), &vertex_, face_varying_.data(), nullptr,
                              int(face_varying_.size()), has_varying ? &varying_ : nullptr);
    if (!is_good) return false;
    vertex_patches_.prepare(vertex_, channels_.vertex);
    if (has_varying) varying_patches_.prepare(varying_, channels_.varying);
    for (size_t c = 0; c < face_varying_.size(); ++c)
        face_varying_patches_[c].prepare(face_varying_[c], channels_.face_varying[c]);
    return true;
}

Vec3 FaceEvaluator::position(const double uv[2]) {
    Patches& patches = vertex_patches_;
    vertex_.Evaluate(uv, patches.points.data(), int(channels_.vertex.width), patches.p.data());
    return to_point(patches.p.data());
}

void FaceEvaluator::write(const double uv[2], uint32_t point, geometry::TriangleMeshData& data) {
    Patches& patches = vertex_patches_;
    vertex_.Evaluate(uv, patches.points.data(), int(channels_.vertex.width), patches.p.data(),
                     patches.du.data(), patches.dv.data());
    for (size_t k = 0; k < channels_.keys; ++k) {
        const Vec3 n = unit_normal(&patches.du[3 * k], &patches.dv[3 * k]);
        (k == 0 ? data.positions : data.later_positions[k - 1])[point] =
            to_point(&patches.p[3 * k]);
        (k == 0 ? data.normals : data.later_normals[k - 1])[point] = n;
    }
    write_primvars(channels_.vertex, patches.p, point, data);
    if (!channels_.varying.parts.empty()) {
        varying_.Evaluate(uv, varying_patches_.points.data(), int(channels_.varying.width),
                          varying_patches_.p.data());
        write_primvars(channels_.varying, varying_patches_.p, point, data);
    }
    for (size_t c = 0; c < face_varying_.size(); ++c) {
        Patches& values = face_varying_patches_[c];
        face_varying_[c].Evaluate(uv, values.points.data(), int(channels_.face_varying[c].width),
                                  values.p.data());
        write_primvars(channels_.face_varying[c], values.p, point, data);
    }
}

void FaceEvaluator::write_primvars(const Channel& channel,
                                   const std::vector<double>& row,
                                   uint32_t point,
                                   geometry::TriangleMeshData& data) const {
    for (const Channel::Part& part : channel.parts) {
        float* out = &data.primvars[part.primvar].values[point * part.width];
        for (size_t i = 0; i < part.width; ++i) out[i] = float(row[part.first + i]);
    }
}

}  // namespace velatura::plugins::subdivision
