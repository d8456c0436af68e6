// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "compositor/io/layer_stack.h"
#include "compositor/look/controls.h"
#include "compositor/mix/mix.h"
#include "statistics/image_error.h"
#include "statistics/relative_error.h"

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace velatura::compositor::noise {

/// A mix and its error, from half images: two independent estimates A and B of every layer. Since
/// a mix is linear in its layers, (A − B)² / 4 of the mixed halves estimates the squared error of
/// the mix, with whatever its layers have in common. [channel][pixel of the data window].
struct MixError {
    std::array<std::vector<float>, 3> mean;
    std::array<std::vector<float>, 3> difference;  ///< A − B of the mix
    std::array<std::vector<float>, 3> base;        ///< image::ErrorBases::likely
    /// [pixel] Var(mean) / Var(A − B): 1/4, less where the halves differ in samples
    std::vector<float> share;
    double storage = 0;  ///< √relMSE that rounding of halves to half alone would show

    /// Squared error of the pixel's channel: an estimate of one degree of freedom.
    double variance(size_t channel, size_t pixel) const {
        const auto d = double(difference[channel][pixel]);
        return d * d * double(share[pixel]);
    }

    double relative_square(size_t channel, size_t pixel) const {
        return statistics::relative_square(variance(channel, pixel), double(base[channel][pixel]));
    }
};

/// Errors: "halves-not-stored".
Result<MixError> mix_error(const LayerStack& stack, const mix::MixPlan& plan, const Look& look);

/// What one row of the mixer does to the squared error of a mix.
struct RowNoise {
    std::string name;  ///< a group, a bounce, or the layer of a lifted shadow
    double share = 0;  ///< of relMSE, with half of what it has in common with other rows
};

/// How far one control of the look may go when everything else stays as it is.
struct ControlCap {
    Control control;            ///< a gain above 1 or a lifted shadow
    std::optional<double> max;  ///< factor or lift; none: the target is out of its reach
};

/// What would bring a mix to a wanted error.
struct NoiseAdvice {
    double target = 0;             ///< √relMSE
    double sample_factor = 0;      ///< times as many samples; errors fall with their square root
    std::vector<ControlCap> caps;  ///< empty where the target is reached
};

struct NoiseForecast {
    statistics::RelativeError rendered;  ///< with every gain at 1
    statistics::RelativeError mix;
    MixError error;  ///< of the mix, pixel by pixel
    /// The largest share first. Those of groups and shadows add up to 1, those of bounces and
    /// shadows, and of lobes and shadows, as well; empty where the family does not tell them apart.
    std::vector<RowNoise> groups, bounces, lobes, shadows;
    NoiseAdvice advice;
};

/// The noise of a mix from strips: runs of rows of its file, in any order.
class NoiseSum {
  public:
    /// Rows [first, end) of a strip whose row 0 is row `top` of the file, as for
    /// image::ImageErrorSum; the plan is that of the look, with mattes over the strip. Returns:
    /// the strip's error of the mix, pixel by pixel. Errors: "halves-not-stored".
    Result<MixError> add(const LayerStack& strip,
                         const mix::MixPlan& plan,
                         const Look& look,
                         int top,
                         int first,
                         int end);

    statistics::RelativeError rendered() const { return rendered_.result(); }

    statistics::RelativeError mix() const { return mix_.result(); }

    /// As in NoiseForecast.
    std::vector<RowNoise> groups() const { return shares_of(groups_); }

    std::vector<RowNoise> bounces() const { return shares_of(bounces_); }

    std::vector<RowNoise> lobes() const { return shares_of(lobes_); }

    std::vector<RowNoise> shadows() const { return shares_of(shadows_); }

  private:
    std::vector<RowNoise> shares_of(std::vector<RowNoise> sums) const;

    statistics::ImageErrorSum rendered_, mix_;
    double squares_ = 0;                                        ///< of the mix
    std::vector<RowNoise> groups_, bounces_, lobes_, shadows_;  ///< what they have of squares_
};

/// target: of √relMSE; none: that of the render with every gain at 1. Errors: those of plan_mix,
/// "halves-not-stored".
Result<NoiseForecast> forecast_noise(const LayerStack& stack,
                                     const Look& look,
                                     std::optional<double> target);

}  // namespace velatura::compositor::noise
