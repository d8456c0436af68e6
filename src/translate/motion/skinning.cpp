// SPDX-License-Identifier: Apache-2.0
#include "translate/motion/skinning.h"

#include <Imath/ImathMatrixAlgo.h>
#include <Imath/ImathQuat.h>

#include <cmath>

namespace velatura::translate::motion {

namespace {

/// Rotation nearest to the matrix by Newton's iteration for the polar decomposition; the identity
/// for singular ones. Ref: Higham 1986, "Computing the Polar Decomposition", SIAM J. Sci. Stat.
/// Comput. 7(4).
Mat3d nearest_rotation(const Mat4d& m) {
    const double determinant = determinant3(m);
    if (determinant == 0.0 || !is_finite(m)) return Mat3d();
    Mat3d u;
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) u[r][c] = determinant < 0.0 ? -m[r][c] : m[r][c];
    for (int iteration = 0; iteration < 64; ++iteration) {
        const Mat3d next = (u + u.inverse().transposed()) * 0.5;
        double change = 0.0;
        for (int r = 0; r < 3; ++r)
            for (int c = 0; c < 3; ++c) change = std::max(change, std::abs(next[r][c] - u[r][c]));
        u = next;
        if (change < 1e-15) break;
    }
    return u;
}

Mat4d with_rows(const Mat3d& m) {
    return Mat4d(m[0][0], m[0][1], m[0][2], 0, m[1][0], m[1][1], m[1][2], 0, m[2][0], m[2][1],
                 m[2][2], 0, 0, 0, 0, 1);
}

Mat3d upper3(const Mat4d& m) {
    return Mat3d(m[0][0], m[0][1], m[0][2], m[1][0], m[1][1], m[1][2], m[2][0], m[2][1], m[2][2]);
}

/// p turned by the unit quaternion (w, v).
Vec3d rotated(const Vec3d& p, double w, const Vec3d& v) {
    return p + v.cross(v.cross(p) + p * w) * 2.0;
}

}  // namespace

Mat3d inverse_transpose(const Mat4d& m) {
    const Mat3d cofactors = cofactor_matrix(m);
    const double determinant = determinant3(m);
    return determinant != 0.0 ? cofactors * (1.0 / determinant) : cofactors;
}

Skinner::Skinner(const Skin& skin) : skin_(skin), geom_normal_(inverse_transpose(skin.geom_bind)) {
    matrices_ = skin.joints;
    if (skin.method == SkinningMethod::DualQuaternion) {
        for (Mat4d& m : matrices_) {
            const Mat3d rotation = nearest_rotation(m);
            const Imath::Quatd q = Imath::extractQuat(with_rows(rotation));
            const Vec3d t(m[3][0], m[3][1], m[3][2]);
            // Dual part: half of translation times rotation
            rotations_.push_back({q.r, -0.5 * t.dot(q.v), q.v, (t * q.r + t.cross(q.v)) * 0.5});
            m = with_rows(upper3(m) * rotation.transposed());
        }
    }
    normal_matrices_.reserve(matrices_.size());
    for (const Mat4d& m : matrices_) normal_matrices_.push_back(inverse_transpose(m));
}

double Skinner::weight_sum(size_t i) const {
    double sum = 0.0;
    for (size_t k = 0; k < skin_.influences; ++k) sum += skin_.weights[i * skin_.influences + k];
    return std::abs(sum - 1.0) < 1e-4 ? 1.0 : sum;
}

Skinner::DualQuaternion Skinner::blended(size_t i) const {
    const size_t first = i * skin_.influences;
    size_t pivot = first;
    for (size_t k = first; k < first + skin_.influences; ++k)
        if (skin_.weights[k] > skin_.weights[pivot]) pivot = k;
    const DualQuaternion& leader = rotations_[skin_.indices[pivot]];
    DualQuaternion sum{0.0, 0.0, Vec3d(0.0), Vec3d(0.0)};
    for (size_t k = first; k < first + skin_.influences; ++k) {
        const DualQuaternion& q = rotations_[skin_.indices[k]];
        // q and −q turn alike: all go the short way to the one that counts most
        const bool is_opposite = q.rw * leader.rw + q.rv.dot(leader.rv) < 0.0;
        const double w = is_opposite ? -skin_.weights[k] : skin_.weights[k];
        sum.rw += q.rw * w;
        sum.rv += q.rv * w;
        sum.dw += q.dw * w;
        sum.dv += q.dv * w;
    }
    const double length = std::sqrt(sum.rw * sum.rw + sum.rv.dot(sum.rv));
    if (!(length > 0.0)) return {};
    return {sum.rw / length, sum.dw / length, sum.rv / length, sum.dv / length};
}

Vec3d Skinner::point(size_t i, const Vec3d& p) const {
    const Vec3d bound = transform_point(p, skin_.geom_bind);
    // What the joints change is added up, so that joints at rest change nothing
    Vec3d moved = bound * weight_sum(i);
    for (size_t k = i * skin_.influences; k < (i + 1) * skin_.influences; ++k)
        moved += (transform_point(bound, matrices_[skin_.indices[k]]) - bound) * skin_.weights[k];
    if (rotations_.empty()) return moved;
    const DualQuaternion q = blended(i);
    return rotated(moved, q.rw, q.rv) + q.translation();
}

Mat4d Skinner::matrix(size_t i) const {
    const double sum = weight_sum(i);
    Mat4d m(sum, 0, 0, 0, 0, sum, 0, 0, 0, 0, sum, 0, 0, 0, 0, 1);
    for (size_t k = i * skin_.influences; k < (i + 1) * skin_.influences; ++k)
        for (int r = 0; r < 4; ++r)
            for (int c = 0; c < 3; ++c)
                m[r][c] += (matrices_[skin_.indices[k]][r][c] - double(r == c)) * skin_.weights[k];
    if (rotations_.empty()) return skin_.geom_bind * m;
    const DualQuaternion q = blended(i);
    for (int r = 0; r < 4; ++r) {
        Vec3d row = rotated(Vec3d(m[r][0], m[r][1], m[r][2]), q.rw, q.rv);
        if (r == 3) row += q.translation();
        for (int c = 0; c < 3; ++c) m[r][c] = row[c];
    }
    return skin_.geom_bind * m;
}

Vec3d Skinner::normal(size_t i, const Vec3d& n) const {
    const Vec3d bound = n * geom_normal_;
    Vec3d moved = bound * weight_sum(i);
    for (size_t k = i * skin_.influences; k < (i + 1) * skin_.influences; ++k)
        moved += (bound * normal_matrices_[skin_.indices[k]] - bound) * skin_.weights[k];
    if (rotations_.empty()) return moved;
    const DualQuaternion q = blended(i);
    return rotated(moved, q.rw, q.rv);
}

std::vector<std::pair<size_t, double>> blend_factors(std::span<const double> target_weights,
                                                     double w) {
    struct Key {
        double weight;
        size_t target;
    };

    constexpr size_t base = size_t(-1);
    std::vector<Key> keys;
    for (size_t i = 0; i < target_weights.size(); ++i) {
        if (target_weights[i] > 0.0 && (keys.empty() || keys.back().weight < 0.0))
            keys.push_back({0.0, base});
        keys.push_back({target_weights[i], i});
    }
    if (!keys.empty() && keys.back().weight < 0.0) keys.push_back({0.0, base});
    std::vector<std::pair<size_t, double>> factors;
    if (keys.size() < 2) return factors;
    size_t upper = 1;
    while (upper + 1 < keys.size() && keys[upper].weight <= w) ++upper;
    const Key &low = keys[upper - 1], &high = keys[upper];
    if (!(high.weight > low.weight)) return factors;
    const double u = (w - low.weight) / (high.weight - low.weight);
    if (low.target != base && u != 1.0) factors.emplace_back(low.target, 1.0 - u);
    if (high.target != base && u != 0.0) factors.emplace_back(high.target, u);
    return factors;
}

}  // namespace velatura::translate::motion
