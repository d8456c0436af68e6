// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/render_frame.h"
#include "integrator/world.h"
#include "render/renderer.h"
#include "study/knobs.h"
#include "study/render.h"
#include "study/report.h"

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace velatura::app {

/// Renders one frame in the settings of a study. What is prepared for a setting is kept for its
/// other rounds, while there is room.
class StudyRenderer {
  public:
    /// All must outlive it. The job's scene, as the plan left it.
    StudyRenderer(const RenderJob& job, const FrameInput& input, Diagnostics& diagnostics);

    Result<study::RenderRun> render(const study::RenderRequest& request);

    /// What files of the layers take in other formats than the render's: a part of the image of
    /// the render as it is, rendered again and written into the folder. Only those that there is
    /// time for before the deadline.
    std::vector<study::FileFormat> measure_files(const study::RenderRequest& part,
                                                 const std::string& folder);

    /// What of the job and the scene a study has to know.
    Result<study::Facts> facts();

    const image::Window& window() const { return window_; }

  private:
    /// A world and the scene that it was made from, if that is another one than the frame's.
    struct Place {
        std::unique_ptr<scene::Scene> scene;
        std::shared_ptr<const integrator::World> world;
        double setup_s = 0;
        double outline_px = 0;
        size_t bytes = 0;
    };

    /// All that a setting needs to trace samples.
    struct Prepared {
        RenderJob job;
        std::string place_key;
        std::shared_ptr<const Place> place;
        std::optional<render::Renderer> renderer;
        double setup_s = 0;
    };

    static integrator::RenderOptions schedule_of(const Prepared& p,
                                                 const study::RenderRequest& request);
    Result<study::RenderRun> render_into(film::Film& film,
                                         const Prepared& p,
                                         const study::RenderRequest& request);
    Result<RenderJob> job_with(const std::string& options) const;
    std::string place_key(const RenderJob& job) const;
    std::shared_ptr<const Place> find_place(const RenderJob& job);
    Result<std::shared_ptr<const Prepared>> prepare(const std::string& options);
    void make_room();

    const RenderJob& job_;
    const FrameInput& input_;
    Diagnostics& diagnostics_;
    image::Window window_;
    double once_s_ = 0;  ///< of preparing, what only the first world took
    std::map<std::string, std::shared_ptr<const Place>> places_;       ///< by what worlds depend on
    std::map<std::string, std::shared_ptr<const Prepared>> prepared_;  ///< by options
};

}  // namespace velatura::app
