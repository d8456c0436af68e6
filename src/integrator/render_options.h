// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "statistics/error_curve.h"

#include <array>
#include <cstdint>

namespace velatura::integrator {

/// Tile: every tile takes all its samples at once. Progressive: whole-frame passes that double.
/// Both give the same image, bit for bit.
enum class RenderMode : uint8_t { Progressive, Tile };

struct RenderOptions {
    RenderMode mode = RenderMode::Progressive;
    uint64_t seed = 0;
    uint64_t first_sample = 0;  ///< samples [first_sample, end_sample) of every pixel;
                                ///< adaptive: of a pixel of rate 1
    uint64_t end_sample = 64;
    bool is_open_ended = false;  ///< end_sample is out of reach: the time or the error ends it
    bool adaptive = false;  ///< more samples where there is more noise, see SampleRates; else the
                            ///< same everywhere
    int tile_size = 32;     ///< pixels; rounded up to whole tiles of the film
    int max_depth =
        0;  ///< scatterings after which paths are cut (a bias); 0 = only roulette ends them
    double snapshot_interval_s = 0;  ///< 0 = no interim images
    double time_budget_s = 0;        ///< progressive: stop at the pass that ends after it; 0 = none
    double target_error =
        0;  ///< progressive: stop when the relative standard error is this; 0 = none
    bool needs_sure_target = false;  ///< an error that is a lower bound does not reach target_error
    double forecast_error =
        0;  ///< progressive: forecast when the error will be this; 0 = that of target_error, if any
    statistics::ErrorCurve curve =
        {};  ///< progressive: what the part of the render that the film came with said of its error
    bool has_dependent_changes = false;  ///< what later samples of a pixel change says no more than
                                         ///< an upper bound of its error: strata
    bool has_independent_halves =
        false;  ///< even and odd samples know nothing of each other, see sampling::has_halves
};

/// Even without a bias by depth, a path must end on machines with finite time; reaching this is
/// counted and reported.
inline constexpr int hard_depth_limit = 65536;

}  // namespace velatura::integrator
