// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/render_frame.h"
#include "film/film.h"
#include "integrator/schedule.h"
#include "statistics/error_curve.h"
#include "statistics/stated_error.h"

#include <nlohmann/json_fwd.hpp>

#include <optional>
#include <string>
#include <vector>

namespace velatura::app {

/// The relative standard error of the image.
using ImageError = statistics::StatedError;

/// From the curve or, where there is none, from the film, whose noise() is given; none before every
/// pixel has two samples.
std::optional<ImageError> image_error(const RenderJob& job,
                                      const film::Film& film,
                                      const film::NoiseEstimate& noise,
                                      const statistics::ErrorCurve& curve);

/// From the film alone, which is what any run of the render says: from how its pixels changed at
/// last or, of parts that do not begin with the first sample, from its halves.
std::optional<ImageError> image_error(const RenderJob& job, const film::Film& film);

/// "3.5 %, up to 3.7 %", "3.5 % or more", "not known yet".
std::string reached_text(const std::optional<ImageError>& error);

/// What ended a render that was not interrupted.
struct BudgetOutcome {
    std::string text;        ///< "--time 30 s ended the render"; empty: it has what was asked for
    bool is_missed = false;  ///< a target was not reached, whatever the code
    int code = 0;            ///< of exit_codes.h
};

/// The code is TargetMissed where a target was not reached and no budget that somebody typed was
/// used up instead, or --require-target is given; else Done.
BudgetOutcome budget_outcome(const RenderJob& job,
                             const std::optional<ImageError>& error,
                             const integrator::RenderResult& result);

/// Where the error is: of blocks of 8×8 pixels, the share of those that hold half of it, the share
/// of those whose error hangs on a pixel or two, and the five worst with their intervals. Null
/// where it is not known.
nlohmann::ordered_json blocks_json(const film::Film& film, const statistics::ErrorCurve& curve);

/// [{name, error, share}]: of each light layer, in units of the image's error, and its square
/// over that of the image.
nlohmann::ordered_json layer_noise_json(const std::vector<statistics::LayerNoise>& layers,
                                        double image_error);

/// [{spp, time_s, error, low, high}] and the slope of the errors.
nlohmann::ordered_json error_curve_json(const statistics::ErrorCurve& curve);
nlohmann::ordered_json slope_json(const statistics::ErrorCurve& curve);

/// What the curve was made from but for the times, for another run that goes on: [{min, max, mean,
/// change, low, high, half_in, is_lower}].
nlohmann::ordered_json observations_json(const statistics::ErrorCurve& curve);

/// Nothing where that is no such list.
std::optional<statistics::ErrorCurve> curve_of(const nlohmann::ordered_json& observations);

/// target, state: reached, forecast, too-far or rare-light, is_lower; a forecast's spp and time_s
/// with their 95 % intervals.
nlohmann::ordered_json forecast_json(const statistics::ErrorForecast& forecast);

/// The error that a render aims at or is asked about; 0 = none.
double wanted_error(const RenderJob& job);

/// "512 spp reached 1.42 %; 1 % needs about 1050 spp (980 to 1130), 83 min 00 s (77 to 89 min)"; of
/// an image of so many samples.
std::string forecast_text(const statistics::ErrorCurve& curve, double samples_mean, double target);

/// "1 % at 1050 spp, 83 min 00 s"; what the progress line has room for.
std::string short_forecast(const statistics::ErrorForecast& forecast);

}  // namespace velatura::app
