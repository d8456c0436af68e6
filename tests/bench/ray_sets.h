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

/// primary (16×16 tiles), bounce (cosine from what primary rays met), shadow (to the rectangle
/// light) and ambient occlusion (short) rays; `size`² primary rays, one of the others for each hit.
std::vector<RaySet> make_ray_sets(const BenchScene& scene,
                                  const accel::Accelerator& accelerator,
                                  int size);

}  // namespace velatura::bench
