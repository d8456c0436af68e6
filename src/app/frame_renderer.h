// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/accuracy.h"
#include "app/frame_settings.h"
#include "app/frame_writer.h"
#include "app/memory_needs.h"
#include "app/render_frame.h"
#include "app/render_progress.h"
#include "app/resume.h"
#include "base/diagnostics.h"
#include "base/output_lock.h"
#include "display/film_display.h"
#include "display/film_preview.h"
#include "layers/layer_image.h"
#include "render/renderer.h"

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace velatura::app {

/// How the caller follows a render and ends it.
struct FrameControl {
    const std::atomic<bool>* stop;                  ///< true: no further sample is started
    std::function<bool()> snapshot_requested = {};  ///< asked between passes
    /// Called often, from any rendering thread but one at a time.
    std::function<void(const integrator::RenderState&)> progress = {};
    /// False: other renders of the process use the same threads, which count the calls of effects
    /// together; whether the plan was kept is then not checked.
    bool owns_process = true;
};

/// One frame from its scene to its files, step by step: prepare(), render(), finish(). Where
/// FrameInput::output is empty, no file is written. Functions that return an int return an exit
/// code of exit_codes.h; after one other than Done no further step can follow.
class FrameRenderer {
  public:
    /// Checks the window, takes the output, finds what --resume continues. All arguments must
    /// outlive the object. Returns: an exit code; `renderer` is set where it is Done.
    static int make(const RenderJob& job,
                    const FrameInput& input,
                    const FrameControl& control,
                    Diagnostics& diagnostics,
                    std::unique_ptr<FrameRenderer>& renderer);

    FrameRenderer(const FrameRenderer&) = delete;
    FrameRenderer& operator=(const FrameRenderer&) = delete;

    /// Builds the world, runs the prepass, starts the film.
    int prepare();

    /// Traces and prints the one sample of a replay, after prepare().
    int replay();

    /// Traces the samples that the film lacks.
    void render();

    /// Writes the files and reports how the render ended.
    int finish();

    bool is_stopped() const { return result_.reason == integrator::StopReason::Interrupted; }

    /// Whether there is an image: every pixel has a sample.
    bool has_image() const { return noise_.samples_min > 0; }

    const render::Renderer& renderer() const { return renderer_; }

    /// After render().
    const film::NoiseEstimate& noise() const { return noise_; }

    const integrator::RenderResult& result() const { return result_; }

    std::optional<ImageError> error() const;

    /// After finish(): what the file of the frame holds. Errors: those of layers::make_layer_image.
    Result<layers::LayerImage> image() const;

    /// After finish(): writes the file of the frame under another name. Errors: those of
    /// Film::write.
    Result<layers::WriteReport> write(const std::string& path) const;

  private:
    FrameRenderer(const RenderJob& job,
                  const FrameInput& input,
                  const FrameControl& control,
                  std::vector<OutputLock> locks,
                  FrameFacts facts,
                  Continuation from,
                  Diagnostics& diagnostics);

    int check_what_was_learned();
    PartState unfinished_part() const;
    accumulate::SampleSums sums_with_rates() const;
    void start_film();
    void start_display();
    void start_preview();
    void end_views();
    integrator::RenderCallbacks callbacks();
    /// Returns: whether all could be written; `code` is set.
    bool write_files(int& code);
    bool write_others();

    const RenderJob job_;
    const FrameInput& input_;
    FrameControl control_;
    Diagnostics& diagnostics_;
    std::vector<OutputLock> locks_;
    Continuation from_;  ///< its sums move into the film
    FrameFacts facts_;
    render::Renderer renderer_;
    RenderProgress progress_;
    MemoryNeeds needs_;
    std::optional<MemoryWatch> memory_;
    std::optional<FrameWriter> writer_;
    std::optional<integrator::TopUpCounts> top_up_;
    std::optional<display::FilmDisplay> display_;
    std::optional<display::FilmPreview> preview_;
    film::NoiseEstimate noise_;
    integrator::RenderResult result_;
    std::vector<scene::Effect> broken_;  ///< ran though the plan has them off
    std::atomic<bool> is_short_of_memory_ = false;
};

}  // namespace velatura::app
