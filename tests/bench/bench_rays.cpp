// SPDX-License-Identifier: Apache-2.0
// Rays per second, build time and memory of the own tree, beside Embree (robust) where it is
// installed. CPU time of one thread; both in turns on the same rays, medians of three rounds.
#include "accel/bvh.h"
#include "accel/traverse.h"
#include "base/tasks.h"
#include "bench_scenes.h"
#include "ray_sets.h"
#ifdef VELATURA_HAVE_EMBREE
#include "embree_peer.h"
#endif

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <limits>

namespace velatura::bench {
namespace {

double cpu_seconds(clockid_t clock) {
    timespec now{};
    clock_gettime(clock, &now);
    return double(now.tv_sec) + 1e-9 * double(now.tv_nsec);
}

double thread_seconds(const std::function<void()>& work) {
    const double start = cpu_seconds(CLOCK_THREAD_CPUTIME_ID);
    work();
    return cpu_seconds(CLOCK_THREAD_CPUTIME_ID) - start;
}

double process_seconds(const std::function<void()>& work) {
    const double start = cpu_seconds(CLOCK_PROCESS_CPUTIME_ID);
    work();
    return cpu_seconds(CLOCK_PROCESS_CPUTIME_ID) - start;
}

double median(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
}

// Traces a set; the count of hits keeps the work from being optimised away.
template <class Closest, class Any>
size_t trace(const RaySet& set, const Closest& closest, const Any& any) {
    size_t hits = 0;
    for (const geometry::Ray& ray : set.rays) hits += set.is_any_hit ? any(ray) : closest(ray);
    return hits;
}

struct Ratios {
    std::vector<double> all;

    double mean() const {
        double sum = 0;
        for (const double r : all) sum += std::log(r);
        return all.empty() ? 0 : std::exp(sum / double(all.size()));
    }
};

void run(const BenchScene& scene, int size, int rounds, [[maybe_unused]] Ratios& ratios) {
    const accel::SoupScene soup = scene.soup();
    std::unique_ptr<accel::Accelerator> bvh;
    double build = 0;
    {
        const ThreadLimit one(1);
        build = process_seconds([&] { bvh = accel::build_bvh(soup); });
    }
    const double triangles = double(scene.triangle_count());
    const accel::AcceleratorStats stats = bvh->stats();
    fmt::print("{}: {:.2f} M triangles, {} instances\n", scene.name, triangles * 1e-6,
               stats.instances);
    fmt::print("  build {:.2f} CPU s ({:.2f} Mtri/s), {:.1f} bytes/triangle", build,
               triangles * 1e-6 / build, double(stats.bytes) / triangles);
#ifdef VELATURA_HAVE_EMBREE
    std::unique_ptr<EmbreePeer> peer;
    const double peer_build = process_seconds([&] { peer = std::make_unique<EmbreePeer>(scene); });
    fmt::print("; Embree {:.2f} CPU s, {:.1f} bytes/triangle with its copy of the mesh", peer_build,
               double(peer->bytes()) / triangles);
#endif
    fmt::print("\n  {:8} {:>8} {:>6} {:>8} {:>8} {:>6}\n", "rays", "count", "hit %", "Mrays/s",
               "Embree", "ratio");
    for (const RaySet& set : make_ray_sets(scene, *bvh, size)) {
        const double count = double(set.rays.size());
        std::vector<double> own_times, ratio;
        [[maybe_unused]] std::vector<double> peer_times;
        size_t hits = 0;
        [[maybe_unused]] size_t peer_hits = 0;
        for (int round = 0; round < rounds; ++round) {
            own_times.push_back(thread_seconds([&] {
                hits = trace(
                    set, [&](const geometry::Ray& r) { return bvh->intersect(r).is_valid(); },
                    [&](const geometry::Ray& r) { return bvh->is_occluded(r); });
            }));
#ifdef VELATURA_HAVE_EMBREE
            peer_times.push_back(thread_seconds([&] {
                peer_hits = trace(
                    set,
                    [&](const geometry::Ray& r) {
                        return peer->closest(r) < std::numeric_limits<float>::infinity();
                    },
                    [&](const geometry::Ray& r) { return peer->is_occluded(r); });
            }));
            ratio.push_back(peer_times.back() / own_times.back());
#endif
        }
        fmt::print("  {:8} {:8} {:6.1f} {:8.2f}", set.kind, set.rays.size(),
                   100.0 * double(hits) / count, count * 1e-6 / median(own_times));
#ifdef VELATURA_HAVE_EMBREE
        fmt::print(" {:8.2f} {:6.2f}   ({:+} hits)", count * 1e-6 / median(peer_times),
                   median(ratio), int64_t(hits) - int64_t(peer_hits));
        ratios.all.push_back(median(ratio));
#endif
        fmt::print("\n");
    }
}

}  // namespace
}  // namespace velatura::bench

// Arguments: edge of the picture in pixels (256), name of the only scene to run (all).
int main(int argc, char** argv) {
    using namespace velatura::bench;
    const int size = argc > 1 ? std::clamp(std::atoi(argv[1]) / 16 * 16, 16, 4096) : 256;
    fmt::print("kernels {}, {}² primary rays, one thread, CPU time, medians of 7 rounds in turn\n",
               velatura::accel::best_kernels().name, size);
    Ratios ratios;
    for (const auto& make : {make_museum, make_forest, make_interior}) {
        const BenchScene scene = make();
        if (argc <= 2 || scene.name == argv[2]) run(scene, size, 7, ratios);
    }
    if (!ratios.all.empty())
        fmt::print("geometric mean of the ratios to Embree robust: {:.2f}\n", ratios.mean());
    return 0;
}
