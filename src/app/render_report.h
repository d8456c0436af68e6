// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/accuracy.h"
#include "app/render_frame.h"
#include "base/diagnostics.h"
#include "film/film.h"
#include "integrator/schedule.h"
#include "render/renderer.h"

#include <optional>

namespace velatura::app {

/// What `auto` decided before the first sample: -v prints it.
void note_what_was_learned(const RenderJob& job,
                           const render::Renderer& renderer,
                           Diagnostics& diagnostics);

/// Samples that were left out, light that was cut, bodies that are not closed.
void report_bad_samples(const film::Film& film,
                        const integrator::RenderResult& result,
                        Diagnostics& diagnostics);

/// Where the stated error is no more than a lower bound.
void warn_of_lower_bound(const std::optional<PictureError>& error,
                         bool is_rare,
                         const film::Window& window,
                         Diagnostics& diagnostics);

/// Says which budget ended the render, and what was reached; prints it unless quiet. Returns: an
/// exit code.
int report_budget(const RenderJob& job,
                  const film::NoiseEstimate& noise,
                  const integrator::RenderResult& result,
                  const std::optional<PictureError>& error,
                  Diagnostics& diagnostics);

}  // namespace velatura::app
