// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "scene/ids.h"

#include <array>
#include <string>
#include <vector>

namespace velatura::scene {

/// A UsdRenderVar.
struct RenderVar {
    std::string name;  ///< prim name, or driver:parameters:aov:name
    std::string source_name;
    std::string source_type = "raw";
    std::string data_type;  ///< as authored; empty: not authored
    std::string filter;     ///< as authored for whichever renderer; empty: that of the beauty
    ProvenanceId provenance = none;
};

/// A UsdRenderProduct with the settings' values where it authors none.
struct RenderProduct {
    std::string name;  ///< productName; empty = command line decides
    std::vector<RenderVar> vars;
    /// Camera, resolution and the like, as one text: products with the same one share samples.
    std::string view;
    ProvenanceId provenance = none;
};

/// What UsdRenderSettings and the command line ask for, after products have overridden settings.
struct RenderSettings {
    std::string name;  ///< prim path; empty = fallbacks
    std::string pass;  ///< prim path of the RenderPass; empty = none
    std::string camera;
    int width = 2048, height = 1080;
    double pixel_aspect_ratio = 1.0;
    std::string aspect_conform = "expandAperture";
    std::array<double, 4> data_window_ndc = {0, 0, 1,
                                             1};  ///< xmin, ymin, xmax, ymax; origin bottom left
    bool disable_depth_of_field = false;
    bool disable_motion_blur = false;
    std::string working_space = "lin_rec709_scene";  ///< of all colors; a name of image/primaries.h
    std::vector<std::string> included_purposes = {"default", "render"};
    std::vector<std::string> material_binding_purposes = {"full", ""};
    std::vector<RenderProduct> products;
    size_t product = 0;  ///< of `products`: the one that these settings are of
    ProvenanceId provenance = none;
};

}  // namespace velatura::scene
