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

bool is_purpose_visible(Prim prim, std::string_view purpose) {
    const char* name = purpose == "guide"    ? "guideVisibility"
                       : purpose == "proxy"  ? "proxyVisibility"
                       : purpose == "render" ? "renderVisibility"
                                             : nullptr;
    if (name == nullptr) return true;
    for (; prim && !prim.is_pseudo_root(); prim = prim.parent()) {
        if (!prim.has_api("VisibilityAPI")) continue;
        const Attribute attribute = prim.attribute(name);
        if (!attribute.has_authored_value()) continue;
        const auto value = attribute.get<std::string>();
        if (value && *value != "inherited") return *value != "invisible";
    }
    return true;
}

}  // namespace velatura::usd::stage
