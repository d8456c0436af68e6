// SPDX-License-Identifier: Apache-2.0
#include "app/plan_report.h"

#include "accel/accelerator_factory.h"
#include "app/render_layers.h"
#include "geometry/geometry_set.h"
#include "plugin/registry.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>

namespace velatura::app {

using integrator::EffectEntry;
using integrator::EffectPlan;
using integrator::EffectState;
using json = nlohmann::ordered_json;
using scene::Effect;

namespace {

/// Of the own tree per triangle, nodes and leaves with corners: what `./dev bench rays` measures
/// lies between 50 and 78.
constexpr uint64_t tree_bytes_per_triangle = 64;
/// Of the own tree per instance: its node, inverse and box (`./dev bench instances`).
constexpr uint64_t tree_bytes_per_instance = 150;

std::string bytes_text(uint64_t bytes) {
    if (bytes < 1024) return fmt::format("{} B", bytes);
    if (bytes < 1024 * 1024) return fmt::format("{:.1f} KiB", double(bytes) / 1024);
    if (bytes < uint64_t(1024) * 1024 * 1024)
        return fmt::format("{:.1f} MiB", double(bytes) / (1024 * 1024));
    return fmt::format("{:.2f} GiB", double(bytes) / (1024.0 * 1024 * 1024));
}

const char* group_name(scene::EffectKind kind) {
    switch (kind) {
        case scene::EffectKind::Scene:
            return "scene";
        case scene::EffectKind::Estimator:
            return "estimator";
        case scene::EffectKind::Output:
            return "output";
    }
    return "";
}

bool is_on(const EffectEntry& e) {
    return e.state == EffectState::On;
}

/// "</mtl/glass> and 3 more: opacity 0.1".
std::string reason(const EffectEntry& e) {
    std::string text;
    if (!e.prim.empty()) text = fmt::format("<{}>", e.prim);
    if (e.prims > 1)
        text += fmt::format("{}{} {}", text.empty() ? "" : " and ",
                            text.empty() ? e.prims : e.prims - 1, text.empty() ? "prims" : "more");
    if (!e.why.empty()) text += (text.empty() ? "" : ": ") + e.why;
    if (e.not_simulated_prims > 0)
        text += fmt::format("; {} more prims use it, but are not rendered", e.not_simulated_prims);
    return text;
}

json entry_json(const EffectPlan& plan, size_t i) {
    const EffectEntry& e = plan.entries[i];
    json j = {{"name", scene::info(Effect(i)).name},
              {"of", group_name(scene::info(Effect(i)).kind)},
              {"state", integrator::name_of(e.state)}};
    if (e.is_forced) j["forced"] = true;
    if (!e.prim.empty()) j["prim"] = e.prim;
    if (!e.why.empty() && e.state != EffectState::Absent) j["why"] = e.why;
    if (e.prims > 0) j["prims"] = e.prims;
    if (e.not_simulated_prims > 0) j["not_simulated_prims"] = e.not_simulated_prims;
    return j;
}

std::string join_names(const EffectPlan& plan, EffectState state) {
    std::string names;
    for (size_t i = 0; i < scene::effect_count; ++i) {
        if (plan.entries[i].state != state || plan.entries[i].is_forced) continue;
        names += names.empty() ? "" : " ";
        names += scene::info(Effect(i)).name;
    }
    return names;
}

}  // namespace

std::vector<PlanNeeds::Plugin> expected_plugins(const RenderJob& job,
                                                const FrameInput& input,
                                                Diagnostics& diagnostics) {
    const plugin::Registry registry(plugin::plugin_folders(), diagnostics);
    const auto has_trigger = [](const plugin::Manifest& m, const char* kind,
                                const std::string& value) {
        return m.has_trigger({kind, value});
    };
    std::vector<PlanNeeds::Plugin> out;
    for (const plugin::Manifest& m : registry.manifests()) {
        PlanNeeds::Plugin p{m.name, false, m.summary};
        const auto open = [&](std::string why) {
            p.is_opened = true;
            p.why = std::move(why);
        };
        const auto runs = [&](Effect e) { return is_on(input.plan.of(e)); };
        if (has_trigger(m, "asset", "texture") && runs(Effect::Textures))
            open("textures of " + input.plan.of(Effect::Textures).prim);
        if (has_trigger(m, "asset", "picture") && runs(Effect::EnvironmentMaps))
            open("texture of " + input.plan.of(Effect::EnvironmentMaps).prim);
        if (has_trigger(m, "asset", "picture") && runs(Effect::LightTextures))
            open("texture of " + input.plan.of(Effect::LightTextures).prim);
        if (has_trigger(m, "option", "accel=" + job.arguments.accel))
            open("--accel " + job.arguments.accel);
        for (size_t i = 0; i < scene::effect_count; ++i) {
            const std::string name(scene::info(Effect(i)).name);
            if (has_trigger(m, "effect", name) && runs(Effect(i)))
                open(name + " of " + input.plan.entries[i].prim);
        }
        out.push_back(std::move(p));
    }
    return out;
}

json plan_json(const EffectPlan& plan, const std::vector<Effect>& broken) {
    json j = {{"schema", "velatura.plan/1"}};
    j["effects"] = json::array();
    for (size_t i = 0; i < scene::effect_count; ++i) j["effects"].push_back(entry_json(plan, i));
    if (!broken.empty()) {
        j["ran_though_off"] = json::array();
        for (const Effect e : broken) j["ran_though_off"].push_back(scene::info(e).name);
    }
    return j;
}

json effect_calls_json(const EffectPlan& plan, const scene::EffectCalls& calls) {
    json j = json::array();
    for (size_t i = 0; i < scene::effect_count; ++i) {
        j.push_back(entry_json(plan, i));
        if (scene::info(Effect(i)).calls.empty()) continue;
        j.back()["calls"] = calls.count[i];
        j.back()["a_call_is"] = scene::info(Effect(i)).calls;
    }
    return j;
}

json needs_json(const PlanNeeds& needs) {
    json j;
    j["plugins"] = json::array();
    for (const PlanNeeds::Plugin& p : needs.plugins)
        j["plugins"].push_back({{"name", p.name}, {"opened", p.is_opened}, {"why", p.why}});
    j["triangles"] = needs.triangles;
    j["instances"] = needs.instances;
    j["before_refinement"] = needs.is_before_refinement;
    j["memory_bytes"] = {{"geometry", needs.geometry_bytes},
                         {"accelerator_expected", needs.accelerator_bytes},
                         {"film_expected", needs.film_bytes},
                         {"light_tracing_expected", needs.splat_bytes},
                         {"writing_expected", needs.writing_bytes},
                         {"volumes", needs.volume_bytes}};
    j["files"] = json::array();
    for (const ImageNeeds::File& f : needs.files)
        j["files"].push_back({{"name", f.name},
                              {"layers", f.layers},
                              {"channels", f.channels},
                              {"most_bytes", f.max_bytes},
                              {"sums_bytes_expected", f.sums_bytes}});
    return j;
}

std::string plan_text(const EffectPlan& plan, bool verbose) {
    const size_t on = plan.count(EffectState::On);
    std::string text = fmt::format("effect plan: {} on, {} off\n", on, scene::effect_count - on);
    for (size_t i = 0; i < scene::effect_count; ++i) {
        const EffectEntry& e = plan.entries[i];
        const std::string_view name = scene::info(Effect(i)).name;
        if (is_on(e)) text += fmt::format(" on   {:21}{}\n", name, reason(e));
    }
    for (size_t i = 0; i < scene::effect_count; ++i) {
        const EffectEntry& e = plan.entries[i];
        const std::string_view name = scene::info(Effect(i)).name;
        if (is_on(e)) continue;
        const bool is_plain = e.state == EffectState::Absent && !e.is_forced;
        if (is_plain && !verbose) continue;
        const std::string why = e.state == EffectState::Absent ? std::string() : reason(e);
        const char* const state = e.state == EffectState::Omitted ? "switched off by --effects"
                                                                  : integrator::name_of(e.state);
        text += fmt::format(" off  {:21}{}{}{}{}\n", name, state, why.empty() ? "" : ": ", why,
                            e.is_forced ? "; forced on by --effects all" : "");
    }
    if (!verbose) text += fmt::format(" off  absent: {}\n", join_names(plan, EffectState::Absent));
    return text;
}

std::string needs_text(const PlanNeeds& needs) {
    std::string text = "plugins\n";
    for (const PlanNeeds::Plugin& p : needs.plugins)
        text +=
            fmt::format(" {:11} {:21}{}\n", p.is_opened ? "loaded" : "not loaded", p.name, p.why);
    if (needs.plugins.empty())
        text += fmt::format(" none found; searched: {}\n", needs.plugin_folders);
    text += fmt::format(
        "memory: {} geometry ({} triangles, {} instances), about {} for the BVH, at most about {} "
        "for the film and {} more while writing; plus textures, loaded on demand\n",
        bytes_text(needs.geometry_bytes), needs.triangles, needs.instances,
        bytes_text(needs.accelerator_bytes), bytes_text(needs.film_bytes),
        bytes_text(needs.writing_bytes));
    if (needs.splat_bytes > 0)
        text += fmt::format("        at most about {} for light tracing, if it is used\n",
                            bytes_text(needs.splat_bytes));
    if (needs.volume_bytes > 0)
        text += fmt::format("        {} volume grids\n", bytes_text(needs.volume_bytes));
    if (needs.is_before_refinement)
        text +=
            "        more after subdivision: this counts the control meshes (--dicing-rate, "
            "--subdivision-level)\n";
    for (const ImageNeeds::File& f : needs.files) {
        const std::string sums =
            f.sums_bytes > 0
                ? fmt::format(", and about {} of sums for --resume", bytes_text(f.sums_bytes))
                : "";
        text +=
            fmt::format("file: {}: {} light layers, {} channels, at most {} before compression{}\n",
                        f.name, f.layers, f.channels, bytes_text(f.max_bytes), sums);
    }
    return text;
}

PlanNeeds plan_needs(const RenderJob& job, const FrameInput& input, Diagnostics& diagnostics) {
    const geometry::GeometrySet geometry(input.scene);
    PlanNeeds needs;
    needs.plugins = expected_plugins(job, input, diagnostics);
    for (const plugin::PluginFolder& f : plugin::plugin_folders())
        needs.plugin_folders += (needs.plugin_folders.empty() ? "" : ", ") + f.path;
    needs.is_before_refinement = is_on(input.plan.of(Effect::Subdivision));
    needs.geometry_bytes = geometry.bytes();
    for (const scene::VolumeField& f : input.scene.volume_fields)
        if (f.voxels) needs.volume_bytes += f.voxels->bytes();
    needs.triangles = accel::triangle_count(accel::make_soup(input.scene, geometry));
    needs.instances = input.scene.instances.size();
    needs.accelerator_bytes =
        needs.triangles * tree_bytes_per_triangle + needs.instances * tree_bytes_per_instance;
    const ImageNeeds image = image_needs(job, input);
    needs.files = image.files;
    needs.film_bytes = image.film_bytes;
    needs.splat_bytes = image.splat_bytes;
    needs.writing_bytes = image.writing_bytes;
    return needs;
}

}  // namespace velatura::app
