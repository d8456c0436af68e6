// SPDX-License-Identifier: Apache-2.0
#include "translate/lights/light_groups.h"

#include "base/unique_names.h"
#include "translate/context/values.h"
#include "translate/lights/ascii_letters.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

namespace velatura::translate::lights {

namespace {

/// Names that gains and layers give another meaning (docs/reference/layers.md,
/// docs/reference/mix.md).
bool is_reserved(const std::string& name) {
    static const std::unordered_set<std::string> words = {
        "env", "emissive", "rest", "direct", "indirect", "tail", "shadow", "all"};
    if (words.contains(name)) return true;
    return name.size() > 1 && name[0] == 'b' &&
           std::all_of(name.begin() + 1, name.end(),
                       [](unsigned char c) { return std::isdigit(c); });
}

/// A name of ASCII letters and digits, as layers have it. Short enough for `b12_<name>_hA.R` to fit
/// the 31 bytes of a channel.
std::string clean_name(std::string_view name) {
    constexpr size_t longest = 18;
    std::string out;
    for (size_t at = 0; at < name.size();) {
        const std::string letters = ascii_letters(name, at);
        if (out.size() + letters.size() > longest) break;
        out += letters;
    }
    return out.empty() ? "light" : out;
}

/// State of this module: Scene::groups by what joins lights, and their names.
struct KnownGroups {
    std::unordered_map<std::string, scene::GroupId> by_key;
    UniqueNames names{""};
};

/// The name itself, else with the first number that makes it unique; reserved names get an L first.
std::string unique_name(Context& ctx, const std::string& wanted) {
    UniqueNames& names = ctx.state<KnownGroups>().names;
    if (!is_reserved(wanted) && !names.has(wanted)) return names.make(wanted);
    // b plus any number stays reserved: the letter ends that for good
    const bool needs_letter = is_reserved(wanted) || is_reserved(wanted + "2");
    return names.make(needs_letter ? wanted + "L" : wanted);
}

bool is_text_or_nothing(const usd::layer::Value& value) {
    return value.is_empty() || value.is_block() || value.is_animation_block() ||
           value.get_if<std::string>() || value.get_if<usd::layer::Token>();
}

/// The group that the scene names for the light; empty when it names none.
std::string authored_group(Context& ctx, Prim light) {
    for (const char* name : {"velatura:light:group", "inputs:karma:light:lpetag",
                             "karma:light:lpetag", "primvars:arnold:aov"}) {
        const Attribute attribute = light.attribute(name);
        const std::string group = read_text(attribute, "", ctx.time);
        if (!group.empty()) return group;
        if (!is_text_or_nothing(attribute.value(ctx.time)))
            ctx.warn(
                "light-group-type", attribute,
                fmt::format("{} is not a string or a token; no light group is read from it", name));
    }
    return "";
}

scene::GroupId add_group(Context& ctx, std::string name) {
    ctx.state<KnownGroups>().names.take(name);
    ctx.scene.groups.push_back({std::move(name), {}, true});
    return scene::GroupId(ctx.scene.groups.size() - 1);
}

scene::GroupId light_group(Context& ctx, Prim light) {
    const LightGrouping policy = ctx.state<GroupingPolicy>().grouping;
    std::string authored;
    if (policy != LightGrouping::Off) authored = authored_group(ctx, light);
    // Keys carry a mark, so that a group called like a prim path cannot be taken for the prim
    std::string key, name;
    if (!authored.empty() && authored != "rest") {
        key = "group " + authored;
        name = clean_name(authored);
    } else if (policy == LightGrouping::PerLight && authored.empty()) {
        key = "prim " + light.path_string();
        name = clean_name(light.name().str());
    } else {
        key = "rest";
    }
    auto& known = ctx.state<KnownGroups>().by_key;
    const auto found = known.find(key);
    if (found != known.end()) return found->second;
    const scene::GroupId id = add_group(ctx, key == "rest" ? "rest" : unique_name(ctx, name));
    const std::string& given = ctx.scene.groups[id].name;
    const std::string wanted = key == "rest"      ? "rest"
                               : authored.empty() ? light.name().str()
                                                  : authored;
    if (wanted != given) ctx.scene.groups[id].label = wanted;
    if (!authored.empty() && given != authored) {
        ctx.note("light-group-renamed", light,
                 fmt::format("light group {} is called {} in layers and gains", authored, given));
    }
    known.emplace(std::move(key), id);
    return id;
}

}  // namespace

scene::GroupId join_light_group(Context& ctx, Prim light) {
    const scene::GroupId group = light_group(ctx, light);
    const std::string name = light.path_string();
    auto& members = ctx.scene.groups[group].prims;
    if (members.empty() || members.back() != name) members.push_back(name);
    return group;
}

void add_default_dome(Context& ctx) {
    scene::Light dome;
    dome.kind = scene::LightKind::Dome;
    dome.name = "";
    dome.group = add_group(ctx, "default");
    ctx.scene.lights.push_back(dome);
    ctx.diagnostics.warn(
        "no-lights", ctx.stage.pseudo_root().loc(), "",
        "the stage has no light; a white dome of radiance 1 is added (light group default)");
}

void finish_light_groups(Context& ctx) {
    for (scene::LightGroup& group : ctx.scene.groups) group.is_environment = true;
    for (const scene::Light& light : ctx.scene.lights)
        if (light.kind != scene::LightKind::Dome)
            ctx.scene.groups[light.group].is_environment = false;
    for (const scene::MeshLight& light : ctx.scene.mesh_lights)
        if (light.group != scene::none) ctx.scene.groups[light.group].is_environment = false;
    ctx.scene.groups.push_back({"emissive", {}, false});
}

}  // namespace velatura::translate::lights
