// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

namespace velatura::sampling {

enum class FilterKind : uint8_t { Box, Triangle, Gaussian, BlackmanHarris, Mitchell };

/// "box", "triangle", "gaussian", "blackman-harris", "mitchell".
std::optional<FilterKind> filter_kind(std::string_view name);
std::string_view filter_name(FilterKind kind);

/// Where in the filter's support a camera sample goes, and its weight. The samples of a pixel are
/// averaged with weight; the expectation of weight is 1.
struct FilterSample {
    Vec2 offset;       ///< pixels from the pixel's center, within the radius
    float weight = 1;  ///< 1 for filters without negative lobes, else one of two (see PixelFilter)
};

/// A separable pixel filter, sampled by importance so that each sample belongs to one pixel.
/// Ref: Ernst et al. 2006, "Filter Importance Sampling". Of filters with negative lobes a quarter
/// of the samples goes where they subtract, whatever these lobes hold, and weighs accordingly: of
/// four stratified numbers one is there, the weights sum to 4, and no fewer samples cancel.
class PixelFilter {
  public:
    /// radius in pixels; 0 = the filter's own: box 0.5, triangle 1, gaussian 1.5 (σ = 0.5),
    /// Blackman-Harris 1.5, Mitchell 2 (B = C = 1/3).
    explicit PixelFilter(FilterKind kind = FilterKind::BlackmanHarris, float radius = 0.0f);

    FilterKind kind() const { return kind_; }

    float radius() const { return radius_; }

    /// Share of the samples that go where a filter subtracts, if it does somewhere.
    static constexpr float negative_share = 0.25f;

    /// Whether it subtracts somewhere.
    bool has_negative_lobes() const { return kind_ == FilterKind::Mitchell; }

    /// u in [0,1)², u_part in [0,1): which part, where there are negative lobes.
    FilterSample sample(const Vec2& u, float u_part) const;

    /// The normalized filter at an offset: integrates to 1 over the plane.
    double evaluate(double x, double y) const { return profile(x) * profile(y); }

    /// ∫|w| of the normalized 2D filter; 1 without negative lobes.
    double absolute_integral() const { return absolute_integral_ * absolute_integral_; }

  private:
    double profile(double x) const;
    double raw_profile(double x) const;
    FilterSample sample_part(const Vec2& u, float u_part) const;
    /// Offset by inversion of the tabulated |profile|, between two shares of it from the middle on.
    float sample_axis(float u, float begin, float end) const;

    FilterKind kind_;
    float radius_;
    double inverse_integral_ = 1;     // 1 / ∫ raw profile
    double absolute_integral_ = 1;    // ∫|profile|
    std::vector<float> inverse_cdf_;  // [node] offsets in [0, radius], see filter.cpp
};

}  // namespace velatura::sampling
