// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/accuracy.h"
#include "app/memory_needs.h"
#include "app/render_frame.h"
#include "base/diagnostics.h"
#include "film/film.h"
#include "integrator/schedule.h"
#include "layers/layer_file.h"
#include "render/renderer.h"

#include <optional>
#include <string>
#include <vector>

namespace velatura::app {

/// Reports why nothing is rendered: memory that does not suffice, what --strict or
/// --missing-textures error refuse; a replay goes on. Returns: an exit code, or Done.
int reject_frame(const RenderJob& job,
                 const MemoryNeeds& needs,
                 size_t unread_textures,
                 Diagnostics& diagnostics);

/// Of a render that ended, by a signal or for lack of memory, before it had what it can write.
/// Returns: an exit code.
int report_early_end(bool is_short_of_memory, const std::string& before, Diagnostics& diagnostics);

/// What `auto` decided before the first sample: -v prints it.
void report_prepass(const RenderJob& job,
                    const render::Renderer& renderer,
                    Diagnostics& diagnostics);

/// Samples that were left out, light that was cut, solids that are not closed.
void report_bad_samples(const film::Film& film,
                        const integrator::RenderResult& result,
                        Diagnostics& diagnostics);

/// Where the stated error is no more than a lower bound; with the pixel and sample to replay.
void warn_of_lower_bound(const std::optional<ImageError>& error,
                         bool is_rare,
                         const render::Renderer& renderer,
                         Diagnostics& diagnostics);

/// Effects that ran although the plan has them off.
void report_broken_plan(const std::vector<scene::Effect>& broken,
                        const integrator::RenderResult& result,
                        Diagnostics& diagnostics);

/// Where --missing-textures error is given. Returns: whether there are some.
bool report_missing_textures(const RenderJob& job,
                             const std::string& output,
                             size_t unread_textures,
                             Diagnostics& diagnostics);

/// Prints what a written file holds and, for a render with a target, the forecast.
void print_summary(const RenderJob& job,
                   const std::string& output,
                   const layers::WriteReport& written,
                   size_t unread_textures,
                   const film::NoiseEstimate& noise,
                   const integrator::RenderResult& result);

/// Says which budget ended the render, and what was reached; prints it unless quiet. Returns: an
/// exit code.
int report_budget(const RenderJob& job,
                  const film::NoiseEstimate& noise,
                  const integrator::RenderResult& result,
                  const std::optional<ImageError>& error,
                  Diagnostics& diagnostics);

}  // namespace velatura::app
