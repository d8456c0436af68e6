// SPDX-License-Identifier: Apache-2.0
#include "app/replay.h"

#include "accumulate/pixel_means.h"
#include "app/exit_codes.h"
#include "base/atomic_file.h"

#include <fmt/format.h>

#include <algorithm>

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

/// False, with a message: outside of the image.
bool is_in_image(const scene::Scene& scene, const ReplayedSamples& what) {
    if (what.x < uint64_t(scene.settings.width) && what.y < uint64_t(scene.settings.height))
        return true;
    fmt::print(stderr, "error: --replay: pixel ({}, {}) is outside the image of {} x {} [usage]\n",
               what.x, what.y, scene.settings.width, scene.settings.height);
    return false;
}

}  // namespace

int print_paths(const integrator::PathTracer& tracer,
                const film::LayerSet& layers,
                const scene::Scene& scene,
                const ReplayedSamples& what) {
    if (!is_in_image(scene, what)) return UsageError;
    film::SampleRadiance radiance(layers);
    PathPrinter printer(scene);
    for (uint64_t s = what.first; s < what.end; ++s) {
        radiance.clear();
        integrator::RayCounts counts;
        tracer.trace(int(what.x), int(what.y), s, radiance, counts, &printer);
        const Rgb L = radiance.radiance();
        fmt::print(
            "pixel ({}, {}) sample {}: radiance ({:.9g}, {:.9g}, {:.9g}), weight {:.6g}, {} "
            "rays{}\n",
            what.x, what.y, s, L.x, L.y, L.z, radiance.weight, counts.total(),
            radiance.is_bad() ? fmt::format(", skipped: {}", to_string(radiance.bad_reason()))
                              : "");
    }
    return Done;
}

int write_paths(const integrator::PathTracer& tracer,
                const film::LayerSet& layers,
                const integrator::World& world,
                const ReplayedSamples& what,
                const PathsFileInfo& info,
                const std::vector<std::string>& files,
                Diagnostics& diagnostics) {
    if (!is_in_image(world.scene, what)) return UsageError;
    PixelPaths pixel;
    pixel.x = int(what.x);
    pixel.y = int(what.y);
    pixel.first = what.first;
    pixel.end = what.end;
    const PixelPaths paths = trace_pixel_paths(tracer, layers, world, pixel);
    size_t vertices = 0, found = 0;
    for (const SamplePaths& sample : paths.samples) {
        vertices += sample.vertices.size();
        found += sample.lights.size();
    }
    fmt::print("pixel ({}, {}), samples {} to {}: beauty ({:.9g}, {:.9g}, {:.9g})\n", what.x,
               what.y, what.first, what.end - 1, paths.value.x, paths.value.y, paths.value.z);
    for (const std::string& file : files) {
        const bool is_json = file.ends_with(".json");
        const Result<void> written = write_file_atomically(
            file, is_json ? paths_as_json(paths, info) : paths_as_usda(paths, info));
        if (!written) {
            diagnostics.error(written.error().code, {}, {}, written.error().message);
            return RenderError;
        }
        fmt::print("{}: {} paths, {} vertices, {} lights found\n", file, paths.samples.size(),
                   vertices, found);
    }
    return Done;
}

BrightestSample brightest_sample(const integrator::PathTracer& tracer,
                                 const film::LayerSet& layers,
                                 const film::Film& film,
                                 int x,
                                 int y) {
    const accumulate::SampleSums& sums = film.sums();
    const accumulate::PixelRecord& record = sums.record(x, y);
    film::SampleRadiance radiance(layers);
    integrator::RayCounts counts;
    BrightestSample found{.sample = record.first};
    float brightest = 0, traced = 0;
    for (uint64_t s = record.first; s < record.end; ++s) {
        radiance.clear();
        tracer.trace(x, y, s, radiance, counts);
        if (radiance.is_bad()) continue;
        const Rgb value = radiance.radiance();
        const float channel = std::max({value.x, value.y, value.z});
        traced += channel / float(record.end - record.first);
        if (channel <= brightest) continue;
        brightest = channel;
        found.sample = s;
    }
    const accumulate::EarlierMean own =
        accumulate::mean_of(sums.total(x, y, accumulate::AccumulatorTable::beauty),
                            sums.total(x, y, accumulate::AccumulatorTable::coverage));
    if (float(std::max({own[0], own[1], own[2]})) > 2 * traced) {
        found.cause = BrightestSample::Cause::LightTracing;
        return found;
    }
    // At an edge a pixel beside it shows what the sample hit
    constexpr int radius = 2;
    constexpr float far_brighter = 4;
    float around = 0;
    const film::Window& w = film.window();
    for (int v = std::max(y - radius, w.y0); v < std::min(y + radius + 1, w.y1); ++v) {
        for (int u = std::max(x - radius, w.x0); u < std::min(x + radius + 1, w.x1); ++u) {
            if (u == x && v == y) continue;
            const accumulate::EarlierMean mean =
                accumulate::mean_of(sums.total(u, v, accumulate::AccumulatorTable::beauty),
                                    sums.total(u, v, accumulate::AccumulatorTable::coverage));
            around = std::max({around, float(mean[0]), float(mean[1]), float(mean[2])});
        }
    }
    if (brightest > far_brighter * around) found.cause = BrightestSample::Cause::Firefly;
    return found;
}

}  // namespace velatura::app
