// SPDX-License-Identifier: Apache-2.0
#include "app/replay.h"

#include "app/exit_codes.h"

#include <fmt/format.h>

namespace velatura::app {

namespace {

class PathPrinter : public integrator::PathObserver {
  public:
    explicit PathPrinter(const scene::Scene& scene) : scene_(scene) {}

    void on_hit(int bounce,
                const geometry::SurfacePoint& point,
                float t,
                const Rgb& beta) override {
        const std::string prim = point.provenance < scene_.provenance.size()
                                     ? scene_.provenance[point.provenance].prim_path
                                     : "?";
        const std::string material = point.material < scene_.materials.size()
                                         ? scene_.materials[point.material].name
                                         : "displayColor";
        fmt::print(
            "bounce {}: hit <{}> face {} at distance {:.9g}, p ({:.9g}, {:.9g}, {:.9g}), n "
            "({:.4f}, {:.4f}, {:.4f}), material <{}>, beta ({:.6g}, {:.6g}, {:.6g})\n",
            bounce, prim, point.face, t, point.p.x, point.p.y, point.p.z, point.ns.x, point.ns.y,
            point.ns.z, material, beta.x, beta.y, beta.z);
    }

    void on_volume(int bounce, const Vec3& p, float t, const Rgb& beta) override {
        fmt::print(
            "bounce {}: collides in a volume at distance {:.9g}, p ({:.9g}, {:.9g}, {:.9g}), beta "
            "({:.6g}, {:.6g}, {:.6g})\n",
            bounce, t, p.x, p.y, p.z, beta.x, beta.y, beta.z);
    }

    void on_deposit(int bounce,
                    scene::GroupId group,
                    const Rgb& radiance,
                    const char* what) override {
        fmt::print("  + b{} {}: ({:.9g}, {:.9g}, {:.9g}) {}\n", bounce, scene_.groups[group].name,
                   radiance.x, radiance.y, radiance.z, what);
    }

    void on_end(int bounce, const char* why) override {
        fmt::print("bounce {}: path {}\n", bounce, why);
    }

  private:
    const scene::Scene& scene_;
};

}  // namespace

int replay_sample(const integrator::PathTracer& tracer,
                  const film::LayerSet& layers,
                  const scene::Scene& scene,
                  const std::array<uint64_t, 3>& at) {
    if (at[0] >= uint64_t(scene.settings.width) || at[1] >= uint64_t(scene.settings.height)) {
        fmt::print(stderr,
                   "error: --replay: pixel ({}, {}) is outside the image of {} x {} [usage]\n",
                   at[0], at[1], scene.settings.width, scene.settings.height);
        return UsageError;
    }
    film::SampleRadiance radiance(layers);
    radiance.clear();
    integrator::RayCounts counts;
    PathPrinter printer(scene);
    tracer.trace(int(at[0]), int(at[1]), at[2], radiance, counts, &printer);
    const Rgb L = radiance.radiance();
    fmt::print(
        "pixel ({}, {}) sample {}: radiance ({:.9g}, {:.9g}, {:.9g}), weight {:.6g}, {} rays{}\n",
        at[0], at[1], at[2], L.x, L.y, L.z, radiance.weight, counts.total(),
        radiance.is_bad() ? fmt::format(", skipped: {}", to_string(radiance.bad_reason())) : "");
    return Done;
}

}  // namespace velatura::app
