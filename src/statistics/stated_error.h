// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accumulate/sample_sums.h"
#include "statistics/hidden_light.h"
#include "statistics/relative_error.h"

#include <optional>

namespace velatura::statistics {

/// The relative standard error of an image, as its file states it.
struct StatedError {
    RelativeError error;
    bool is_upper = false;  ///< it is no more than that: the halves make up for each other's errors
    bool is_lower = false;  ///< it is no less than that: ErrorCurve::is_lower, hides_error()
    HiddenLight hidden = {};
    bool is_hidden = false;  ///< `is_lower` by hides_error()

    void add_hidden(const HiddenLight& light, double samples_per_pixel, double pixels) {
        hidden = light;
        is_hidden = hides_error(light, error.value, samples_per_pixel, pixels);
        is_lower = is_lower || is_hidden;
    }
};

/// What the sample points of a pixel have to do with each other.
struct PointRelations {
    bool has_independent_halves = false;  ///< even and odd samples know nothing of each other
    bool has_dependent_changes = false;   ///< what later samples change is no more than an upper
                                          ///< bound of the error: strata
    HiddenLight hidden = {};              ///< that any sample may find
};

/// By the difference of the even and the odd samples of each pixel. Nothing before every pixel has
/// a sample in each half.
std::optional<RelativeError> half_image_error(const accumulate::SampleSums& sums);

/// What any run of a render says, from its sums alone: from independent halves, else from how its
/// pixels changed at last or, of parts that do not begin with the first sample, from the halves.
std::optional<StatedError> stated_error(const accumulate::SampleSums& sums,
                                        const PointRelations& points);

}  // namespace velatura::statistics
