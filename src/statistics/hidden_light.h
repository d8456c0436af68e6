// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace velatura::statistics {

/// Light that a trial knows of and that samples find so seldom that they may not show its noise.
/// Of one sample of a pixel, with the error weight of the pixel, mean over the image.
struct HiddenLight {
    double square = 0;  ///< of what the sample brings of it: its share of relMSE
    double fourth = 0;  ///< of the square: how far estimates of `square` are off
};

/// Whether the error that an image states is a lower bound, as its squared error is not known to
/// ±20 % with 95 % confidence (the error to ±10 %). Args: error: √relMSE; samples per pixel, mean.
bool hides_error(const HiddenLight& light, double error, double samples_per_pixel, double pixels);

}  // namespace velatura::statistics
