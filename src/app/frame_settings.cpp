// SPDX-License-Identifier: Apache-2.0
#include "app/frame_settings.h"

#include "app/build_id.h"
#include "app/plan_report.h"
#include "base/asset_bytes.h"
#include "base/hash.h"
#include "base/udim.h"
#include "geometry/refinement.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <filesystem>
#include <set>
#include <variant>

namespace velatura::app {

namespace {

/// Of its content; empty where it cannot be opened. Piece by piece: grids of volumes may be larger
/// than memory.
std::string hash_of_file(const std::string& path) {
    constexpr size_t piece = size_t(1) << 20;
    const Result<AssetBytesPtr> file = open_asset_bytes(path);
    if (!file) return {};
    uint64_t hash = 0;
    for (std::string_view rest = (*file)->bytes(); !rest.empty();
         rest.remove_prefix(std::min(piece, rest.size()))) {
        hash = hash_combine(hash, hash_string(rest.substr(0, piece)));
        (*file)->forget();
    }
    return fmt::format("{:016x}", hash);
}

/// Says whether a light's profile is the same one, whatever file it comes from.
std::string profile_state(const scene::Shaping& shaping) {
    if (!shaping.ies) return {};
    std::string text = "|ies";
    for (const std::vector<double>* numbers :
         {&shaping.ies->vertical, &shaping.ies->horizontal, &shaping.ies->intensity})
        text += fmt::format(" {:016x}", hash_string({reinterpret_cast<const char*>(numbers->data()),
                                                     numbers->size() * sizeof(double)}));
    return text;
}

/// Of all that the scene reads beside its layers.
std::string files_state(const scene::Scene& scene, const std::vector<SceneFile>& files) {
    std::string text;
    for (const SceneFile& file : files) text += fmt::format("|{} {}", file.name, file.hash);
    for (const scene::Light& l : scene.lights) text += profile_state(l.shaping);
    for (const scene::MeshLight& l : scene.mesh_lights) text += profile_state(l.shaping);
    for (const scene::VolumeField& f : scene.volume_fields)
        text += fmt::format("|{} {}", f.grid, f.index);
    return text.empty() ? "none" : fmt::format("{:016x}", hash_string(text));
}

/// Those that are there: without one, its effect is another image.
std::string opened_plugins(const RenderJob& job, const FrameInput& input) {
    Diagnostics told_elsewhere;
    std::string text;
    for (const PlanNeeds::Plugin& p : expected_plugins(job, input, told_elsewhere))
        if (p.is_opened) text += (text.empty() ? "" : ",") + p.name;
    return text.empty() ? "none" : text;
}

std::string omitted(const integrator::EffectPlan& plan) {
    std::string text;
    for (size_t i = 0; i < scene::effect_count; ++i)
        if (plan.entries[i].state == integrator::EffectState::Omitted)
            text +=
                fmt::format("{}-{}", text.empty() ? "" : ",", scene::info(scene::Effect(i)).name);
    return text.empty() ? "none" : text;
}

std::string_view name_of(sampling::SamplerKind kind) {
    switch (kind) {
        case sampling::SamplerKind::Sobol:
            return "sobol";
        case sampling::SamplerKind::SobolHalves:
            return "sobol in halves";
        case sampling::SamplerKind::BlueNoise:
            return "blue-noise";
        case sampling::SamplerKind::BlueNoiseHalves:
            return "blue-noise in halves";
        case sampling::SamplerKind::Independent:
            return "independent";
        case sampling::SamplerKind::Stratified:
            return "stratified";
        case sampling::SamplerKind::StratifiedHalves:
            return "stratified in halves";
    }
    return "";
}

std::string roulette_state(const RenderJob& job) {
    const integrator::EstimatorOptions& e = job.settings.tracer.estimator;
    if (e.roulette == integrator::Roulette::Cutoff) return fmt::format("cutoff {}", e.cutoff);
    return fmt::format("{} from {}", job.arguments.roulette, e.roulette_start);
}

std::string camera_state(const scene::Camera& c) {
    std::string text =
        fmt::format("{} {} {} {} {} {} {}", c.window_left, c.window_right, c.window_bottom,
                    c.window_top, c.lens_radius, c.focus_distance, c.exposure_scale);
    return text + fmt::format(" {} {} {} {} {}", c.lens_blades, c.lens_rotation_deg,
                              c.lens_roundness, c.shutter_full, c.shutter_falling);
}

}  // namespace

std::vector<std::string> scene_file_paths(const scene::Scene& scene) {
    std::vector<std::string> paths;
    std::set<std::string> known;
    const auto add = [&](const std::string& path) {
        if (!path.empty() && known.insert(path).second) paths.push_back(path);
    };
    for (const scene::Texture& t : scene.textures)
        for (const std::string& file : udim_files(t.file)) add(file);
    const auto add_gobos = [&](const std::vector<scene::LightFilter>& filters) {
        for (const scene::LightFilter& filter : filters)
            if (const auto* gobo = std::get_if<scene::GoboFilter>(&filter.shape))
                add(gobo->texture_file);
    };
    for (const scene::Light& l : scene.lights) {
        add(l.texture_file);
        add_gobos(l.filters);
    }
    for (const scene::MeshLight& l : scene.mesh_lights) add_gobos(l.filters);
    for (const scene::VolumeField& f : scene.volume_fields) add(f.file);
    return paths;
}

std::vector<SceneFile> scene_files(const scene::Scene& scene) {
    std::vector<SceneFile> files;
    for (const std::string& path : scene_file_paths(scene))
        files.push_back({std::filesystem::path(path).filename().string(), hash_of_file(path)});
    return files;
}

FrameSettings frame_settings(const RenderJob& job,
                             const FrameInput& input,
                             const std::vector<SceneFile>& files) {
    const RenderArguments& a = job.arguments;
    const scene::RenderSettings& s = input.scene.settings;
    const integrator::EstimatorOptions& e = job.settings.tracer.estimator;
    FrameSettings settings;
    const auto add = [&settings](const char* name, auto value) {
        settings.emplace_back(name, fmt::format("{}", value));
    };
    add("seed", job.settings.tracer.seed);
    add("resolution", fmt::format("{} x {}", s.width, s.height));
    add("pixel aspect ratio", s.pixel_aspect_ratio);
    add("frame", input.frame);
    add("camera", input.scene.camera.name);
    add("lens and shutter", camera_state(input.scene.camera));
    add("depth of field", s.disable_depth_of_field ? "off" : "on");
    add("motion blur", s.disable_motion_blur ? "off" : "on");
    add("purposes", fmt::format("{}", fmt::join(s.included_purposes, ",")));
    add("--working-space", s.working_space);
    add("material purposes", fmt::format("{}", fmt::join(s.material_binding_purposes, ",")));
    add("files", files_state(input.scene, files));
    add("--max-depth", job.settings.tracer.max_depth);
    add("--filter", a.filter);
    add("--texture-bias", a.texture_bias);
    add("--volume-bounds", a.volume_bounds);
    add("--integrator", e.specular_chains_only ? "whitted" : "path");
    add("--light-sampling", job.light_sampling);
    add("--light-selection", job.light_selection_name);
    add("--roulette", roulette_state(job));
    add("--sampler", name_of(job.settings.tracer.sampler));
    add("--adaptive", job.settings.schedule.adaptive ? "on" : "off");
    add("--splitting", job.settings.splits ? "auto" : "off");
    add("--caustics", a.caustics);
    add("--effects", omitted(input.plan));
    add("--accel", job.settings.world.accelerator ? a.accel : "bvh");
    if (!s.pass.empty()) add("--pass", s.pass);
    const integrator::MatteThrough& through = job.settings.tracer.matte_through;
    if (through.any())
        add("--cryptomatte-through", fmt::format("{}{}", through.refraction ? "refraction " : "",
                                                 through.reflection ? "reflection" : ""));
    // Which limit it chose is kept with the layers
    if (job.settings.firefly_guard) add("--firefly-guard", "on");
    if (!a.casters.empty()) add("--casters", fmt::format("{}", fmt::join(a.casters, " ")));
    const bool is_diced = geometry::first_subdivided(input.scene) != nullptr;
    add("dicing", is_diced ? fmt::format("{} {} {}", job.settings.world.dicing.rate,
                                         job.settings.world.dicing.level.value_or(-1),
                                         job.settings.world.dicing.max_triangles)
                           : "none");
    add("plugins", opened_plugins(job, input));
    return settings;
}

std::string settings_hash(const FrameSettings& settings, const film::LayerSet& layers) {
    std::string text = layers.to_json();
    for (const auto& [name, value] : settings) text += fmt::format("|{}={}", name, value);
    return fmt::format("{:016x}", hash_string(text));
}

std::string settings_json(const FrameFacts& facts,
                          const std::vector<std::string>& lacks,
                          const nlohmann::ordered_json& error_curve) {
    using Json = nlohmann::ordered_json;
    Json j;
    j["schema"] = "velatura.settings/1";
    j["build"] = build_id();
    j["firstSample"] = facts.part.first;
    const Json top_ups = Json::parse(facts.top_ups, nullptr, false);
    if (top_ups.is_array() && !top_ups.empty()) {
        j["topUps"] = top_ups;
    } else {
        const Json end = facts.part.end ? Json(*facts.part.end) : Json();
        j["part"]["samples"] = Json::array({facts.part.first, end});
        j["part"]["complete"] = facts.part.is_complete;
    }
    if (!error_curve.empty()) j["errorCurve"] = error_curve;
    j["settings"] = Json::object();
    for (const auto& [name, value] : facts.settings) j["settings"][name] = value;
    for (const SceneFile& file : facts.files)
        j["files"].push_back(
            {{"name", file.name}, {"hash", file.hash.empty() ? Json() : Json(file.hash)}});
    if (!lacks.empty()) j["lacks"] = lacks;
    // Names of files may be no UTF-8
    return j.dump(-1, ' ', false, Json::error_handler_t::replace);
}

image::Window data_window(const scene::RenderSettings& s, const std::vector<double>& crop) {
    double x0 = s.data_window_ndc[0], y0 = s.data_window_ndc[1], x1 = s.data_window_ndc[2],
           y1 = s.data_window_ndc[3];
    if (crop.size() == 4) {
        x0 = std::max(x0, crop[0]);
        x1 = std::min(x1, crop[1]);
        y0 = std::max(y0, crop[2]);
        y1 = std::min(y1, crop[3]);
    }
    // Pixel i has its center at (i + 0.5) / n; rows count from the top, NDC from the bottom
    constexpr double widest = 4.0;  // images of overscan on each side
    const auto first = [](double ndc, int n) {
        return std::isnan(ndc) ? 0
                               : int(std::ceil(std::clamp(ndc, -widest, 1.0 + widest) * n - 0.5));
    };
    image::Window w;
    w.x0 = first(x0, s.width);
    w.x1 = first(x1, s.width);
    w.y0 = s.height - first(y1, s.height);
    w.y1 = s.height - first(y0, s.height);
    return w;
}

}  // namespace velatura::app
