// SPDX-License-Identifier: Apache-2.0
#include "python/session.h"

#include "app/exit_codes.h"
#include "app/missing_assets.h"
#include "app/plan_report.h"
#include "base/thread_scope.h"
#include "render/accelerator_choice.h"
#include "translate/authored_names.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <utility>

namespace velatura::python {

namespace {

Failure usage(const Error& error) {
    return {Failure::Kind::Usage, error.code, error.message};
}

/// Of `threads`; without it, those of the process.
std::unique_ptr<const ThreadScope> limit_threads(const app::RenderJob& job) {
    const int threads = job.arguments.threads;
    return threads > 0 ? std::make_unique<const ThreadScope>(threads) : nullptr;
}

/// Options that are about a file.
void check_file_options(const app::RenderArguments& a) {
    if (!a.output.empty()) return;
    const std::pair<bool, const char*> options[] = {{!a.stats.empty(), "stats"},
                                                    {a.deep, "deep"},
                                                    {a.resume, "resume"},
                                                    {!a.checkpoint.empty(), "checkpoint"},
                                                    {!a.snapshot.empty(), "snapshot"}};
    for (const auto& [is_given, name] : options)
        if (is_given) throw usage({"usage", fmt::format("{} needs output", name)});
}

}  // namespace

std::shared_ptr<Session> Session::open(const app::RenderArguments& arguments,
                                       std::shared_ptr<usd::layer::Layer> layer) {
    return std::shared_ptr<Session>(new Session(arguments, std::move(layer)));
}

Session::Session(const app::RenderArguments& arguments, std::shared_ptr<usd::layer::Layer> layer) {
    Result<app::RenderJob> job = app::make_render_job(arguments);
    if (!job) throw usage(job.error());
    check_file_options(arguments);
    job_ = std::move(*job);
    const std::unique_ptr<const ThreadScope> threads = limit_threads(job_);
    load(arguments, std::move(layer));
}

void Session::load(const app::RenderArguments& arguments,
                   std::shared_ptr<usd::layer::Layer> layer) {
    const Result<std::vector<double>> frames = app::frames_of(arguments);
    if (!frames) throw usage(frames.error());
    if (frames->size() > 1)
        throw usage({"usage", fmt::format("frames: a Renderer renders one frame, found {}; make "
                                          "one for each",
                                          frames->size())});
    settings_ = ProcessSettings::lease(arguments.scene, arguments.assets);
    const auto accelerator = render::find_accelerator(arguments.accel, diagnostics_);
    if (!accelerator) throw failure_of(diagnostics_, "plugin-missing", {});
    job_.settings.world.accelerator = *accelerator;
    Result<app::LoadedStage> loaded =
        layer ? app::compose_layer(std::move(layer), diagnostics_, arguments.assets)
              : app::compose_stage(arguments.scene, diagnostics_, arguments.assets);
    if (!loaded) {
        if (loaded.error().code == "usage") throw usage(loaded.error());
        throw failure_of(diagnostics_, loaded.error().code, loaded.error().message);
    }
    stage_.emplace(std::move(*loaded));
    translate::report_authored_names(stage_->stage, diagnostics_);
    const double frame = frames->empty() ? stage_->stage.start_time_code() : frames->front();
    Result<app::PreparedFrame> ready =
        app::prepare_frame(job_, *stage_, frame, false, diagnostics_);
    if (!ready) {
        if (ready.error().code == "lpe") throw usage(ready.error());
        throw failure_of(diagnostics_, ready.error().code, ready.error().message);
    }
    frame_.emplace(std::move(*ready));
    planned_output_ = frame_->input.output;
    if (arguments.output.empty()) frame_->input.output.clear();
    check_output(frame_->input.output);
}

void Session::check_output(const std::string& path) const {
    if (path.empty()) return;
    for (const std::string& file : stage_->stage.layer_files()) {
        std::error_code ignored;
        if (std::filesystem::equivalent(path, file, ignored))
            throw Failure(Failure::Kind::Error, "overwrites-input",
                          fmt::format("{} is a layer of the scene and would be overwritten", path));
    }
}

/// A render without them is another image: unless that is wanted, nothing is rendered.
void Session::check_missing_assets() const {
    if (job_.arguments.assets.missing == "ignore") return;
    for (const Diagnostic& d : diagnostics_.all()) {
        const bool is_missing =
            std::any_of(std::begin(app::missing_asset_codes), std::end(app::missing_asset_codes),
                        [&](const app::MissingAssetCode& m) { return m.code == d.code; });
        if (d.severity == Severity::Error && (is_missing || d.code.starts_with("plugin-")))
            throw failure_of(diagnostics_, "missing-assets",
                             "assets or plugins of the scene are missing; "
                             "missing_assets=\"ignore\" renders without them");
    }
}

std::shared_ptr<Frame> Session::render(
    const std::function<void(const integrator::RenderState&)>& progress) {
    const std::unique_lock lock(busy_, std::try_to_lock);
    if (!lock.owns_lock())
        throw Failure(Failure::Kind::Error, "renderer-busy",
                      "this Renderer is rendering in another thread");
    stop_ = false;
    const std::unique_ptr<const ThreadScope> threads = limit_threads(job_);
    const app::FrameControl control{.stop = &stop_, .progress = progress, .owns_process = false};
    std::unique_ptr<app::FrameRenderer> renderer;
    const auto check = [&](int code) {
        if (code == app::Done || code == app::TargetMissed) return;
        if (stop_) throw Failure(Failure::Kind::Canceled, "interrupted", "the render was canceled");
        throw failure_of(diagnostics_, "render", {});
    };
    check(app::FrameRenderer::make(job_, frame_->input, control, diagnostics_, renderer));
    check(renderer->prepare());
    check_missing_assets();
    renderer->render();
    const bool is_stopped = renderer->is_stopped() && stop_;
    const int code = renderer->finish();
    if (!is_stopped) check(code);
    const bool has_image = renderer->has_image();
    auto frame = std::make_shared<Frame>(shared_from_this(), std::move(renderer));
    if (!is_stopped) return frame;
    Failure canceled(Failure::Kind::Canceled, "interrupted", "the render was canceled");
    if (has_image) canceled.frame = std::move(frame);
    throw canceled;
}

std::string Session::plan_json() {
    app::FrameInput input = frame_->input;
    input.output = planned_output_;
    nlohmann::ordered_json j = app::plan_json(input.plan);
    j["scene"] = input.scene_name;
    j["frame"] = input.frame;
    j["needs"] = app::needs_json(app::plan_needs(job_, input, diagnostics_));
    return j.dump();
}

Frame::Frame(std::shared_ptr<Session> session, std::unique_ptr<app::FrameRenderer> renderer)
    : session_(std::move(session)), renderer_(std::move(renderer)) {}

std::shared_ptr<const LayerArrays> Frame::layers() {
    const std::lock_guard lock(mutex_);
    if (layers_) return layers_;
    const std::unique_ptr<const ThreadScope> threads = limit_threads(session_->job_);
    Result<layers::LayerImage> made = renderer_->image();
    if (!made) throw Failure(Failure::Kind::Error, made.error().code, made.error().message);
    Result<compositor::LayerStack> stack =
        compositor::LayerStack::from_image(std::move(made->image));
    if (!stack) throw Failure(Failure::Kind::Error, stack.error().code, stack.error().message);
    auto arrays = std::make_shared<LayerArrays>(std::move(*stack));
    arrays->convert_all();
    layers_ = std::move(arrays);
    return layers_;
}

std::vector<std::string> Frame::write(const std::string& path) {
    if (!app::has_exr_extension(path))
        throw Failure(Failure::Kind::Usage, "usage",
                      fmt::format("light layers are OpenEXR; expected a name ending in .exr, found "
                                  "\"{}\"",
                                  path));
    session_->check_output(path);
    const std::lock_guard lock(mutex_);
    const std::unique_ptr<const ThreadScope> threads = limit_threads(session_->job_);
    const Result<layers::WriteReport> written = renderer_->write(path);
    if (!written)
        throw Failure(Failure::Kind::Error, written.error().code, written.error().message);
    return written->files;
}

std::string Frame::reason() const {
    switch (renderer_->result().reason) {
        case integrator::StopReason::Complete:
            return "complete";
        case integrator::StopReason::TimeBudget:
            return "time";
        case integrator::StopReason::TargetError:
            return "target-error";
        case integrator::StopReason::Interrupted:
            return "interrupted";
    }
    return {};
}

}  // namespace velatura::python
