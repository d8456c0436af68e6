// SPDX-License-Identifier: Apache-2.0
#include "translate/linking/ray_visibility.h"

#include "translate/context/values.h"
#include "translate/linking/linking.h"
#include "usd/layer/token.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string>
#include <string_view>
#include <vector>

namespace velatura::translate::linking {

namespace {

using scene::RayKind;
using scene::RayKinds;
using usd::layer::Path;

constexpr RayKinds kinds_of(std::initializer_list<RayKind> list) {
    RayKinds kinds;
    for (const RayKind kind : list) kinds = kinds.with(kind);
    return kinds;
}

constexpr RayKinds indirect = kinds_of({RayKind::Diffuse, RayKind::DiffuseTransmission,
                                        RayKind::Reflection, RayKind::Refraction, RayKind::Volume});

/// A switch for some kinds of rays. Of one renderer the first that is authored counts: what is
/// named for itself stands before what stands for several.
struct Switch {
    std::string_view name;
    RayKinds kinds;
};

constexpr Switch switches[] = {
    {"primvars:velatura:visibility:camera", kinds_of({RayKind::Camera})},
    {"primvars:velatura:visibility:shadow", kinds_of({RayKind::Shadow})},
    {"primvars:velatura:visibility:diffuse", kinds_of({RayKind::Diffuse})},
    {"primvars:velatura:visibility:diffuseTransmission", kinds_of({RayKind::DiffuseTransmission})},
    {"primvars:velatura:visibility:reflection", kinds_of({RayKind::Reflection})},
    {"primvars:velatura:visibility:refraction", kinds_of({RayKind::Refraction})},
    {"primvars:velatura:visibility:volume", kinds_of({RayKind::Volume})},
    {"primvars:velatura:visibility:indirect", indirect},
    {"primvars:arnold:visibility:camera", kinds_of({RayKind::Camera})},
    {"primvars:arnold:visibility:shadow", kinds_of({RayKind::Shadow})},
    {"primvars:arnold:visibility:diffuse_reflect", kinds_of({RayKind::Diffuse})},
    {"primvars:arnold:visibility:diffuse_transmit", kinds_of({RayKind::DiffuseTransmission})},
    {"primvars:arnold:visibility:specular_reflect", kinds_of({RayKind::Reflection})},
    {"primvars:arnold:visibility:specular_transmit", kinds_of({RayKind::Refraction})},
    {"primvars:arnold:visibility:volume", kinds_of({RayKind::Volume})},
    {"primvars:ri:attributes:visibility:camera", kinds_of({RayKind::Camera})},
    {"primvars:ri:attributes:visibility:transmission", kinds_of({RayKind::Shadow})},
    {"primvars:ri:attributes:visibility:indirect", indirect},
};

constexpr std::string_view arnold_mask = "primvars:arnold:visibility";
constexpr std::string_view karma_mask = "primvars:karma:object:rendervisibility";

/// Of Arnold's mask, from the lowest bit on. The last one, subsurface, has no kind here.
constexpr std::array arnold_bits = {
    RayKind::Camera, RayKind::Shadow,  RayKind::DiffuseTransmission, RayKind::Refraction,
    RayKind::Volume, RayKind::Diffuse, RayKind::Reflection};

constexpr std::array<std::string_view, 4> matte_names = {
    "primvars:velatura:matte", "primvars:arnold:matte", "primvars:ri:attributes:Ri:Matte",
    "primvars:karma:object:holdoutmode"};

/// RenderMan's holdouts are what it calls the shadows and reflections that fall on a plate.
constexpr std::array<std::string_view, 3> catcher_names = {
    "primvars:velatura:catcher", "primvars:ri:attributes:trace:holdout",
    "primvars:cycles:object:is_shadow_catcher"};

/// A number or truth value; a warning and nothing for others.
std::optional<double> read_switch(Context& ctx, const Attribute& attribute, double most) {
    constexpr double missing = -1;
    const double value = read_number(attribute, missing, ctx.time);
    if (value >= 0 && value <= most && value == double(int(value))) return value;
    ctx.warn("bad-visibility", attribute,
             fmt::format("{} is not {}; it is ignored", attribute.name().str(),
                         most == 1 ? std::string("0 or 1")
                                   : fmt::format("an integer from 0 to {}", int(most))));
    return std::nullopt;
}

/// The kinds of a word of Karma's; nothing where it has no such word.
std::optional<RayKinds> karma_kinds(std::string_view word) {
    if (word == "*") return RayKinds::all();
    if (word == "primary" || word == "camera") return kinds_of({RayKind::Camera});
    if (word == "shadow") return kinds_of({RayKind::Shadow});
    if (word == "diffuse")
        return kinds_of({RayKind::Diffuse, RayKind::DiffuseTransmission, RayKind::Volume});
    if (word == "reflect") return kinds_of({RayKind::Reflection});
    if (word == "refract") return kinds_of({RayKind::Refraction});
    if (word == "secondary") return indirect;
    return std::nullopt;
}

/// Karma's mask: words, each of which shows rays, or hides them behind '-' or '^'. Where the first
/// one hides, all others are visible. Nothing, with a warning: it has another word.
std::optional<RayKinds> read_karma_mask(Context& ctx, const Attribute& attribute) {
    const std::string text = read_text(attribute, "", ctx.time);
    RayKinds visible;
    bool is_first = true;
    for (size_t begin = 0; begin < text.size();) {
        const size_t end = std::min(text.find_first_of(" ,;|&", begin), text.size());
        std::string_view word(text.data() + begin, end - begin);
        begin = end + 1;
        if (word.empty()) continue;
        const bool hides = word.front() == '-' || word.front() == '^';
        if (hides) word.remove_prefix(1);
        const std::optional<RayKinds> kinds = karma_kinds(word);
        if (!kinds) {
            ctx.warn("bad-visibility", attribute,
                     fmt::format("'{}' of {} is not a kind of rays (primary, secondary, shadow, "
                                 "diffuse, reflect, refract, *); the mask is ignored",
                                 word, attribute.name().str()));
            return std::nullopt;
        }
        if (is_first && hides) visible = RayKinds::all();
        visible = hides ? visible & ~*kinds : visible | *kinds;
        is_first = false;
    }
    return visible;
}

void state(VisibilityOpinion& out, RayKinds kinds, RayKinds visible) {
    VisibilityOpinion added;
    added.stated = kinds;
    added.visible = visible & kinds;
    out.inherit(added);
}

bool can_be_of_visibility(std::string_view name) {
    constexpr std::array<std::string_view, 8> stems = {
        "primvars:velatura:visibility", "primvars:velatura:matte", "primvars:velatura:catcher",
        "primvars:arnold:visibility",   "primvars:arnold:matte",   "primvars:karma:object:",
        "primvars:ri:attributes:",      "primvars:cycles:object:"};
    return std::any_of(stems.begin(), stems.end(),
                       [&](std::string_view stem) { return name.starts_with(stem); });
}

/// Of the prim itself.
VisibilityOpinion read_opinion(Context& ctx, Prim prim) {
    VisibilityOpinion out;
    const std::vector<usd::layer::Token> names = prim.property_names();
    const bool is_any = std::any_of(names.begin(), names.end(), [](const usd::layer::Token& name) {
        return name.view().starts_with("primvars:") && can_be_of_visibility(name.view());
    });
    if (!is_any) return out;
    const auto authored = [&](std::string_view name) {
        const Attribute attribute = prim.attribute(name);
        return attribute.has_authored_value() ? attribute : Attribute();
    };
    const auto read_switches = [&](std::string_view renderer) {
        for (const Switch& s : switches) {
            if (!s.name.starts_with(renderer)) continue;
            if (const Attribute attribute = authored(s.name))
                if (const auto value = read_switch(ctx, attribute, 1))
                    state(out, s.kinds, *value != 0 ? RayKinds::all() : RayKinds());
        }
    };
    read_switches("primvars:velatura:");
    read_switches("primvars:arnold:");
    if (const Attribute attribute = authored(arnold_mask))
        if (const auto value = read_switch(ctx, attribute, 255)) {
            RayKinds visible;
            for (size_t bit = 0; bit < arnold_bits.size(); ++bit)
                if (int(*value) >> bit & 1) visible = visible.with(arnold_bits[bit]);
            state(out, RayKinds::all(), visible);
        }
    if (const Attribute attribute = authored(karma_mask))
        if (const auto visible = read_karma_mask(ctx, attribute))
            state(out, RayKinds::all(), *visible);
    read_switches("primvars:ri:");
    for (const std::string_view name : matte_names) {
        const Attribute attribute = authored(name);
        if (!attribute || out.is_matte) continue;
        const bool is_karma = name.starts_with("primvars:karma:");
        const auto value = read_switch(ctx, attribute, is_karma ? 2 : 1);
        if (value) out.is_matte = *value != 0;
        if (value == 2)
            ctx.warn("bad-visibility", attribute,
                     "holdoutmode 2 (background) is not supported; the prim is a matte");
    }
    for (const std::string_view name : catcher_names) {
        const Attribute attribute = authored(name);
        if (!attribute || out.is_catcher) continue;
        if (const auto value = read_switch(ctx, attribute, 1)) out.is_catcher = *value != 0;
    }
    return out;
}

}  // namespace

void VisibilityOpinion::inherit(const VisibilityOpinion& above) {
    visible = visible | (above.visible & ~stated);
    stated = stated | above.stated;
    if (!is_matte) is_matte = above.is_matte;
    if (!is_catcher) is_catcher = above.is_catcher;
}

VisibilityOpinion AuthoredVisibility::above(Path path, Path last) const {
    VisibilityOpinion out;
    if (of_prim.empty()) return out;
    for (; path.is_prim_or_variant(); path = path.parent()) {
        if (const auto at = of_prim.find(path); at != of_prim.end()) out.inherit(at->second);
        if (path == last) break;
    }
    return out;
}

bool note_visibility(Context& ctx, Prim prim) {
    AuthoredVisibility& authored = ctx.state<AuthoredVisibility>();
    if (!authored.of_prim.contains(prim.path())) {
        const VisibilityOpinion opinion = read_opinion(ctx, prim);
        if (!opinion.is_empty()) {
            authored.of_prim.emplace(prim.path(), opinion);
            ctx.state<LinkPathMappings>().is_kept = true;
        }
    }
    return !authored.above(prim.path()).kinds().is_empty();
}

bool is_light_seen(Context& ctx, Prim light, const VisibilityOpinion& inherited) {
    // What lights have of their own says more than what a group of prims does
    for (const char* name : {"inputs:karma:light:renderlightgeo", "karma:light:renderlightgeo"}) {
        const Attribute attribute = light.attribute(name);
        if (!attribute.has_authored_value()) continue;
        if (const auto value = read_switch(ctx, attribute, 1)) return *value != 0;
    }
    const Attribute arnold = light.attribute("primvars:arnold:camera");
    if (arnold.has_authored_value()) {
        const double value = read_number(arnold, -1, ctx.time);
        if (value != 0 && value != 1)
            ctx.warn("bad-visibility", arnold,
                     "primvars:arnold:camera is neither 0 nor 1; the camera sees the light as "
                     "bright as it is");
        return value != 0;
    }
    return inherited.kinds().has(RayKind::Camera);
}

}  // namespace velatura::translate::linking
