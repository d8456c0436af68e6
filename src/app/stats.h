// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/render_frame.h"
#include "integrator/bounce_trial.h"
#include "integrator/firefly_trial.h"
#include "integrator/light_trial.h"
#include "integrator/roulette_trial.h"
#include "integrator/schedule.h"
#include "integrator/splitting_trial.h"
#include "integrator/world.h"
#include "render/renderer.h"

#include <nlohmann/json_fwd.hpp>

#include <string>

namespace velatura::app {

/// Statistics of a frame by the schema velatura.stats/1: units in names,
/// stable key order. Keys of what was not measured are omitted. ledger: of make_ledger(). noise:
/// that of the film.
nlohmann::ordered_json make_stats(const RenderJob& job,
                                  const FrameInput& input,
                                  const integrator::World& world,
                                  const integrator::GuideTraining& training,
                                  const integrator::SplittingTrial& branches,
                                  const nlohmann::ordered_json& ledger,
                                  const film::Film& film,
                                  const film::NoiseEstimate& noise,
                                  const integrator::RenderResult& result);

/// The part of the statistics that depends on the scene and the settings only: what goes into the
/// file's header, so that two runs of one render give the same header.
nlohmann::ordered_json make_scene_stats(const FrameInput& input, const integrator::World& world);

/// Names of the options that choose the estimator: integrator, light_sampling, light_selection,
/// roulette, sampler, guiding.
nlohmann::ordered_json make_estimator_stats(const RenderJob& job);

/// What the training before the render came to: used, trial_variance, wins of groups, paths, cells.
/// The same in every run.
nlohmann::ordered_json make_guiding_stats(const integrator::GuideTraining& training);

/// What trial paths said of dividing paths; same everywhere for the same image.
nlohmann::ordered_json make_splitting_stats(const integrator::SplittingTrial& trial);

/// By how much chances to end paths pay, as trial paths said; the same in every run.
nlohmann::ordered_json make_roulette_stats(const integrator::RouletteTrial& trial);

/// Of the trial of light tracing: variances of one sample per pixel, relative.
nlohmann::ordered_json make_light_tracing_stats(const integrator::LightTrial& trial, bool is_used);
nlohmann::ordered_json make_firefly_stats(const integrator::FireflyTrial& trial);

/// {last, shares, trial_paths}: of the light by bounce, the last of all that follow.
nlohmann::ordered_json make_bounce_stats(const integrator::BounceTrial& trial, int last_bounce);

/// Textures of materials and lights that could not be opened or read so far.
size_t unread_textures(const integrator::World& world);

/// Approximations in force, with what is known of their effect. Empty = unbiased.
nlohmann::ordered_json make_ledger(const RenderJob& job,
                                   const FrameInput& input,
                                   const render::Renderer& renderer);

}  // namespace velatura::app
