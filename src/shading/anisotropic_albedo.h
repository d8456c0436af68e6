// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "shading/albedo.h"

#include <cmath>
#include <vector>

namespace velatura::shading {

/// GGX widths along and across the tangent by roughness and anisotropy, both in [0, 1]:
/// αx = r²·√(2 / (1 + (1 − a)²)), αy = (1 − a)·αx, so that αx² + αy² = 2r⁴; αy at least
/// min_alpha. Ref: OpenPBR Surface specification 1.1, section "Microfacet model".
Vec2 anisotropic_alpha(float roughness, float anisotropy);

/// Smallest width of facets across the tangent; D from components keeps its digits there.
inline constexpr float min_alpha = 1e-4f;

/// Widths that a material can take on. The ratio is αy / αx before min_alpha.
struct AnisotropyRange {
    float alpha_low = 0, alpha_high = 0;  ///< αx
    float ratio_low = 1, ratio_high = 1;

    friend bool operator==(const AnisotropyRange&, const AnisotropyRange&) = default;
};

/// Directional albedo of anisotropic GGX reflection, tabulated when made over cosine and the width
/// in the plane of the direction, α∥² = αx²·cos²φ + αy²·sin²φ: 0.3 s of CPU time for one pair of
/// widths or a range of one of them, 2.5 s for ranges of both. The isotropic tables (albedo.h)
/// cannot stand in: at α∥ they miss up to 0.46 (docs/engineering/numerics.md). Absolute errors: <
/// 1e-3 for one pair, < 5e-3 for ranges.
class AnisotropicAlbedo {
  public:
    explicit AnisotropicAlbedo(const AnisotropyRange& range);

    const AnisotropyRange& range() const { return range_; }

    /// The widest pair of the range: the only one where nothing varies.
    Vec2 alpha() const { return alpha_at(alpha_count_ - 1, 0, alpha_count_, ratio_count_); }

    /// The albedo of one pair of widths.
    class Curve {
      public:
        Curve() = default;
        /// w in the frame of the widths, unit; z in [0, 1].
        GgxAlbedo at(const Vec3& w) const;

        /// Cosine-weighted mean over the hemisphere.
        const GgxAlbedo& average() const { return average_; }

      private:
        friend class AnisotropicAlbedo;

        /// Smooth functions of position, as in albedo_tables.
        struct Node {
            float loss = 0;
            float cosine = 0;  ///< c / (μ + α∥); the lobe's mean of (1 − cosθ)^5 is (1 − c)^5
        };

        const Node* corners_[4] = {};  // tables around the widths, [row][node]
        float weights_[4] = {};
        int row_count_ = 0, node_count_ = 0;
        Vec2 alpha_ = Vec2(1.0f);
        float root_low_ = 0, rows_per_root_ = 0;
        GgxAlbedo average_;
    };

    /// alpha within the range.
    Curve curve(const Vec2& alpha) const;

  private:
    /// Position among `count` equal steps of a range.
    struct Axis {
        int index = 0, next = 0;
        float t = 0;
    };

    static Axis axis_at(float x, float low, float high, int count);
    Vec2 alpha_at(int i, int j, int alpha_count, int ratio_count) const;
    Curve curve_without_average(const Vec2& alpha, const Vec2& position) const;
    void make_row(int table, int row);

    AnisotropyRange range_;
    int alpha_count_, ratio_count_, row_count_, node_count_;
    int average_alpha_count_, average_ratio_count_;
    std::vector<Curve::Node> nodes_;   // [alpha][ratio][row][node]
    std::vector<GgxAlbedo> averages_;  // [alpha][ratio], finer: they divide; the loss over αx²
};

namespace anisotropy_detail {

/// Width of the distribution in the plane of w and the normal; α of an isotropic one.
inline float alpha_along(const Vec3& w, const Vec2& alpha) {
    const float x2 = w.x * w.x, y2 = w.y * w.y, sum = x2 + y2;
    if (!(sum > 0.0f)) return alpha.x;
    const float x = alpha.x * alpha.x * x2, y = alpha.y * alpha.y * y2;
    return std::sqrt((x + y) / sum);
}

/// Unit direction of cosine mu in whose plane the width is `along`, between those of alpha.
Vec3d direction_with(double mu, double along, const Vec2d& alpha);

}  // namespace anisotropy_detail

}  // namespace velatura::shading
