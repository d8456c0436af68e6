// SPDX-License-Identifier: Apache-2.0
// Rays per second, build time and memory of the own tree beside Embree (robust, and fast with
// spatial splits) where that is installed. CPU time of one thread; all in turns on the same rays.
#include "accel/bvh.h"
#include "accel/ray_stream.h"
#include "accel/traverse.h"
#include "base/tasks.h"
#include "bench_scenes.h"
#include "cpu_clock.h"
#include "parse_options.h"
#include "ray_sets.h"
#ifdef VELATURA_HAVE_EMBREE
#include "embree_peer.h"
#endif

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <span>

namespace velatura::bench {
namespace {

double median(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
}

double geometric_mean(const std::vector<double>& values) {
    double sum = 0;
    for (const double v : values) sum += std::log(v);
    return std::exp(sum / double(values.size()));
}

// Something that traces rays: the own tree or a peer.
struct Tracer {
    std::string name;
    double build_seconds = 0;
    double bytes = 0;
    double copy_bytes = 0;                                 ///< of a mesh of its own
    std::function<std::vector<bool>(const RaySet&)> hits;  ///< whether each ray met something
    std::function<size_t(const RaySet&)> trace;            ///< how many did: what is timed
    std::function<std::string(const RaySet&)> way;         ///< own: how the stream traces them
};

// The count keeps the work from being optimized away. The loop is compiled for each tracer, so that
// none pays for a call through std::function per ray.
template <class Closest, class Any>
Tracer make_tracer(const std::string& name, const Closest& closest, const Any& any) {
    Tracer tracer;
    tracer.name = name;
    tracer.hits = [=](const RaySet& set) {
        std::vector<bool> hits;
        for (const geometry::Ray& ray : set.rays) {
            hits.push_back(set.is_any_hit ? any(ray) : closest(ray));
        }
        return hits;
    };
    tracer.trace = [=](const RaySet& set) {
        size_t count = 0;
        if (set.is_any_hit) {
            for (const geometry::Ray& ray : set.rays) count += any(ray);
        } else {
            for (const geometry::Ray& ray : set.rays) count += closest(ray);
        }
        return count;
    };
    return tracer;
}

// The own tree, by a stream for each kind of rays.
class OwnTracer {
  public:
    explicit OwnTracer(const accel::Accelerator& bvh) : bvh_(bvh) {}

    // Calls on_batch(hit or occluded, as bytes) for one batch after the other.
    template <class OnBatch>
    void trace(const RaySet& set, const OnBatch& on_batch) {
        constexpr size_t batch = 4096;
        accel::RayStream& stream = streams_.try_emplace(set.kind, bvh_).first->second;
        hits_.resize(batch);
        occluded_.resize(batch);
        const std::span<const geometry::Ray> rays(set.rays);
        for (size_t i = 0; i < rays.size(); i += batch) {
            const auto some = rays.subspan(i, std::min(batch, rays.size() - i));
            if (set.is_any_hit) {
                stream.is_occluded(some, occluded_);
            } else {
                stream.intersect(some, hits_);
                for (size_t k = 0; k < some.size(); ++k) occluded_[k] = hits_[k].is_valid();
            }
            on_batch(std::span<const uint8_t>(occluded_.data(), some.size()));
        }
    }

    bool is_side_by_side(const RaySet& set) const {
        return streams_.at(set.kind).is_side_by_side();
    }

  private:
    const accel::Accelerator& bvh_;
    std::map<std::string, accel::RayStream, std::less<>> streams_;
    std::vector<geometry::Hit> hits_;
    std::vector<uint8_t> occluded_;
};

Tracer own_tracer(const accel::Accelerator& bvh, double build_seconds) {
    const auto own = std::make_shared<OwnTracer>(bvh);
    Tracer tracer;
    tracer.name = "own";
    tracer.hits = [own](const RaySet& set) {
        std::vector<bool> hits;
        const auto once = [&] {
            hits.clear();
            own->trace(set, [&](std::span<const uint8_t> some) {
                hits.insert(hits.end(), some.begin(), some.end());
            });
        };
        // Small sets have too few batches for the choice
        for (int i = 0; i < 10; ++i) once();
        return hits;
    };
    tracer.trace = [own](const RaySet& set) {
        size_t count = 0;
        own->trace(set, [&](std::span<const uint8_t> some) {
            for (const uint8_t hit : some) count += hit;
        });
        return count;
    };
    tracer.way = [own](const RaySet& set) {
        return own->is_side_by_side(set) ? "batch" : "single";
    };
    tracer.build_seconds = build_seconds;
    tracer.bytes = double(bvh.stats().bytes);
    return tracer;
}

#ifdef VELATURA_HAVE_EMBREE
Tracer peer_tracer(const std::string& name, const EmbreePeer& peer) {
    Tracer tracer = make_tracer(
        name,
        [&peer](const geometry::Ray& r) {
            return peer.closest(r) < std::numeric_limits<float>::infinity();
        },
        [&peer](const geometry::Ray& r) { return peer.is_occluded(r); });
    tracer.build_seconds = peer.build_seconds();
    tracer.bytes = double(peer.tree_bytes());
    tracer.copy_bytes = double(peer.mesh_bytes());
    return tracer;
}
#endif

// Ratios of speeds, own to peer, one for each scene and kind of rays.
struct Cells {
    std::vector<double> to_robust, to_fast, plain;  ///< plain: to robust, no thin-triangle scene
};

struct Settings {
    int size = 640;
    int rounds = 5;
    std::vector<std::string> scenes;
    accel::BvhQuality quality = accel::BvhQuality::Balanced;
};

void print_builds(const std::vector<Tracer>& tracers, size_t triangles) {
    for (const Tracer& tracer : tracers) {
        fmt::print("  {:8} build {:6.2f} CPU s ({:5.2f} Mtri/s)  {:6.1f} bytes/triangle",
                   tracer.name, tracer.build_seconds,
                   double(triangles) * 1e-6 / tracer.build_seconds,
                   tracer.bytes / double(triangles));
        if (tracer.copy_bytes > 0)
            fmt::print(", {:.1f} with its copy of the mesh",
                       (tracer.bytes + tracer.copy_bytes) / double(triangles));
        fmt::print("\n");
    }
}

// Seconds of each tracer, [tracer][round], in turns that begin with another one each round.
std::vector<std::vector<double>> times_of(const std::vector<Tracer>& tracers,
                                          const RaySet& set,
                                          int rounds) {
    std::vector<std::vector<double>> times(tracers.size());
    size_t sink = 0;
    for (size_t round = 0; round < size_t(rounds); ++round) {
        for (size_t k = 0; k < tracers.size(); ++k) {
            const size_t turn = (round + k) % tracers.size();
            const double start = thread_seconds();
            sink += tracers[turn].trace(set);
            times[turn].push_back(thread_seconds() - start);
        }
    }
    // No set has so many rays; the compiler cannot know
    if (sink == std::numeric_limits<size_t>::max()) fmt::print("\n");
    return times;
}

double median_ratio(const std::vector<double>& peer, const std::vector<double>& own) {
    std::vector<double> ratios;
    for (size_t i = 0; i < own.size(); ++i) ratios.push_back(peer[i] / own[i]);
    return median(ratios);
}

size_t differing(const std::vector<bool>& a, const std::vector<bool>& b) {
    size_t count = 0;
    for (size_t i = 0; i < a.size(); ++i) count += a[i] != b[i];
    return count;
}

void run_set(
    const std::vector<Tracer>& tracers, const RaySet& set, int rounds, bool is_thin, Cells& cells) {
    if (set.rays.empty()) return;
    // Warms caches and branch predictors as well
    std::vector<std::vector<bool>> hits;
    for (const Tracer& tracer : tracers) hits.push_back(tracer.hits(set));
    const auto times = times_of(tracers, set, rounds);
    const double count = double(set.rays.size());
    fmt::print("  {:8} {:8} {:6.1f}", set.kind, set.rays.size(),
               100.0 * double(std::count(hits[0].begin(), hits[0].end(), true)) / count);
    fmt::print(" {:>7}", tracers[0].way(set));
    for (const auto& t : times) fmt::print(" {:8.2f}", count * 1e-6 / median(t));
    for (size_t k = 1; k < tracers.size(); ++k) {
        const double ratio = median_ratio(times[k], times[0]);
        fmt::print(" {:7.2f}", ratio);
        (k == 1 ? cells.to_robust : cells.to_fast).push_back(ratio);
        if (k == 1 && !is_thin) cells.plain.push_back(ratio);
    }
    for (size_t k = 1; k < tracers.size(); ++k) fmt::print(" {:7}", differing(hits[0], hits[k]));
    fmt::print("\n");
    std::fflush(stdout);
}

void run_scene(const SceneMaker& maker, const Settings& settings, Cells& cells) {
    const BenchScene scene = maker.make();
    const accel::SoupScene soup = scene.soup();
    const ThreadLimit one(1);
    const double start = cpu_seconds();
    const std::unique_ptr<accel::Accelerator> bvh =
        accel::build_bvh(soup, accel::options_of(settings.quality));
    std::vector<Tracer> tracers = {own_tracer(*bvh, cpu_seconds() - start)};
#ifdef VELATURA_HAVE_EMBREE
    const EmbreePeer robust(soup, EmbreeMode::RobustMedium), fast(soup, EmbreeMode::FastHigh);
    tracers.push_back(peer_tracer("robust", robust));
    tracers.push_back(peer_tracer("fast", fast));
#endif
    fmt::print("\n{}: {:.2f} M triangles stored, {} instances\n", maker.name,
               double(scene.triangle_count()) * 1e-6, scene.instances.size());
    print_builds(tracers, scene.triangle_count());
    fmt::print("  {:8} {:>8} {:>6} {:>7}", "rays", "count", "hit %", "way");
    for (const Tracer& tracer : tracers) fmt::print(" {:>8}", tracer.name);
    if (tracers.size() > 1) fmt::print("  /robust   /fast  differing hits");
    fmt::print("\n");
    Cells of_scene;
    for (const RaySet& set : make_ray_sets(scene, *bvh, settings.size)) {
        run_set(tracers, set, settings.rounds, maker.is_thin, of_scene);
    }
    if (!of_scene.to_robust.empty()) {
        fmt::print("  geometric mean {:.2f} of robust, {:.2f} of fast\n",
                   geometric_mean(of_scene.to_robust), geometric_mean(of_scene.to_fast));
    }
    const auto append = [](std::vector<double>& to, const std::vector<double>& from) {
        to.insert(to.end(), from.begin(), from.end());
    };
    append(cells.to_robust, of_scene.to_robust);
    append(cells.to_fast, of_scene.to_fast);
    append(cells.plain, of_scene.plain);
}

void print_head(const Settings& settings) {
    fmt::print(
        "Own tree ({} kernels, {} quality), Embree robust (medium quality) and Embree fast (not\n"
        "robust, high quality: spatial splits), both with single rays. Own: batches of 4096, side "
        "by side or\n"
        "one by one (way), as the stream of that kind of rays chose by timing the first ones.\n"
        "One thread, CPU time; warmed up, then {} rounds in turns; Mrays/s are medians, ratios\n"
        "medians of the rounds' ratios (above 1: own is faster).\n"
        "Build: CPU time on one thread. Bytes: all that traversal reads, nodes and leaves with\n"
        "the corners of their triangles, for all three; Embree's by its memory monitor, without\n"
        "its copy of vertices and indices, which it does not read while it traces (ours makes no\n"
        "copy). Differing hits: rays that met something in one tree only, against robust and "
        "fast.\n",
        accel::best_kernels().name, accel::name_of(settings.quality), settings.rounds);
#ifndef VELATURA_HAVE_EMBREE
    fmt::print("Embree 3 was not found when this was configured (libembree-dev): no ratios.\n");
#endif
}

int run(const Settings& settings) {
    print_head(settings);
    Cells cells;
    for (const SceneMaker& maker : all_scenes()) {
        const auto& names = settings.scenes;
        if (names.empty() || std::find(names.begin(), names.end(), maker.name) != names.end())
            run_scene(maker, settings, cells);
    }
    if (cells.to_robust.empty()) return 0;
    // Without any scene but the thin one there is no plain mean
    const double plain = cells.plain.empty() ? std::numeric_limits<double>::quiet_NaN()
                                             : geometric_mean(cells.plain);
    fmt::print("\ngeomean {:.3f} min {:.3f} fast {:.3f} plain {:.3f}\n",
               geometric_mean(cells.to_robust),
               *std::min_element(cells.to_robust.begin(), cells.to_robust.end()),
               geometric_mean(cells.to_fast), plain);
    return 0;
}

}  // namespace
}  // namespace velatura::bench

int main(int argc, char** argv) {
    using namespace velatura::bench;
    velatura::CommandLine app("Rays per second of the own tree, beside Embree's");
    Settings settings;
    add_scene_options(app, settings.scenes, settings.size, settings.rounds);
    using velatura::accel::BvhQuality;
    const std::map<std::string, BvhQuality> qualities = {
        {"fast", BvhQuality::Fast}, {"balanced", BvhQuality::Balanced}, {"high", BvhQuality::High}};
    std::string quality = "balanced";
    app.add_option("--quality", quality, "build quality of the own tree")
        .one_of({"fast", "balanced", "high"});
    if (const auto code = velatura::bench::parse_options(app, argc, argv)) return *code;
    settings.size = settings.size / 16 * 16;
    settings.quality = qualities.at(quality);
    return run(settings);
}
