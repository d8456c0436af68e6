// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/progress.h"
#include "app/render_job.h"
#include "film/film.h"
#include "integrator/schedule.h"

namespace velatura::app {

/// The progress lines of one frame.
class RenderProgress {
  public:
    explicit RenderProgress(const RenderJob& job) : job_(job), printer_(job.progress) {}

    void show(const integrator::RenderState& state) {
        last_fraction_ = state.fraction;
        show(state, false);
    }

    /// With --progress image.
    void show_image(const display::PreviewImage& image) {
        if (job_.terminal) printer_.show_image(*job_.terminal, image);
    }

    /// The last line, with what the whole frame took. A render that was stopped stays at the
    /// fraction that it had come to.
    void finish(const film::Film& film,
                const film::NoiseEstimate& noise,
                const integrator::RenderResult& result);

  private:
    void show(const integrator::RenderState& state, bool is_last);

    const RenderJob& job_;
    ProgressPrinter printer_;
    double last_fraction_ = 0;
};

}  // namespace velatura::app
