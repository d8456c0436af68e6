// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/render_frame.h"
#include "film/film.h"
#include "integrator/error_curve.h"

#include <nlohmann/json.hpp>

#include <optional>
#include <string>

namespace velatura::app {

/// The relative standard error of the picture.
struct PictureError {
    image::RelativeError error;
    bool is_upper = false;  ///< it is no more than that: the halves make up for each other's errors
};

/// From the curve or, where there is none, from the halves; none before every pixel has two samples.
std::optional<PictureError> picture_error(const RenderJob& job, const film::NoiseEstimate& noise, const integrator::ErrorCurve& curve);

/// The same from the film alone: what any run of the render says.
std::optional<PictureError> picture_error(const RenderJob& job, const film::NoiseEstimate& noise);

/// metric, mean, low, high, confidence, is_upper.
nlohmann::ordered_json error_json(const std::optional<PictureError>& error);

/// [{spp, time_s, error, low, high}] and the slope of the errors.
nlohmann::ordered_json error_curve_json(const integrator::ErrorCurve& curve);
nlohmann::ordered_json slope_json(const integrator::ErrorCurve& curve);

/// target, state: reached, forecast or too-far; a forecast's spp and time_s with their 95 % intervals.
nlohmann::ordered_json forecast_json(const integrator::ErrorForecast& forecast);

/// The error that a render aims at or is asked about; 0 = none.
double wanted_error(const RenderJob& job);

/// "512 spp reached 1.42 %; 1 % needs about 1050 spp (980 to 1130), 83 min 00 s (77 to 89 min)".
std::string forecast_text(const integrator::ErrorCurve& curve, double target);

/// "1 % at 1050 spp, 83 min 00 s"; what the progress line has room for.
std::string short_forecast(const integrator::ErrorForecast& forecast);

}  // namespace velatura::app
