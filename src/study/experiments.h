// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "study/knobs.h"
#include "study/tally.h"

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace velatura::study {

struct ExperimentOptions {
    double time_s = 180;        ///< no render is begun that would end later
    int rounds = 16;            ///< at most
    uint64_t seed = 0;          ///< of the first round; each further one takes the next
    uint64_t spp = 64;          ///< of the render
    int width = 0, height = 0;  ///< of its image, pixels
};

/// How far a study is.
struct StudyState {
    int round = 0, rounds = 0;
    size_t run = 0, runs = 0;  ///< of the round
    std::string what;          ///< the setting
    double elapsed_s = 0, time_s = 0;
};

struct ExperimentCallbacks {
    std::function<void(const StudyState&)> progress;
    std::function<void(const Tallies&)> round_done;
    std::function<bool()> is_stopped;
};

/// A grid of the image's shape, of so many pixels that `rounds` rounds of the settings fit into
/// the time, from a trial render of few pixels. Errors: those of the render.
Result<Grid> choose_grid(const std::vector<Setting>& settings,
                         const ExperimentOptions& options,
                         const RenderFunction& render);

/// Renders all settings round by round, one seed for all settings of a round, in an order that
/// turns from round to round: what slows the machine down for a while slows all of them. Settings
/// of which enough is known leave more time to the others (settled_settings). Goes on from the
/// rounds that the tallies have. Ends after the rounds, when time is up, or when stopped; a round
/// that is left in the middle counts only where it is one of the first two. Errors: those of the
/// render as it is, if there is not one of it.
Result<void> run_experiments(const std::vector<Setting>& settings,
                             const ExperimentOptions& options,
                             const RenderFunction& render,
                             const ExperimentCallbacks& callbacks,
                             Tallies& tallies);

}  // namespace velatura::study
