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

std::unique_ptr<accel::Accelerator> make_accelerator(const scene::Scene& scene,
                                                     const geometry::GeometrySet& geometry,
                                                     const accel::AcceleratorFactory* factory,
                                                     Diagnostics& diagnostics) {
    if (factory) {
        Result<std::unique_ptr<accel::Accelerator>> built = factory->build(accel::make_soup(scene, geometry));
        if (built) return std::move(*built);
        diagnostics.error(built.error().code, {}, {}, built.error().message + "; the own tree is used instead");
    }
    return accel::build_bvh(scene, geometry);
}

}  // namespace

World::World(const scene::Scene& s, const WorldOptions& options, const lights::ImageLoader& load_image, Diagnostics& diagnostics)
    : scene(s),
      geometry(timed(times.tessellate_s, [&] { return geometry::GeometrySet(s); })),
      accelerator(timed(times.accelerator_s, [&] { return make_accelerator(s, geometry, options.accelerator, diagnostics); })),
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
      has_lobe_multipliers(std::any_of(s.lights.begin(), s.lights.end(), [](const scene::Light& l) {
          return l.diffuse_multiplier != 1.0f || l.specular_multiplier != 1.0f;
      })) {}

}  // namespace velatura::integrator
