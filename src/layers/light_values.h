// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <vector>

namespace velatura::layers {

/// What USD says about the emission of a light prim: the base that a baked mix starts from.
struct LightValues {
    std::string path;  ///< prim path
    std::string type;  ///< USD type: RectLight, Mesh …
    double intensity = 1, exposure = 0;
    std::array<double, 3> color = {1, 1, 1};
    bool uses_color_temperature = false;
    double color_temperature = 6500;
    std::vector<std::string> varying;    ///< of intensity, exposure, color: those with time samples
    std::vector<std::string> connected;  ///< of those: the ones with connections
    bool has_color_space = false;        ///< the color is authored in another than linear Rec.709
    bool is_in_instance = false;         ///< below a native instance, where opinions do not reach
    bool shows_material = false;  ///< geometry that the camera sees by its material's emission

    bool operator==(const LightValues&) const = default;
};

}  // namespace velatura::layers
