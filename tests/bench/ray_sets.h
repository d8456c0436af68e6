// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accel/accelerator.h"
#include "bench_scenes.h"

#include <string>
#include <vector>

namespace velatura::bench {

struct RaySet {
    std::string kind;
    bool is_any_hit = false;
    std::vector<geometry::Ray> rays;
};

/// The rays that a path tracer shoots, in its order: primary (16×16 tiles), bounce1 and bounce2
/// (cosine from what primary and bounce1 rays met), shuffled (bounce1 in random order), shadow (to
/// the rectangle light) and ao (ambient occlusion, short), each path at a time of its own. `size`²
/// of each, where enough of them arise from a few dozen primary rays per pixel; fewer otherwise.
std::vector<RaySet> make_ray_sets(const BenchScene& scene,
                                  const accel::Accelerator& accelerator,
                                  int size);

}  // namespace velatura::bench
