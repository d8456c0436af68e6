// SPDX-License-Identifier: Apache-2.0
#include "app/frame_writer.h"

#include "app/accuracy.h"
#include "app/exit_codes.h"
#include "app/missing_assets.h"
#include "app/plan_report.h"
#include "app/stats.h"
#include "base/atomic_file.h"
#include "base/process/memory_limit.h"
#include "image/exr.h"
#include "layers/stated_stats.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <new>
#include <system_error>
#include <utility>

namespace velatura::app {

namespace {

constexpr const char* writing = "while writing the image";

std::string scene_json(const FrameInput& input, const std::string& hash) {
    nlohmann::ordered_json j;
    j["name"] = input.scene_name;
    j["hash"] = hash;
    j["frame"] = input.frame;
    j["layers"] = input.layer_names;
    j["camera"] = input.scene.camera.name;
    return j.dump();
}

/// What two runs of one render have alike.
std::string stats_json(const RenderJob& job,
                       const FrameInput& input,
                       const render::Renderer& renderer) {
    const render::PrepassResults& prepass = renderer.prepass();
    nlohmann::ordered_json stats;
    stats["scene"] = make_scene_stats(input, renderer.world());
    stats["estimator"] = make_estimator_stats(job);
    stats["guiding"] = make_guiding_stats(prepass.guide);
    stats["splitting"] = make_splitting_stats(prepass.branches);
    if (prepass.roulette) stats["roulette"] = make_roulette_stats(*prepass.roulette);
    stats["error"] = layers::error_json(image_error(job, renderer.film()));
    stats["ledger"] = make_ledger(job, input, renderer);
    return stats.dump();
}

/// Where a render is to stop follows from the curve: one that goes on must not have to find it
/// again. Without a target no file is to depend on how samples came.
nlohmann::ordered_json kept_curve(const RenderJob& job, const statistics::ErrorCurve& curve) {
    return job.settings.schedule.target_error > 0 ? observations_json(curve)
                                                  : nlohmann::ordered_json::array();
}

void add_memory_stats(const MemoryNeeds& needs, nlohmann::ordered_json& memory) {
    if (MemoryLimit::is_set()) memory["limit"] = MemoryLimit::allowed();
    memory["before_first_sample"] = needs.now;
    memory["textures_expected"] = needs.textures;
    memory["light_tracing_expected"] = needs.splats;
    memory["writing_expected"] = needs.writing;
    memory["peak_expected"] = needs.total();
}

/// Adds the seconds of its life to a sum.
class AddedTime {
  public:
    explicit AddedTime(double& sum) : sum_(sum) {}

    ~AddedTime() {
        sum_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    }

    AddedTime(const AddedTime&) = delete;
    AddedTime& operator=(const AddedTime&) = delete;

  private:
    double& sum_;
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

std::string name_of(const std::string& path) {
    return std::filesystem::path(path).filename().string();
}

}  // namespace

layers::FileInfo FrameWriter::file_info(const statistics::ErrorCurve& curve,
                                        const std::vector<scene::Effect>& broken) const {
    layers::FileInfo info = renderer_.file_info();
    info.layout = job_.layout;
    info.compression = job_.compression;
    info.store_sums = is_finished_ ? keeps_final_sums(job_) : keeps_sums(job_);
    info.scene_hash = fmt::format("{:016x}", input_.content_hash);
    info.settings_hash = settings_hash(facts_.settings, renderer_.layers());
    info.scene_json = scene_json(input_, info.scene_hash);
    info.stats_json = stats_json(job_, input_, renderer_);
    info.light_values = input_.light_values;
    info.software = fmt::format("velatura {}", VELATURA_VERSION);
    info.plan_json = plan_json(input_.plan, broken).dump();
    info.settings_json = settings_json(facts_, missing_asset_names(), kept_curve(job_, curve));
    return info;
}

Result<layers::WriteReport> FrameWriter::write_to(const std::string& path,
                                                  const statistics::ErrorCurve& curve,
                                                  const std::vector<scene::Effect>& broken) const {
    return renderer_.film().write(path, file_info(curve, broken));
}

Result<layers::LayerImage> FrameWriter::image(const statistics::ErrorCurve& curve,
                                              const std::vector<scene::Effect>& broken) const {
    layers::FileInfo info = file_info(curve, broken);
    info.layout = layers::Layout::MultiPart;
    info.store_sums = false;
    info.bad_samples = renderer_.film().bad_samples();
    return layers::make_layer_image(renderer_.film().sums(), info);
}

Result<layers::WriteReport> FrameWriter::write(const statistics::ErrorCurve& curve,
                                               const std::vector<scene::Effect>& broken) {
    const AddedTime timer(write_s_);
    if (!memory_.has_plenty_to_write()) image::use_one_exr_thread();
    MemoryLimit::enforce(writing);
    try {
        Result<layers::WriteReport> written = write_to(input_.output, curve, broken);
        // OpenEXR's threads leave rows out that they have no memory for
        if (written || !MemoryLimit::is_set() || written.error().code != "verify-failed")
            return written;
    } catch (const std::bad_alloc&) {
        if (!MemoryLimit::is_set()) throw;
    }
    memory_.make_room();
    MemoryLimit::enforce(writing);
    return write_to(input_.output, curve, broken);
}

Result<layers::WriteReport> FrameWriter::write_interim(const statistics::ErrorCurve& curve) {
    const auto written = [&]() -> Result<layers::WriteReport> {
        try {
            return write(curve, {});
        } catch (const std::bad_alloc&) {
            return Error{"memory-limit", "out of memory"};
        }
    }();
    MemoryLimit::watch();
    return written;
}

std::string FrameWriter::rescue(const statistics::ErrorCurve& curve,
                                const std::vector<scene::Effect>& broken) const {
    std::error_code failed;
    const std::filesystem::path folder = std::filesystem::temp_directory_path(failed);
    const std::string path =
        (folder / fmt::format("velatura-{}-{}", ::getpid(), name_of(input_.output))).string();
    layers::FileInfo info = file_info(curve, broken);
    info.layout = layers::Layout::MultiPart;
    const Result<layers::WriteReport> written =
        failed ? Error{"io-write", failed.message()} : renderer_.film().write(path, info);
    if (!written)
        return fmt::format("it could not be written to the temporary folder either: {}",
                           written.error().message);
    return fmt::format(
        "the image is in {} instead{}", path,
        info.store_sums ? "; move it to the output name, then --resume continues it" : "");
}

void FrameWriter::write_snapshot(const statistics::ErrorCurve& curve, Diagnostics& diagnostics) {
    const Result<layers::WriteReport> written = write_interim(curve);
    if (!written)
        diagnostics.warn("snapshot", {}, {},
                         fmt::format("no {}: {}", keeps_sums(job_) ? "checkpoint" : "interim image",
                                     written.error().message));
}

std::optional<layers::WriteReport> FrameWriter::write_or_rescue(
    const statistics::ErrorCurve& curve,
    const std::vector<scene::Effect>& broken,
    int& code,
    Diagnostics& diagnostics) {
    Result<layers::WriteReport> written = write(curve, broken);
    if (written) return std::move(*written);
    const std::string& why = written.error().code;
    const std::string where = why == "io-write" ? "; " + rescue(curve, broken) : std::string();
    diagnostics.error(why, {}, {}, written.error().message + where);
    code = why == "closure-failed" || why == "verify-failed" ? CheckFailed : RenderError;
    return std::nullopt;
}

bool FrameWriter::write_deep(Diagnostics& diagnostics) const {
    const film::DeepFilm* const deep = renderer_.film().deep();
    if (!deep) return true;
    const Result<layers::DeepImage> written = film::write_deep_image(*deep, input_.output);
    if (!written)
        diagnostics.error(written.error().code, {}, {}, written.error().message);
    else if (!job_.arguments.quiet)
        fmt::print("{}: {} deep samples, {:.3g} per pixel\n", film::deep_path(input_.output),
                   written->samples.size(),
                   double(written->samples.size()) / double(written->counts.size()));
    return written.has_value();
}

bool FrameWriter::write_stats(const MemoryNeeds& needs,
                              const film::NoiseEstimate& noise,
                              const integrator::RenderResult& result,
                              const layers::WriteReport& written,
                              Diagnostics& diagnostics) const {
    if (input_.stats_file.empty()) return true;
    const render::PrepassResults& prepass = renderer_.prepass();
    nlohmann::ordered_json stats =
        make_stats(job_, input_, renderer_.world(), prepass.guide, prepass.branches,
                   make_ledger(job_, input_, renderer_), renderer_.film(), noise, result);
    if (prepass.roulette) {
        stats["roulette"] = make_roulette_stats(*prepass.roulette);
        stats["phases_s"]["roulette"] = prepass.roulette->seconds;
    }
    if (prepass.light) {
        stats["light_tracing"] =
            make_light_tracing_stats(*prepass.light, renderer_.light_tracer() != nullptr);
        stats["phases_s"]["light_tracing"] = prepass.light->seconds;
    }
    if (prepass.bounces) {
        stats["bounces"] = make_bounce_stats(*prepass.bounces, renderer_.layers().last_bounce);
        stats["phases_s"]["bounces"] = prepass.bounces->seconds;
    }
    if (prepass.fireflies) {
        stats["firefly_guard"] = make_firefly_stats(*prepass.fireflies);
        stats["phases_s"]["firefly_guard"] = prepass.fireflies->seconds;
    }
    if (prepass.hidden) stats["phases_s"]["hidden_caustics"] = prepass.hidden->seconds;
    if (prepass.truncation) stats["phases_s"]["max_depth"] = prepass.truncation->seconds;
    stats["phases_s"]["write"] = write_s_;
    add_memory_stats(needs, stats["memory_bytes"]);
    stats["error"]["storage"] = written.storage_error;
    stats["closure"] = {{"family", written.closure_family},
                        {"layers", written.layers},
                        {"bound", 1.0},
                        {"measured", written.closure_measured}};
    stats["files"] = nlohmann::ordered_json::array();
    for (const std::string& file : written.files)
        stats["files"].push_back({{"path", name_of(file)}, {"sha256", written.sha256}});
    if (renderer_.film().deep())
        stats["files"].push_back({{"path", name_of(film::deep_path(input_.output))}});
    const Result<void> ok = write_file_atomically(input_.stats_file, stats.dump(2) + "\n");
    if (!ok) diagnostics.error(ok.error().code, {}, {}, ok.error().message);
    return ok.has_value();
}

}  // namespace velatura::app
