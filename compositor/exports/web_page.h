// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "compositor/io/layer_stack.h"
#include "compositor/look/controls.h"

#include <cstddef>
#include <string>
#include <vector>

namespace velatura::compositor::exports {

struct WebOptions {
    /// Of the page: the image is scaled down until it fits.
    size_t max_bytes = 25'000'000;
    /// The family that faders are of: `matrix`, `light` or `bounce`; empty takes the matrix, else
    /// lights and bounces, each where it is stored.
    std::string layers;
    std::string title;  ///< that of the page: the name of the shot
};

/// A page with a light mixer in it, for a web browser: one file that asks for no other.
struct WebPage {
    std::string html;
    int width = 0, height = 0;  ///< of the image in it
    size_t layers = 0;          ///< stored in it
    std::string display;        ///< how colors are shown: `a LUT of 81x81x81`, `the sRGB curve`
    // Against the image that the window shows of the render, scaled as the page is
    double equal_share = 1;      ///< of its 8-bit values
    int largest_difference = 0;  ///< in steps of 255
    std::vector<std::string> warnings;
};

/// The mixer begins with `look`. Errors: those of plan_mix and DisplayTransform::make,
/// "export-matte" and "export-clamp" (the look has gains within mattes or undoes clamps, which the
/// page cannot), "mix-not-stored" (`options.layers` is not stored, or cannot express the look),
/// "export-size" (not even a small image fits).
Result<WebPage> web_page(const LayerStack& stack, const Look& look, const WebOptions& options);

}  // namespace velatura::compositor::exports
