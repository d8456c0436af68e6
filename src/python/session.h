// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/frame_renderer.h"
#include "app/prepare_frame.h"
#include "app/render_job.h"
#include "app/scene_loader.h"
#include "base/diagnostics.h"
#include "integrator/schedule.h"
#include "python/failure.h"
#include "python/layer_arrays.h"
#include "python/process_settings.h"
#include "usd/layer/layer.h"

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace velatura::python {

class Frame;

/// One frame of a scene, ready to be rendered with the options of `velatura render`. Threads: one
/// at a time renders; cancel() is called by any other.
class Session : public std::enable_shared_from_this<Session> {
  public:
    /// Opens and translates the scene: the file of the arguments, or `layer` in memory. Throws:
    /// Failure.
    static std::shared_ptr<Session> open(const app::RenderArguments& arguments,
                                         std::shared_ptr<usd::layer::Layer> layer = nullptr);

    Session(const Session&) = delete;
    Session& operator=(const Session&) = delete;

    /// Renders the frame. With --output, its files are written. `progress` is called by the
    /// rendering threads, one at a time. Throws: Failure: Error, Canceled.
    std::shared_ptr<Frame> render(
        const std::function<void(const integrator::RenderState&)>& progress);

    /// Ends a render() in progress: no further sample is started. Does nothing between renders.
    void cancel() { stop_ = true; }

    bool is_canceled() const { return stop_; }

    /// Effects and needs, as `velatura plan --json` prints them.
    std::string plan_json();

    std::vector<Message> messages() const { return messages_of(diagnostics_); }

    int width() const { return frame_->scene->settings.width; }

    int height() const { return frame_->scene->settings.height; }

    /// Time code of the frame.
    double time() const { return frame_->input.frame; }

    const std::string& camera() const { return frame_->scene->camera.name; }

  private:
    friend class Frame;

    Session(const app::RenderArguments& arguments, std::shared_ptr<usd::layer::Layer> layer);

    void load(const app::RenderArguments& arguments, std::shared_ptr<usd::layer::Layer> layer);
    void check_output(const std::string& path) const;
    void check_missing_assets() const;

    Diagnostics diagnostics_;  ///< before what reports to it
    std::shared_ptr<const ProcessSettings> settings_;
    app::RenderJob job_;
    std::optional<app::LoadedStage> stage_;
    std::optional<app::PreparedFrame> frame_;
    std::string planned_output_;  ///< what the command would write
    std::atomic<bool> stop_ = false;
    std::mutex busy_;
};

/// A rendered frame. Keeps its session alive.
class Frame {
  public:
    Frame(std::shared_ptr<Session> session, std::unique_ptr<app::FrameRenderer> renderer);

    /// What the command's file holds. Converted on first use and kept. Throws: Failure.
    std::shared_ptr<const LayerArrays> layers();

    /// Writes the command's file, byte for byte. Returns: names of the files. Throws: Failure.
    std::vector<std::string> write(const std::string& path);

    /// "complete", "time", "target-error", "interrupted".
    std::string reason() const;

    /// Relative standard error; nullopt: not known.
    std::optional<app::ImageError> error() const { return renderer_->error(); }

    const film::NoiseEstimate& noise() const { return renderer_->noise(); }

    double seconds() const { return renderer_->result().seconds; }

    const std::shared_ptr<Session>& session() const { return session_; }

  private:
    std::shared_ptr<Session> session_;
    std::unique_ptr<app::FrameRenderer> renderer_;
    std::mutex mutex_;
    std::shared_ptr<const LayerArrays> layers_;
};

}  // namespace velatura::python
