// SPDX-License-Identifier: Apache-2.0
#include "integrator/world.h"

#include <algorithm>
#include <chrono>

#include "accel/bvh.h"

namespace velatura::integrator {

namespace {

/// Runs `make` and adds up how long it took.
template <class Make>
auto timed(double& seconds, Make make) {
    struct Stopwatch {
        double& seconds;
        std::chrono::steady_clock::time_point start = std::chrono::steady_clock::now();

        ~Stopwatch() { seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(); }
    };
    const Stopwatch stopwatch{seconds};
    return make();
}

template <class Light>
bool has_multiplier(const Light& l) {
    return l.diffuse_multiplier != 1.0f || l.specular_multiplier != 1.0f;
}

}  // namespace

World::World(const scene::Scene& s, const WorldOptions& options, const lights::ImageLoader& load_image, Diagnostics& diagnostics)
    : scene(s),
      geometry(timed(times.tessellate_s, [&] { return geometry::GeometrySet(s); })),
      accelerator(timed(times.accelerator_s, [&] { return accel::build_bvh(s, geometry); })),
      materials(s, diagnostics),
      lights(timed(times.lights_s, [&] {
          return lights::LightSet(s, load_image, diagnostics,
                                  {.compensate_mis = options.compensate_mis, .geometry = &geometry, .materials = &materials});
      })),
      selector(timed(times.lights_s, [&] {
          return lights::make_light_selector(lights, accelerator->bounds(), {.kind = options.light_selection});
      })),
      camera(s.camera, options.width, options.height),
      has_very_many_lights(lights::wants_fine_numbers(lights)),
      has_lobe_multipliers(std::any_of(s.lights.begin(), s.lights.end(), has_multiplier<scene::Light>) ||
                           std::any_of(s.mesh_lights.begin(), s.mesh_lights.end(), has_multiplier<scene::MeshLight>)) {}

}  // namespace velatura::integrator
