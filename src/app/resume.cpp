// SPDX-License-Identifier: Apache-2.0
#include "app/resume.h"

#include "app/accuracy.h"
#include "app/build_id.h"
#include "app/exit_codes.h"
#include "app/render_layers.h"
#include "base/frames.h"
#include "integrator/sample_placement.h"
#include "layers/layer_header.h"
#include "layers/sums_part.h"
#include "layers/sums_reader.h"

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

/// False if it is no such statement.
bool parse_part(const nlohmann::ordered_json& j, EarlierState& earlier) {
    if (!j.is_object() || !j.contains("samples") || !j["samples"].is_array() ||
        j["samples"].size() != 2 || !j.contains("complete") || !j["complete"].is_boolean())
        return false;
    const auto &first = j["samples"][0], &end = j["samples"][1];
    if (!first.is_number_unsigned() || (!end.is_null() && !end.is_number_unsigned())) return false;
    PartState state{first.get<uint64_t>(), std::nullopt, j["complete"].get<bool>()};
    if (!end.is_null()) state.end = end.get<uint64_t>();
    earlier.part = state;
    return true;
}

/// Build, first sample and settings of the header string; false if there is none that can be read.
bool parse_settings(const std::string& text, EarlierState& part) {
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
    if (j.contains("part") && !parse_part(j["part"], part)) return false;
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

/// Of a file that states how it was rendered. Errors: "resume-refused".
Result<EarlierState> read_state(const image::Image& file, const layers::LayerHeader& header) {
    EarlierState state;
    state.scene_hash = header.samples.scene_hash;
    state.scene_json = file.text(layers::scene_attribute);
    if (!parse_settings(file.text(layers::settings_attribute), state))
        return refused("its header does not name the build and the settings of the render");
    return state;
}

std::string different_window(const image::Window& found, const image::Window& expected) {
    return fmt::format("it has the pixels {}, expected {}", text_of(found), text_of(expected));
}

/// Build, scene and settings.
std::string difference(const EarlierState& earlier,
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
    return app::difference(earlier, settings);
}

}  // namespace

Result<std::optional<EarlierPart>> read_earlier_part(const std::string& path) {
    std::error_code ignored;
    if (!std::filesystem::exists(path, ignored)) return std::optional<EarlierPart>();
    Result<layers::SumsReader> file = layers::SumsReader::open(path);
    if (!file) return refused(file.error().message);
    const Result<layers::LayerHeader> header = layers::read_layer_header(file->header());
    if (!header) return refused(header.error().message);
    Result<accumulate::SampleSums> sums = layers::read_sums(*file);
    if (!sums && sums.error().code == "no-sums")
        return refused(
            "it is not resumable; render with --resumable, --checkpoint, --snapshot or --resume "
            "from the start");
    if (!sums) return refused(sums.error().message);
    const auto state = read_state(file->header(), *header);
    if (!state) return state.error();
    return std::optional(EarlierPart{std::move(*sums), header->samples.bad, *state});
}

Result<FirstRates> read_rates(const RenderJob& job,
                              const FrameInput& input,
                              const FrameSettings& settings) {
    const std::string path = frame_path(job.arguments.rates_from, input.frame);
    const Result<layers::SumsReader> reader = layers::SumsReader::open(path);
    if (!reader) return refused(reader.error().message);
    const image::Image& file = reader->header();
    const Result<layers::LayerHeader> header = layers::read_layer_header(file);
    if (!header) return refused(header.error().message);
    const auto state = read_state(file, *header);
    if (!state) return state.error();
    if (const std::string why = difference(*state, input, settings); !why.empty())
        return refused(why);
    const image::Window window = data_window(input.scene.settings, job.arguments.crop);
    if (file.data != window) return refused(different_window(file.data, window));
    const auto records = reader->records();
    if (!records) return refused(records.error().message);
    FirstRates first{*state, header->samples.settings_hash, {}};
    for (const accumulate::PixelRecord& record : *records) {
        if (record.rate == 0)
            return refused(
                fmt::format("it has no rates of adaptive sampling: its samples must "
                            "start at 0 and end after {}",
                            integrator::pilot_samples));
        first.rates.push_back(record.rate);
    }
    return first;
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

std::string difference(const EarlierState& earlier, const FrameSettings& settings) {
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
    if (std::string why = difference(earlier.state, input, settings); !why.empty()) return why;
    const image::Window window = data_window(input.scene.settings, job.arguments.crop);
    if (earlier.sums.window() != window) return different_window(earlier.sums.window(), window);
    film::LayerSet layers = layers_of(job, input.scene);
    if (job.settings.min_bounce_share) layers.last_bounce = earlier.sums.layer_set().last_bounce;
    if (job.settings.firefly_guard) layers.clamp_indirect = earlier.sums.layer_set().clamp_indirect;
    if (earlier.sums.layer_set() != layers) return "it stores other light layers";
    if (earlier.state.first_sample != job.settings.schedule.first_sample)
        return fmt::format("its samples start at {}, expected {}", earlier.state.first_sample,
                           job.settings.schedule.first_sample);
    return {};
}

render::Settings Continuation::applied_to(render::Settings settings) const {
    if (!earlier) return settings;
    settings.schedule.curve = earlier->state.curve;
    // A render that goes on keeps the bounces and the limit of its file
    if (std::exchange(settings.min_bounce_share, std::nullopt))
        settings.layers.last_bounce = earlier->sums.layer_set().last_bounce;
    if (std::exchange(settings.firefly_guard, std::nullopt))
        settings.layers.clamp_indirect = earlier->sums.layer_set().clamp_indirect;
    return settings;
}

std::string Continuation::difference(const FrameSettings& settings,
                                     const std::string& settings_hash,
                                     const RenderJob& job) const {
    if (earlier) {
        if (std::string why = app::difference(earlier->state, settings); !why.empty()) return why;
    }
    if (rates && rates->settings_hash != settings_hash) {
        const std::string why = app::difference(rates->state, settings);
        return fmt::format("{} of --rates-from is of another render: {}", job.arguments.rates_from,
                           why.empty() ? "it stores other light layers" : why);
    }
    if (request && request->settings_hash != settings_hash)
        return fmt::format("{} was written for other render settings", job.arguments.for_mix);
    return {};
}

PartState Continuation::part_of(const RenderJob& job,
                                const integrator::RenderResult& result) const {
    // With more samples than were asked for now it is what it was
    if (result.has_more && earlier && earlier->state.part) return *earlier->state.part;
    const integrator::RenderOptions& schedule = job.settings.schedule;
    const bool ends_here =
        schedule.is_open_ended || result.reason == integrator::StopReason::TargetError;
    return {schedule.first_sample, ends_here ? result.end_sample : schedule.end_sample,
            ends_here || result.reason == integrator::StopReason::Complete};
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
    if (!job.arguments.rates_from.empty()) {
        Result<FirstRates> rates = read_rates(job, input, settings);
        if (!rates) {
            diagnostics.error("resume-refused", {}, {},
                              fmt::format("cannot take rates from {}: {}", job.arguments.rates_from,
                                          rates.error().message));
            found.code = Refused;
            return found;
        }
        found.rates = std::move(*rates);
    }
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
