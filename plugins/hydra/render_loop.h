// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/diagnostics.h"
#include "plugins/hydra/aovs.h"
#include "plugins/hydra/render_settings.h"
#include "plugins/hydra/scene_records.h"
#include "render/renderer.h"

#include <pxr/base/tf/token.h>
#include <pxr/imaging/hd/aov.h>

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace velatura::hydra {

/// What a render pass asks for.
struct RenderJob {
    int scene_version = 0;
    PXR_NS::TfTokenVector render_tags;
    AuthoredPrim camera{"Camera"};
    std::string camera_path;
    int width = 0, height = 0;  ///< of the whole image
    double pixel_aspect_ratio = 1;
    std::string aspect_conform = "expandAperture";
    film::Window window;  ///< pixels of the image that are rendered
    HostSettings settings;
    PXR_NS::HdRenderPassAovBindingVector bindings;
    BufferFrame frame;
};

/// How far a render is.
struct LoopStatus {
    double fraction = 0;   ///< of the samples
    uint64_t samples = 0;  ///< per pixel
    double load_s = 0, render_s = 0;
    std::string activity;     ///< "composing", "rendering", …
    std::string last_update;  ///< what the last job changed (render::UpdateReport)
};

/// Renders in a thread of its own. The newest job counts; a job that another one replaces stops
/// within a few samples, or after the step of preparation that it is in.
///
/// A camera that moves renders drafts in the space of the scene as it is; when it has rested for as
/// long as these take, the scene is centered on it and the image begins anew. So the finished image
/// depends on the job alone, not on those before it.
class RenderLoop {
  public:
    /// Args: records: must outlive the loop.
    explicit RenderLoop(const SceneRecords& records);
    ~RenderLoop();
    RenderLoop(const RenderLoop&) = delete;
    RenderLoop& operator=(const RenderLoop&) = delete;

    void start(RenderJob job);

    /// Ends the job if it writes into the buffer: when this returns, nothing is written to it.
    void detach(const RenderBuffer& buffer);

    /// A job was started, and none of its buffers has gone since.
    bool has_job() const;

    void pause(bool is_paused);
    bool is_paused() const;

    /// Ends the job; what is in the buffers stays.
    void stop();
    bool is_stopped() const;

    /// Starts the last job again.
    void restart();

    LoopStatus status() const;

  private:
    void run();
    void render(const RenderJob& job);
    bool render_drafts(const RenderJob& job);
    bool load(const RenderJob& job, bool is_new);
    void render_samples(const RenderJob& job);
    Result<scene::Scene> translate(const RenderJob& job, bool has_content);
    void write(const RenderJob& job, const film::Film& film);
    void set_activity(std::string activity);
    void set_done();
    bool is_interrupted();

    const SceneRecords& records_;
    Diagnostics diagnostics_;

    mutable std::mutex mutex_;  ///< of what follows
    std::condition_variable changed_;
    std::optional<RenderJob> next_, last_;
    bool is_paused_ = false, is_stopped_ = false, is_quitting_ = false;
    LoopStatus status_;
    std::mutex buffers_mutex_;  ///< held while buffers are written
    bool is_detached_ = false;  ///< of buffers_mutex_
    std::atomic<bool> interrupt_ = false;

    // Of the thread
    std::unique_ptr<render::Renderer> renderer_;
    std::optional<RenderJob> shown_;  ///< whose scene the renderer has, as loaded
    LayerPlaces places_;
    std::vector<AovRequest> requests_;
    film::LayerSet layers_;  ///< without the rows of lights
    std::optional<NearestHits> nearest_;
    std::thread thread_;
};

}  // namespace velatura::hydra
