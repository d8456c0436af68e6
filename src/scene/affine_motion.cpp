// SPDX-License-Identifier: Apache-2.0
#include "scene/affine_motion.h"

#include <algorithm>
#include <cmath>

namespace velatura::scene {

AffineMotion::AffineMotion(const Mat4d& first, std::span<const Mat4d> later) {
    if (later.empty()) return;
    const Mat4d back = first.inverse();
    keys_.emplace_back();
    for (const Mat4d& key : later) {
        Mat4d carried = back * key;
        // The same rotation: no rounding of its inverse
        bool same = true;
        for (int i = 0; i < 3; ++i)
            for (int k = 0; k < 3; ++k) same = same && key[i][k] == first[i][k];
        if (same) {
            carried = Mat4d();
            for (int k = 0; k < 3; ++k) carried[3][k] = key[3][k] - first[3][k];
        }
        keys_.push_back(carried);
    }
}

AffineMotion::Pose AffineMotion::at(double time) const {
    if (keys_.empty()) return {Mat4d(), Mat4d(), 1.0};
    const size_t segments = keys_.size() - 1;
    // Written so that NaN is 0
    const double x = std::min(std::max(0.0, time), 1.0) * double(segments);
    const size_t segment = std::min(size_t(x), segments - 1);
    const double f = x - double(segment);
    const Mat4d &a = keys_[segment], &b = keys_[segment + 1];
    Pose pose;
    for (int i = 0; i < 4; ++i)
        for (int k = 0; k < 4; ++k) pose.to_render[i][k] = a[i][k] + f * (b[i][k] - a[i][k]);
    pose.volume = std::abs(determinant3(pose.to_render));
    if (pose.volume > 0.0) pose.to_made = pose.to_render.inverse();
    return pose;
}

bool AffineMotion::only_translates() const {
    return std::all_of(keys_.begin(), keys_.end(), [](const Mat4d& key) {
        for (int i = 0; i < 3; ++i)
            for (int k = 0; k < 3; ++k)
                if (key[i][k] != (i == k ? 1.0 : 0.0)) return false;
        return true;
    });
}

}  // namespace velatura::scene
