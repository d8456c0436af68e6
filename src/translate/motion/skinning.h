// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace velatura::translate::motion {

enum class SkinningMethod : unsigned char { ClassicLinear, DualQuaternion };

/// What joints do to points: plain numbers, checked by whoever fills them.
struct Skin {
    Mat4d geom_bind;                ///< from the mesh to where it was bound
    std::vector<Mat4d> joints;      ///< [joint], from bind pose to pose; row vectors
    size_t influences = 1;          ///< per point, at least 1
    std::vector<uint32_t> indices;  ///< [point][influence], each < joints.size()
    std::vector<double> weights;    ///< [point][influence]
    SkinningMethod method = SkinningMethod::ClassicLinear;
};

/// Moves points and normals by a Skin, which must outlive it. Joints at their bind pose leave every
/// bit where it was, provided that the weights add up to 1 (within 1e-4, the rounding of
/// exporters); other sums count as they are.
/// Ref: Kavan et al. 2007, "Skinning with Dual Quaternions", I3D, algorithm 1; scales are blended
/// linearly before it, as UsdSkel does.
class Skinner {
  public:
    explicit Skinner(const Skin& skin);

    Vec3d point(size_t i, const Vec3d& p) const;
    /// All that is done to point i as one matrix.
    Mat4d matrix(size_t i) const;
    /// Direction of a covector at point i, not unit.
    Vec3d normal(size_t i, const Vec3d& n) const;

  private:
    /// Rotation and translation of a joint; the rotation as (w, v), the dual part likewise.
    struct DualQuaternion {
        double rw = 1.0, dw = 0.0;
        Vec3d rv = Vec3d(0.0), dv = Vec3d(0.0);

        Vec3d translation() const { return (dv * rw - rv * dw + rv.cross(dv)) * 2.0; }
    };

    DualQuaternion blended(size_t i) const;
    double weight_sum(size_t i) const;

    const Skin& skin_;
    Mat3d geom_normal_;
    std::vector<Mat4d> matrices_;  ///< whole joints, or only their scales for dual quaternions
    std::vector<Mat3d> normal_matrices_;     ///< inverse transposes of `matrices_`
    std::vector<DualQuaternion> rotations_;  ///< empty for the linear method
};

/// Which in-between shapes a blend shape of weight `w` is made of: pairs of (index into
/// `target_weights`, factor), at most two. Piecewise linear through the targets and the base at
/// weight 0, carried on beyond both ends. `target_weights`: ascending, none of them 0.
std::vector<std::pair<size_t, double>> blend_factors(std::span<const double> target_weights,
                                                     double w);

/// Inverse transpose of the upper 3×3; of singular matrices the cofactors.
Mat3d inverse_transpose(const Mat4d& m);

}  // namespace velatura::translate::motion
