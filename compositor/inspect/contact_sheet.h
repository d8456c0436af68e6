// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "canvas/canvas.h"
#include "image/image.h"

#include <string>
#include <vector>

namespace velatura::compositor::inspect {

struct SheetOptions {
    int columns = 0;       ///< 0: about as wide as a monitor
    int cell_width = 320;  ///< pixels; smaller where the sheet would get too large
    bool halves = false;   ///< half images as well, with patterns those of the layers that match
    bool fit = false;  ///< light layers each at the exposure that shows them, said in the caption
    float exposure_stops = 0;
    std::string display, view;          ///< OpenColorIO; empty: the config's defaults
    std::string input_space;            ///< empty: what the file says (image/file_color.h)
    std::vector<std::string> patterns;  ///< only layers that match one of them, `*` and `?`
};

/// All layers of a file side by side, each with its name and, where a light layer, its share of the
/// beauty. Colors go through the display transform; normals, positions, depths, ids and counts are
/// shown as false colors. Any EXR will do. Layers that are listed and black are named at the end.
/// What is not known of the colors is added to `warnings` when it is given.
/// Errors: "no-layers", "unknown-space", "ocio-config", "ocio-view", "sheet-too-large".
Result<canvas::Canvas> contact_sheet(const image::Image& image,
                                     const SheetOptions& options,
                                     std::vector<std::string>* warnings = nullptr);

}  // namespace velatura::compositor::inspect
