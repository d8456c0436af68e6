// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/frame_settings.h"
#include "app/memory_needs.h"
#include "app/prepare_frame.h"
#include "app/render_frame.h"
#include "image/image.h"
#include "image/window.h"
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

    /// How far an image is.
    struct Progress {
        bool is_learned = false;  ///< the prepass
        bool has_film = false;
        bool is_finished = false;      ///< the film has all samples
        app::PartState finished_part;  ///< then: which
        statistics::ErrorCurve curve;
        integrator::RayCounts rays;
        double rendered_s = 0;  ///< up to the last interruption
    };

    bool is_ended() const;

    render::Renderer& image() { return region_ ? *region_ : renderer_; }

    Progress& progress() { return region_ ? of_region_ : of_whole_; }

    void look_at_requests(const LiveRequests& asked);
    void set_region(const image::Window& region);
    void begin_region();
    void note_problems(const Diagnostics& diagnostics);
    image::Window image_frame() const;
    void set_phase(LiveStatus::Phase phase);
    void note_world();
    void begin_anew();
    void watch_files();
    void reload(const LiveEdits& edits);
    void take_scene(app::PreparedFrame frame, bool has_other_files, const LiveEdits& edits);
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

    app::RenderJob job_;            ///< with the camera that was chosen
    const std::string first_prim_;  ///< the render's own --camera
    const app::FrameInput* input_;
    std::optional<app::PreparedFrame> reloaded_;  ///< then input_ is of it
    // What was edited last; a scene that cannot be read now gets it once it can
    std::vector<std::string> values_;  ///< as options --set
    std::string camera_prim_;          ///< as --camera
    size_t syntax_errors_;             ///< of the scene that is rendered
    bool writes_output_;
    LiveControl& control_;
    Diagnostics& diagnostics_;
    FileWatch watch_;
    render::Renderer renderer_;
    scene::Camera first_camera_;                ///< as the scene has it
    image::Window region_window_;               ///< that was asked for; empty: the whole image
    std::unique_ptr<render::Renderer> region_;  ///< of it, on the same world; null: the whole image
    std::optional<image::Image> behind_;        ///< what is shown around it
    Progress of_whole_, of_region_;
    std::unique_ptr<const integrator::MatteIds> mattes_;  ///< of drafts
    app::MemoryNeeds needs_;
    std::optional<app::FrameFacts> facts_;  ///< read for the first file

    bool is_moving_ = false;      ///< edits follow one another: drafts only
    bool is_other_image_ = true;  ///< than the one that was published last
    int shown_reduction_ = 0;     ///< of this image; 0: nothing of it was published
    int first_reduction_ = 8;     ///< of the first draft, by the time that the last one took
    double publish_s_ = 0;        ///< the last time
    Clock::time_point published_;
    Clock::time_point edited_;  ///< when this image began
};

}  // namespace velatura::view
