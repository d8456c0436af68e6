// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "film/film.h"
#include "integrator/light_tracer.h"
#include "integrator/sample_placement.h"
#include "sampling/filter.h"

#include <cstdint>
#include <functional>
#include <vector>

namespace velatura::integrator {

/// The splats of some passes of light tracing, by the pixels that they reach.
/// Threads: trace() uses all; add() can be called at the same time by many, not during trace().
class LightImage {
  public:
    /// tracer must outlive this. window: pixels that are asked for.
    LightImage(const LightTracer& tracer, const film::Window& window);

    /// Where a run of passes that begins at `begin` and may end at `end` ends, so that its splats
    /// take no more than max_bytes, about; a multiple of 8 or `end`.
    uint64_t end_of_run(uint64_t begin, uint64_t end) const;

    /// Traces the passes [begin, end) in place of those before.
    /// Args:    is_stopped: asked now and then.
    /// Returns: what was traced; a run that was stopped is incomplete.
    RayCounts trace(uint64_t begin, uint64_t end, const std::function<bool()>& is_stopped);

    /// Adds the mean of some passes at pixel (x, y) to a sample of it, whose weight is set.
    /// Args: passes: those traced last.
    void add(int x, int y, const LightPasses& passes, film::SampleRadiance& out) const;

    /// Memory of the splats of a run [bytes], about: max_bytes, or 8 passes where these take more.
    /// Args: pixels: of the window; photons: per pass; filter_radius [px]; has_path_layers: layers
    /// by
    ///       light path expressions; passes: of the whole render.
    static uint64_t expected_bytes(uint64_t pixels,
                                   uint64_t photons,
                                   float filter_radius,
                                   bool has_path_layers,
                                   uint64_t passes);

    static constexpr uint64_t max_bytes = uint64_t(256) << 20;

  private:
    /// Splats of one pass, and for each pixel which of them reach it, in the order of photons.
    struct Pass {
        Splats splats;
        std::vector<uint32_t> first;  ///< [pixel + 1] into reaching
        std::vector<uint32_t> reaching;
    };

    void sort(Pass& pass) const;
    template <class Visit>
    void for_each_pixel(const Splat& splat, const Visit& visit) const;

    const LightTracer& tracer_;
    film::Window window_;
    const sampling::PixelFilter& filter_;
    uint64_t bytes_per_pass_;
    uint64_t begin_ = 0;
    std::vector<Pass> passes_;  // [pass − begin_]
};

}  // namespace velatura::integrator
