// SPDX-License-Identifier: Apache-2.0
#include "plugins/hydra/render_loop.h"

#include "base/atomic_file.h"
#include "integrator/schedule.h"
#include "render/draft_tracer.h"
#include "render/load_scene.h"
#include "render/scene_update.h"
#include "usd/layer/layer_builder.h"
#include "usd/stage/open_layer.h"
#include "usd/text/writer.h"

#include <pxr/base/tf/diagnostic.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <memory>
#include <utility>

namespace velatura::hydra {

using namespace PXR_NS;
using usd::layer::LayerBuilder;
using usd::layer::Path;
using usd::layer::Token;
using usd::layer::Value;

namespace {

/// Samples of a camera that moves: as many as are shown before the scene is centered on it.
constexpr uint64_t draft_samples = 4;

const char* const settings_path = "/velatura_render_settings";

double seconds_since(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void author_settings(const RenderJob& job, LayerBuilder& builder) {
    AuthoredPrim settings("RenderSettings");
    settings.set("resolution", "int2", Value(usd::layer::Vec2i(job.width, job.height)));
    settings.set("pixelAspectRatio", "float", Value(float(job.pixel_aspect_ratio)));
    settings.set_token("aspectRatioConformPolicy", job.aspect_conform);
    settings.set_token("renderingColorSpace", job.settings.working_space);
    settings.target("camera", {Path::from(job.camera_path)});
    settings.author(builder, Path::from(settings_path));
}

/// $VELATURA_HYDRA_LAYER: a file (.usda) that receives what Hydra told of the scene.
void write_layer(const usd::layer::Layer& layer) {
    const char* const file = std::getenv("VELATURA_HYDRA_LAYER");
    if (!file) return;
    if (const Result<void> ok = write_file_atomically(file, usd::text::write_text_layer(layer));
        !ok)
        TF_WARN("velatura: %s", ok.error().message.c_str());
}

/// What makes another scene or other layers of it.
bool is_same_scene(const RenderJob& a, const RenderJob& b) {
    return a.scene_version == b.scene_version && a.render_tags == b.render_tags;
}

}  // namespace

RenderLoop::RenderLoop(const SceneRecords& records) : records_(records) {
    diagnostics_.set_listener([this](const Diagnostic& d) {
        if (d.severity == Severity::Error || d.severity == Severity::Warning)
            TF_WARN("velatura: %s", diagnostics_.format(d).c_str());
    });
    thread_ = std::thread([this] { run(); });
}

RenderLoop::~RenderLoop() {
    {
        const std::lock_guard lock(mutex_);
        is_quitting_ = true;
        interrupt_ = true;
    }
    changed_.notify_all();
    thread_.join();
}

void RenderLoop::start(RenderJob job) {
    {
        const std::scoped_lock lock(mutex_, buffers_mutex_);
        is_detached_ = false;
        is_stopped_ = false;
        last_ = next_ = std::move(job);
        status_.fraction = 0;
        interrupt_ = true;
    }
    changed_.notify_all();
}

void RenderLoop::detach(const RenderBuffer& buffer) {
    const std::scoped_lock lock(mutex_, buffers_mutex_);
    if (!last_) return;
    const auto& bindings = last_->bindings;
    if (std::none_of(bindings.begin(), bindings.end(),
                     [&](const HdRenderPassAovBinding& b) { return b.renderBuffer == &buffer; }))
        return;
    is_detached_ = true;
    next_.reset();
    last_.reset();
    interrupt_ = true;
}

bool RenderLoop::has_job() const {
    const std::lock_guard lock(mutex_);
    return last_.has_value();
}

void RenderLoop::pause(bool is_paused) {
    {
        const std::lock_guard lock(mutex_);
        is_paused_ = is_paused;
    }
    changed_.notify_all();
}

bool RenderLoop::is_paused() const {
    const std::lock_guard lock(mutex_);
    return is_paused_;
}

void RenderLoop::stop() {
    const std::lock_guard lock(mutex_);
    is_stopped_ = true;
    next_.reset();
    interrupt_ = true;
}

bool RenderLoop::is_stopped() const {
    const std::lock_guard lock(mutex_);
    return is_stopped_;
}

void RenderLoop::restart() {
    std::optional<RenderJob> job;
    {
        const std::lock_guard lock(mutex_);
        job = last_;
    }
    if (job) start(*std::move(job));
}

LoopStatus RenderLoop::status() const {
    const std::lock_guard lock(mutex_);
    return status_;
}

void RenderLoop::set_activity(std::string activity) {
    const std::lock_guard lock(mutex_);
    status_.activity = std::move(activity);
}

void RenderLoop::run() {
    for (;;) {
        std::optional<RenderJob> job;
        {
            std::unique_lock lock(mutex_);
            changed_.wait(lock, [this] { return next_ || is_quitting_; });
            if (is_quitting_) return;
            job = std::exchange(next_, std::nullopt);
            interrupt_ = false;
        }
        render(*job);
    }
}

/// Waits while the render is paused. Returns: whether the job has ended.
bool RenderLoop::is_interrupted() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return !is_paused_ || interrupt_ || is_quitting_; });
    return interrupt_ || is_quitting_;
}

void RenderLoop::set_done() {
    {
        const std::lock_guard lock(buffers_mutex_);
        if (!is_detached_ && !interrupt_)
            for (const AovRequest& request : requests_) request.buffer->set_converged(true);
    }
    set_activity("done");
}

void RenderLoop::render(const RenderJob& job) {
    layers_ = to_settings(job.settings).layers;
    requests_ = read_bindings(job.bindings, layers_);
    nearest_.reset();
    const bool is_new =
        !renderer_ || !shown_ || !(shown_->settings == job.settings) || layers_ != [&] {
            film::LayerSet layers = to_settings(shown_->settings).layers;
            (void)read_bindings(shown_->bindings, layers);
            return layers;
        }();
    if (!is_new && is_same_scene(*shown_, job) && !render_drafts(job)) return;
    if (is_interrupted()) return;
    if (!load(job, is_new)) {
        if (!interrupt_) set_done();
        return;
    }
    render_samples(job);
}

/// The stage of the job as a scene; without content: its camera alone.
Result<scene::Scene> RenderLoop::translate(const RenderJob& job, bool has_content) {
    LayerBuilder builder("hydra.usda");
    LayerPlaces places;
    if (has_content) places = records_.author(builder, job.render_tags);
    job.camera.author(builder, Path::from(job.camera_path));
    author_settings(job, builder);
    const std::shared_ptr<usd::layer::Layer> layer = builder.layer();
    if (has_content) write_layer(*layer);
    // Of a camera alone there is nothing to say: the stage that follows has it too
    Diagnostics ignored;
    Diagnostics& diagnostics = has_content ? diagnostics_ : ignored;
    const Result<usd::stage::Stage> stage = usd::stage::open_layer(layer, {}, diagnostics);
    if (!stage) return stage.error();
    render::LoadOptions options;
    options.translate.settings = settings_path;
    options.translate.camera = job.camera_path;
    Result<scene::Scene> scene = render::load_scene(*stage, options, diagnostics);
    if (scene && has_content) places_ = std::move(places);
    return scene;
}

/// First images of a camera that has moved. Returns: false when another job came.
bool RenderLoop::render_drafts(const RenderJob& job) {
    const Result<scene::Scene> seen = translate(job, false);
    if (!seen) return true;
    const scene::Scene& old = renderer_->scene();
    const scene::Camera camera = render::rebased(seen->camera, old.camera.world_position);
    render::Renderer& renderer = *renderer_;
    if (old.settings.width != job.width || old.settings.height != job.height ||
        renderer.settings().window != job.window)
        renderer.set_size(job.width, job.height, job.window);
    renderer.set_camera(camera);
    set_activity("draft");
    renderer.build(diagnostics_);
    if (is_interrupted()) return false;
    const auto tracer = render::make_draft_tracer(renderer, nullptr);
    film::Film film(job.window, renderer.settings().layers);
    integrator::RenderOptions schedule = renderer.settings().schedule;
    schedule.adaptive = false;
    integrator::RenderCallbacks callbacks;
    callbacks.stop = &interrupt_;
    for (uint64_t end = 1; end <= draft_samples; end *= 2) {
        schedule.end_sample = end;
        const integrator::RenderResult result = integrator::run_schedule(
            film, schedule,
            [&](int x, int y, uint64_t sample, film::SampleRadiance& out,
                integrator::RayCounts& counts) { tracer->trace(x, y, sample, out, counts); },
            callbacks);
        if (result.reason == integrator::StopReason::Interrupted || is_interrupted()) return false;
        write(job, film);
    }
    return true;
}

/// Brings the renderer to the scene of the job. Returns: whether there is one.
bool RenderLoop::load(const RenderJob& job, bool is_new) {
    const auto start = std::chrono::steady_clock::now();
    set_activity("translating");
    Result<scene::Scene> scene = translate(job, true);
    if (!scene) {
        TF_WARN("velatura: %s [%s]", scene.error().message.c_str(), scene.error().code.c_str());
        renderer_.reset();
        return false;
    }
    if (is_interrupted()) return false;
    std::string what = "scene loaded";
    if (is_new || !renderer_) {
        render::Settings settings = to_settings(job.settings);
        settings.layers = render::with_rows(layers_, *scene);
        settings.window = job.window;
        renderer_ = std::make_unique<render::Renderer>(*std::move(scene), std::move(settings));
    } else {
        if (renderer_->settings().window != job.window)
            renderer_->set_size(job.width, job.height, job.window);
        what = render::update(*renderer_, *std::move(scene)).text();
    }
    shown_ = job;
    set_activity("building");
    renderer_->build(diagnostics_);
    if (is_interrupted()) return false;
    set_activity("learning");
    renderer_->prepare(diagnostics_, &interrupt_);
    const std::lock_guard lock(mutex_);
    status_.load_s = seconds_since(start);
    status_.last_update = std::move(what);
    return !interrupt_;
}

void RenderLoop::render_samples(const RenderJob& job) {
    const auto start = std::chrono::steady_clock::now();
    set_activity("rendering");
    renderer_->clear_film();
    integrator::RenderCallbacks callbacks;
    callbacks.stop = &interrupt_;
    const auto spp = uint64_t(job.settings.spp);
    renderer_->schedule().adaptive = job.settings.adaptive;
    for (uint64_t end = 1;; end = std::min(2 * end, spp)) {
        const integrator::RenderResult result = renderer_->advance_to(end, callbacks);
        if (result.reason == integrator::StopReason::Interrupted || is_interrupted()) {
            // What learning depends on is complete; the film is not
            renderer_->clear_film();
            return;
        }
        write(job, renderer_->film());
        {
            const std::lock_guard lock(mutex_);
            status_.samples = end;
            status_.fraction = double(end) / double(spp);
            status_.render_s = seconds_since(start);
        }
        if (end == spp) break;
    }
    set_done();
}

void RenderLoop::write(const RenderJob& job, const film::Film& film) {
    if (!nearest_) nearest_ = find_nearest(renderer_->world(), film.window(), places_);
    const std::lock_guard lock(buffers_mutex_);
    if (!is_detached_ && !interrupt_) write_aovs(requests_, film, *nearest_, job.frame);
}

}  // namespace velatura::hydra
