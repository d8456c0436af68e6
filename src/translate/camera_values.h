// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/stage/stage.h"

#include <string>
#include <vector>

namespace velatura::translate {

/// What a camera prim says about its lens, as authored (schema fallbacks included).
struct CameraPrimValues {
    std::string path;           ///< prim path
    double focal_length = 50;   ///< tenths of a scene unit, or millimeters by `units`
    double f_stop = 0;          ///< 0: everything is in focus
    double focus_distance = 0;  ///< scene units
};

/// One row per camera that a renderer would see, in traversal order.
std::vector<CameraPrimValues> camera_prim_values(const usd::stage::Stage& stage,
                                                 usd::stage::TimeCode time);

}  // namespace velatura::translate
