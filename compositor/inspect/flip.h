// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "image/image.h"

#include <array>
#include <string>
#include <vector>

namespace velatura::compositor::inspect {

/// Pixels that a degree of the visual field holds: a monitor 0.7 m wide of 3840 pixels at 0.7 m.
inline constexpr double flip_pixels_per_degree = 67.0206;

/// Three planes of an image, [channel][height · width], row 0 = top.
struct Planes {
    int width = 0, height = 0;
    std::array<std::vector<float>, 3> values;
};

/// What the eye sees of the difference when two images alternate, per pixel from 0 (none) to 1:
/// LDR-ꟻLIP of display-referred images in linear Rec.709, clamped to [0, 1].
/// Source: Andersson et al. 2020, "FLIP: A Difference Evaluator for Alternating Images".
std::vector<float> ldr_flip(const Planes& reference,
                            const Planes& test,
                            double pixels_per_degree = flip_pixels_per_degree);

/// HDR-ꟻLIP of scene-linear images.
struct Flip {
    std::vector<float> map;  ///< [height · width], the largest over the exposures
    double mean = 0, largest = 0;
    float first_stop = 0, last_stop = 0;  ///< exposures at which the images were compared
    int exposures = 0;
};

/// Compares what is seen at exposures from "nothing is too bright" to "the middle is bright", after
/// the tone curve of Narkowicz 2016. Values that are not finite count as 0.
/// Source: Andersson et al. 2021, "Visualizing Errors in Rendered High Dynamic Range Images".
Flip hdr_flip(const Planes& reference,
              const Planes& test,
              double pixels_per_degree = flip_pixels_per_degree);

/// R, G, B of a layer (`rgba`: the beauty) as planes. Errors: "unknown-name".
Result<Planes> planes_of(const image::Image& image, const std::string& layer);

/// A map as .png or .jpg over the data window, black 0 to white 1, with its scale below. Errors:
/// "io-write".
Result<void> write_flip_image(const std::string& path,
                              const image::Window& window,
                              const std::vector<float>& map);

}  // namespace velatura::compositor::inspect
