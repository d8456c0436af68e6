// SPDX-License-Identifier: Apache-2.0
#include "app/resume.h"

#include "app/accuracy.h"
#include "app/build_id.h"
#include "app/exit_codes.h"
#include "app/render_layers.h"
#include "base/frames.h"
#include "layers/layer_header.h"
#include "layers/sums_part.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

namespace velatura::app {

namespace {

Error refused(std::string why) {
    return {"resume-refused", std::move(why)};
}

/// Build, first sample and settings of the header string; false if there is none that can be read.
bool parse_settings(const std::string& text, EarlierPart& part) {
    const auto j = nlohmann::ordered_json::parse(text, nullptr, false);
    if (!j.is_object() || !j.contains("build") || !j["build"].is_string() ||
        !j.contains("settings") || !j["settings"].is_object())
        return false;
    part.build = j["build"].get<std::string>();
    if (!j.contains("firstSample") || !j["firstSample"].is_number_unsigned()) return false;
    part.first_sample = j["firstSample"].get<uint64_t>();
    for (const auto& [name, value] : j["settings"].items()) {
        if (!value.is_string()) return false;
        part.settings.emplace_back(name, value.get<std::string>());
    }
    if (j.contains("errorCurve")) {
        const std::optional<statistics::ErrorCurve> curve = curve_of(j["errorCurve"]);
        if (!curve) return false;
        part.curve = *curve;
    }
    part.top_ups = j.value("topUps", nlohmann::ordered_json::array()).dump();
    return true;
}

std::string text_of(const image::Window& w) {
    return fmt::format("[{}, {}) x [{}, {})", w.x0, w.x1, w.y0, w.y1);
}

}  // namespace

Result<std::optional<EarlierPart>> read_earlier_part(const std::string& path) {
    std::error_code ignored;
    if (!std::filesystem::exists(path, ignored)) return std::optional<EarlierPart>();
    const Result<image::Image> file = layers::read_sums_image(path);
    if (!file) return refused(file.error().message);
    const Result<layers::LayerHeader> header = layers::read_layer_header(*file);
    if (!header) return refused(header.error().message);
    Result<accumulate::SampleSums> sums = layers::read_sums(*file);
    if (!sums && sums.error().code == "no-sums")
        return refused(
            "it is not resumable; render with --resumable, --checkpoint, --snapshot or --resume "
            "from the start");
    if (!sums) return refused(sums.error().message);
    EarlierPart part{std::move(*sums),
                     header->samples.bad,
                     {},
                     header->samples.scene_hash,
                     file->text(layers::scene_attribute),
                     0,
                     {},
                     "[]",
                     {}};
    if (!parse_settings(file->text(layers::settings_attribute), part))
        return refused("its header does not name the build and the settings of the render");
    return std::optional<EarlierPart>(std::move(part));
}

Result<layers::TopUpRequest> read_request(const std::string& path,
                                          const FrameInput& input,
                                          const image::Window& window) {
    Result<layers::TopUpRequest> request = layers::read_top_up(path);
    if (!request) return request;
    if (request->scene_hash != fmt::format("{:016x}", input.content_hash))
        return refused(fmt::format("{} was written for another scene", path));
    if (request->window != window)
        return refused(fmt::format("{} was written for the pixels {}, expected {}", path,
                                   text_of(request->window), text_of(window)));
    return request;
}

std::string with_request(const std::string& top_ups,
                         const layers::TopUpRequest& request,
                         uint64_t samples) {
    auto list = nlohmann::ordered_json::parse(top_ups, nullptr, false);
    if (!list.is_array()) list = nlohmann::ordered_json::array();
    const nlohmann::ordered_json one = {
        {"samples", samples},
        {"look", nlohmann::ordered_json::parse(request.look_json, nullptr, false)}};
    // A run that was stopped goes on with the same request
    if (list.empty() || list.back() != one) list.push_back(one);
    return list.dump();
}

std::string difference(const EarlierPart& earlier, const FrameSettings& settings) {
    for (const auto& setting : settings) {
        const auto at = std::find_if(earlier.settings.begin(), earlier.settings.end(),
                                     [&](const auto& s) { return s.first == setting.first; });
        const std::string before = at == earlier.settings.end() ? "nothing" : at->second;
        if (before != setting.second)
            return fmt::format("its settings differ: {} was {}, now {}", setting.first, before,
                               setting.second);
    }
    return {};
}

std::string difference(const EarlierPart& earlier,
                       const RenderJob& job,
                       const FrameInput& input,
                       const FrameSettings& settings) {
    if (earlier.build != build_id())
        return fmt::format("it was rendered by build {} of velatura, this is build {}",
                           earlier.build, build_id());
    if (earlier.scene_hash != fmt::format("{:016x}", input.content_hash)) {
        const nlohmann::json now = {{"layers", input.layer_names}};
        const layers::DifferentLayers layers =
            layers::different_layers(earlier.scene_json, now.dump());
        const std::string what = "the scene's layers have changed";
        return layers.a.empty() ? what
                                : fmt::format("{}: it had {}, now {}", what, layers.a, layers.b);
    }
    if (const std::string why = difference(earlier, settings); !why.empty()) return why;
    const image::Window window = data_window(input.scene.settings, job.arguments.crop);
    if (earlier.sums.window() != window)
        return fmt::format("it has the pixels {}, expected {}", text_of(earlier.sums.window()),
                           text_of(window));
    film::LayerSet layers = layers_of(job, input.scene);
    if (job.settings.min_bounce_share) layers.last_bounce = earlier.sums.layer_set().last_bounce;
    if (earlier.sums.layer_set() != layers) return "it stores other light layers";
    if (earlier.first_sample != job.settings.schedule.first_sample)
        return fmt::format("its samples start at {}, expected {}", earlier.first_sample,
                           job.settings.schedule.first_sample);
    return {};
}

render::Settings Continuation::applied_to(render::Settings settings) const {
    if (!earlier) return settings;
    settings.schedule.curve = earlier->curve;
    // A render that goes on keeps the bounces of its file
    if (std::exchange(settings.min_bounce_share, std::nullopt))
        settings.layers.last_bounce = earlier->sums.layer_set().last_bounce;
    return settings;
}

std::string Continuation::difference(const FrameSettings& settings,
                                     const std::string& settings_hash,
                                     const RenderJob& job) const {
    if (earlier) {
        if (std::string why = app::difference(*earlier, settings); !why.empty()) return why;
    }
    if (request && request->settings_hash != settings_hash)
        return fmt::format("{} was written for other render settings", job.arguments.for_mix);
    return {};
}

std::optional<uint64_t> Continuation::end_sample(const RenderJob& job) const {
    if (!request || job.arguments.spp || request->samples < 1.0) return std::nullopt;
    return uint64_t(std::llround(request->samples));
}

Continuation find_continuation(const RenderJob& job,
                               const FrameInput& input,
                               const FrameSettings& settings,
                               Diagnostics& diagnostics) {
    Continuation found;
    if (!job.arguments.resume) return found;
    const auto reject = [&](const std::string& why) {
        found.code = reject_resume(input.output, why, diagnostics);
        return std::move(found);
    };
    Result<std::optional<EarlierPart>> earlier = read_earlier_part(input.output);
    if (!earlier) return reject(earlier.error().message);
    const std::string why = *earlier ? difference(**earlier, job, input, settings) : std::string();
    if (!why.empty()) return reject(why);
    found.earlier = std::move(*earlier);
    const bool is_topped_up = !job.arguments.for_mix.empty();
    if (!found.earlier && is_topped_up)
        return reject("file not found; --for-mix continues an existing file");
    if (!found.earlier)
        diagnostics.note(
            "resume", {}, {},
            fmt::format("{} not found; the render starts from its first sample", input.output));
    if (!is_topped_up) return found;
    Result<layers::TopUpRequest> request =
        read_request(frame_path(job.arguments.for_mix, input.frame), input,
                     data_window(input.scene.settings, job.arguments.crop));
    if (!request && request.error().code == "resume-refused")
        return reject(request.error().message);
    if (!request) {
        diagnostics.error(request.error().code, {}, {}, request.error().message);
        found.code = RenderError;
        return found;
    }
    found.request = std::move(*request);
    return found;
}

int reject_resume(const std::string& path, const std::string& why, Diagnostics& diagnostics) {
    diagnostics.error("resume-refused", {}, {}, fmt::format("cannot resume {}: {}", path, why));
    return Refused;
}

}  // namespace velatura::app
