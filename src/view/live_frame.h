// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/frame_settings.h"
#include "app/memory_needs.h"
#include "app/prepare_frame.h"
#include "app/render_frame.h"
#include "integrator/matte_ids.h"
#include "render/renderer.h"
#include "statistics/error_curve.h"
#include "view/file_watch.h"
#include "view/live_control.h"

#include <array>
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace velatura::view {

/// One frame that is rendered while it is looked at: drafts of a few pixels first, then the passes
/// of `velatura render`, whose film it ends with, bit for bit. After each the layers so far are
/// published. A request interrupts it. When files of the scene change, it is read again, and what
/// differs is rendered; a scene that cannot be read leaves the image as it is.
class LiveFrame {
  public:
    /// All must outlive it; the scene of `input` is copied. writes_output: the finished film is
    /// written to the frame's output, as `velatura render` writes it.
    LiveFrame(const app::RenderJob& job,
              const app::FrameInput& input,
              bool writes_output,
              LiveControl& control,
              Diagnostics& diagnostics);

    /// Until the end is asked for. Returns: an exit code of exit_codes.h.
    int run();

  private:
    using Clock = std::chrono::steady_clock;

    bool is_ended() const;
    image::Window image_frame() const;
    void set_phase(LiveStatus::Phase phase);
    void note_world();
    void begin_anew();
    void watch_files();
    void reload();
    void take_scene(app::PreparedFrame frame, bool has_other_files);
    void pick(const std::array<int, 2>& pixel);
    void set_camera(const scene::Camera& camera);
    int next_reduction() const;
    void draw_draft(int reduction);
    void learn();
    void advance();
    void note_progress(const integrator::RenderState& state);
    void publish(bool is_final);
    void publish_levels(const film::Film& film, const film::FileInfo& info, int reduction);
    void write(const std::string& path, bool is_output);
    app::FrameFacts facts_of_file();

    const app::RenderJob& job_;
    const app::FrameInput* input_;
    std::optional<app::PreparedFrame> reloaded_;  ///< then input_ is of it
    std::vector<std::string> light_values_;       ///< edits of lights, as options --set
    size_t syntax_errors_;                        ///< of the scene that is rendered
    bool writes_output_;
    LiveControl& control_;
    Diagnostics& diagnostics_;
    FileWatch watch_;
    render::Renderer renderer_;
    scene::Camera first_camera_;
    std::unique_ptr<const integrator::MatteIds> mattes_;  ///< of drafts
    app::MemoryNeeds needs_;
    std::optional<app::FrameFacts> facts_;  ///< read for the first file
    statistics::ErrorCurve curve_;
    integrator::RayCounts rays_;  ///< of this image

    bool is_moving_ = false;        ///< the camera: drafts only
    bool is_learned_ = false;       ///< the prepass of this image
    bool has_film_ = false;         ///< of this image
    bool is_finished_ = false;      ///< the film has all samples
    app::PartState finished_part_;  ///< then: which
    bool is_other_image_ = true;    ///< than the one that was published last
    int shown_reduction_ = 0;       ///< of this image; 0: nothing of it was published
    int first_reduction_ = 8;       ///< of the first draft, by the time that the last one took
    double rendered_s_ = 0;         ///< this image, up to the last interruption
    double publish_s_ = 0;          ///< the last time
    Clock::time_point published_;
    Clock::time_point edited_;  ///< when this image began
};

}  // namespace velatura::view
