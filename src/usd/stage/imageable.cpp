// SPDX-License-Identifier: Apache-2.0
#include "usd/stage/imageable.h"

namespace velatura::usd::stage {

bool is_visible_itself(Prim prim, TimeCode time) {
    const auto visibility = prim.attribute("visibility").get<std::string>(time);
    return !visibility || *visibility != "invisible";
}

std::string computed_purpose(Prim prim) {
    for (; prim && !prim.is_pseudo_root(); prim = prim.parent()) {
        if (!prim.is_a("Imageable")) continue;
        const Attribute purpose = prim.attribute("purpose");
        if (!purpose.has_authored_value()) continue;
        if (const auto value = purpose.get<std::string>()) return *value;
    }
    return "default";
}

}  // namespace velatura::usd::stage
