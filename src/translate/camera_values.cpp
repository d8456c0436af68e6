// SPDX-License-Identifier: Apache-2.0
#include "translate/camera_values.h"

#include "translate/context/values.h"
#include "translate/translate.h"

namespace velatura::translate {

std::vector<CameraPrimValues> camera_prim_values(const usd::stage::Stage& stage,
                                                 usd::stage::TimeCode time) {
    std::vector<CameraPrimValues> out;
    for (const std::string& path : camera_paths(stage)) {
        const Prim prim = stage.prim_at(path);
        const auto value = [&](const char* name, double fallback) {
            return read_number(prim.attribute(name), fallback, time);
        };
        out.push_back(
            {path, value("focalLength", 50), value("fStop", 0), value("focusDistance", 0)});
    }
    return out;
}

}  // namespace velatura::translate
