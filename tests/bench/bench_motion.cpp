// SPDX-License-Identifier: Apache-2.0
// What motion costs: rays per second through meshes that stay and through the same meshes deformed
// over 1, 2 and 4 segments, beside Embree (robust) where that is installed. CPU time of one thread.
#include "accel/bvh.h"
#include "accel/ray_stream.h"
#include "accel/traverse.h"
#include "base/tasks.h"
#include "bench_scenes.h"
#include "cpu_clock.h"
#include "geometry/triangle_mesh.h"
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

struct Settings {
    int size = 320;
    int rounds = 5;
    float amount = 1;
    std::vector<std::string> scenes = {"museum", "statue", "hair", "forest", "woods"};
    std::vector<uint32_t> segments = {1, 2, 4};
};

// Where everything goes while the shutter is open: a turn about the middle and waves that run
// through it, of about 2 % of the scene's size, on curves.
Vec3 deformed(const Vec3& p, const Vec3& middle, float size, float time, float amount) {
    const Vec3 q = (p - middle) * (12 / size);
    const float angle = 0.03f * time * amount, c = std::cos(angle), s = std::sin(angle);
    const float wave = 0.02f * size * amount * std::sin(1.3f * time);
    const Vec3 bent(std::sin(q.y + 2 * time), std::sin(q.z + q.x), std::sin(q.x - time));
    const Vec3 turned(c * (p.x - middle.x) - s * (p.z - middle.z), p.y - middle.y,
                      s * (p.x - middle.x) + c * (p.z - middle.z));
    return middle + turned + bent * wave;
}

std::vector<Vec3> pose(const BenchMesh& mesh, float time, float amount) {
    Box3 box;
    for (const Vec3& p : mesh.positions) box.extendBy(p);
    std::vector<Vec3> positions;
    for (const Vec3& p : mesh.positions)
        positions.push_back(deformed(p, box.center(), (box.max - box.min).length(), time, amount));
    return positions;
}

// Instances do not deform; each turns and wanders by itself.
Mat4 pose(const accel::SoupInstance& instance, float time, float amount) {
    const Vec3 foot(instance.render_from_prototype[3][0], instance.render_from_prototype[3][1],
                    instance.render_from_prototype[3][2]);
    Mat4d there, turn, back;
    there.setTranslation(-Vec3d(foot));
    turn.setAxisAngle(Vec3d(0, 1, 0), 0.1 * double(time * amount));
    back.setTranslation(Vec3d(foot) + Vec3d(std::sin(foot.z), 0, std::cos(foot.x)) *
                                          (0.3 * std::sin(1.3 * double(time)) * double(amount)));
    return Mat4(Mat4d(instance.render_from_prototype) * there * turn * back);
}

// How the scene is when the shutter is half through: what motion is compared with.
void stop(BenchScene& scene, float amount) {
    scene.direct.positions = pose(scene.direct, 0.5f, amount);
    for (accel::SoupInstance& instance : scene.instances)
        instance.render_from_prototype = pose(instance, 0.5f, amount);
}

void move(BenchScene& scene, uint32_t segments, float amount) {
    const auto time_of = [&](uint32_t key) { return float(key) / float(segments); };
    for (uint32_t key = 1; key <= segments; ++key)
        scene.direct.later_positions.push_back(pose(scene.direct, time_of(key), amount));
    for (const accel::SoupInstance& instance : scene.instances) {
        std::vector<Mat4>& keys = scene.later_instances.emplace_back();
        for (uint32_t key = 1; key <= segments; ++key)
            keys.push_back(pose(instance, time_of(key), amount));
    }
}

// One way to move, built by one library.
struct Contestant {
    std::string name;
    double build_seconds = 0, bytes = 0;
    const std::vector<RaySet>* sets = nullptr;
    std::function<size_t(const RaySet&)> trace;  ///< how many rays met something
};

// A scene in one motion, with what traces it.
struct Moved {
    BenchScene scene;
    std::unique_ptr<accel::Accelerator> bvh;
    std::vector<RaySet> sets;
    double build_seconds = 0;
#ifdef VELATURA_HAVE_EMBREE
    std::unique_ptr<EmbreePeer> embree;
#endif
};

// A mesh whose keys are all alike, as a closed shutter makes it.
void close_shutter(BenchMesh& mesh) {
    geometry::TriangleMeshData data;
    data.positions = mesh.positions;
    data.triangles = mesh.triangles;
    data.later_positions.assign(2, mesh.positions);
    const geometry::TriangleMesh closed(std::move(data));
    mesh.later_positions.assign(closed.later_positions().begin(), closed.later_positions().end());
}

std::unique_ptr<Moved> make_moved(BenchScene scene, int size, bool with_peer) {
    auto moved = std::make_unique<Moved>();
    moved->scene = std::move(scene);
    const accel::SoupScene soup = moved->scene.soup();
    const double start = cpu_seconds();
    moved->bvh = accel::build_bvh(soup);
    moved->build_seconds = cpu_seconds() - start;
    moved->sets = make_ray_sets(moved->scene, *moved->bvh, size);
#ifdef VELATURA_HAVE_EMBREE
    if (with_peer) moved->embree = std::make_unique<EmbreePeer>(soup, EmbreeMode::RobustMedium);
#else
    (void)with_peer;
#endif
    return moved;
}

Contestant own(const std::string& name, const Moved& moved) {
    Contestant c{name, moved.build_seconds, double(moved.bvh->stats().bytes), &moved.sets, {}};
    auto streams = std::make_shared<std::map<std::string, accel::RayStream, std::less<>>>();
    c.trace = [&moved, streams](const RaySet& set) {
        constexpr size_t batch = 4096;
        static std::vector<geometry::Hit> hits(batch);
        static std::vector<uint8_t> occluded(batch);
        accel::RayStream& stream = streams->try_emplace(set.kind, *moved.bvh).first->second;
        size_t count = 0;
        for (size_t i = 0; i < set.rays.size(); i += batch) {
            const auto some = std::span(set.rays).subspan(i, std::min(batch, set.rays.size() - i));
            if (set.is_any_hit) {
                stream.is_occluded(some, occluded);
                for (size_t k = 0; k < some.size(); ++k) count += occluded[k];
            } else {
                stream.intersect(some, hits);
                for (size_t k = 0; k < some.size(); ++k) count += hits[k].is_valid();
            }
        }
        return count;
    };
    return c;
}

#ifdef VELATURA_HAVE_EMBREE
Contestant peer(const std::string& name, const Moved& moved) {
    const EmbreePeer& embree = *moved.embree;
    Contestant c{name, embree.build_seconds(), double(embree.tree_bytes()), &moved.sets, {}};
    c.trace = [&embree](const RaySet& set) {
        size_t count = 0;
        if (set.is_any_hit) {
            for (const geometry::Ray& ray : set.rays) count += embree.is_occluded(ray);
        } else {
            for (const geometry::Ray& ray : set.rays)
                count += embree.closest(ray) < std::numeric_limits<float>::infinity();
        }
        return count;
    };
    return c;
}
#endif

double median(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
}

// Seconds per ray in each round, [contestant][round], in turns that begin with another one each
// round; hits of the last one.
std::vector<std::vector<double>> times_of(const std::vector<Contestant>& all,
                                          size_t set,
                                          int rounds,
                                          std::vector<size_t>& hits) {
    std::vector<std::vector<double>> times(all.size());
    hits.assign(all.size(), 0);
    // Warm up; streams choose by their first batches
    for (const Contestant& c : all)
        for (int i = 0; i < 3; ++i) c.trace((*c.sets)[set]);
    for (size_t round = 0; round < size_t(rounds); ++round) {
        for (size_t k = 0; k < all.size(); ++k) {
            const size_t turn = (round + k) % all.size();
            const RaySet& rays = (*all[turn].sets)[set];
            const double start = thread_seconds();
            hits[turn] = all[turn].trace(rays);
            times[turn].push_back((thread_seconds() - start) / double(rays.rays.size()));
        }
    }
    return times;
}

void run_scene(const SceneMaker& maker, const Settings& settings, std::vector<double>& log_ratios) {
    const ThreadLimit one(1);
    const BenchScene scene = maker.make();
    const double triangles = double(scene.triangle_count());
    std::vector<std::unique_ptr<Moved>> all;
    BenchScene still = scene;
    stop(still, settings.amount);
    all.push_back(make_moved(still, settings.size, true));
    close_shutter(still.direct);
    all.push_back(make_moved(std::move(still), settings.size, false));
    for (const uint32_t segments : settings.segments) {
        BenchScene moving = scene;
        move(moving, segments, settings.amount);
        all.push_back(make_moved(std::move(moving), settings.size, true));
    }
    const auto name_of = [&](size_t i) {
        if (i == 0) return std::string("static");
        return i == 1 ? std::string("closed") : fmt::format("{} seg", settings.segments[i - 2]);
    };
    std::vector<Contestant> contestants;
    for (size_t i = 0; i < all.size(); ++i) contestants.push_back(own(name_of(i), *all[i]));
#ifdef VELATURA_HAVE_EMBREE
    for (size_t i = 0; i < all.size(); ++i)
        if (all[i]->embree) contestants.push_back(peer("E " + name_of(i), *all[i]));
#endif
    fmt::print("\n{}: {:.2f} M triangles\n  {:14}", maker.name, triangles * 1e-6, "");
    for (const Contestant& c : contestants) fmt::print(" {:>8}", c.name);
    fmt::print("\n  {:14}", "build CPU s");
    for (const Contestant& c : contestants) fmt::print(" {:8.2f}", c.build_seconds);
    fmt::print("\n  {:14}", "bytes/triangle");
    for (const Contestant& c : contestants) fmt::print(" {:8.1f}", c.bytes / triangles);
    fmt::print("\n");
    for (size_t set = 0; set < all[0]->sets.size(); ++set) {
        if (all[0]->sets[set].rays.empty()) continue;
        std::vector<size_t> hits;
        const auto times = times_of(contestants, set, settings.rounds, hits);
        fmt::print("  {:8} Mrays/s", all[0]->sets[set].kind);
        for (const auto& t : times) fmt::print(" {:8.2f}", 1e-6 / median(t));
        fmt::print("\n  {:8} /static", "");
        const size_t own_count = all.size();
        for (size_t k = 0; k < times.size(); ++k) {
            const auto& base = times[k < own_count ? 0 : own_count];
            std::vector<double> ratios;
            for (size_t i = 0; i < base.size(); ++i) ratios.push_back(base[i] / times[k][i]);
            fmt::print(" {:8.2f}", median(ratios));
            log_ratios.resize(std::max(log_ratios.size(), 2 * own_count + 1));
            log_ratios[k] += std::log(median(ratios));
        }
        log_ratios.back() += 1;
        fmt::print("\n");
        std::fflush(stdout);
    }
}

void run(const Settings& settings) {
    fmt::print(
        "What motion costs ({} kernels). Meshes deform as a whole, by 2 % of the scene's size, "
        "over\n"
        "1, 2, 4 segments; every path has a time of its own. closed: keys that are all alike. E: "
        "Embree,\n"
        "robust, medium quality. Own rays go one by one or side by side, as their stream chooses.\n"
        "One thread, CPU time, {} rounds in turns: medians; /static: medians of the rounds' "
        "ratios.\n",
        accel::best_kernels().name, settings.rounds);
    std::vector<double> log_ratios;
    for (const SceneMaker& maker : all_scenes()) {
        if (std::find(settings.scenes.begin(), settings.scenes.end(), maker.name) !=
            settings.scenes.end())
            run_scene(maker, settings, log_ratios);
    }
    if (log_ratios.empty()) return;
    fmt::print("\ngeomean of /static");
    for (size_t i = 0; i + 1 < log_ratios.size(); ++i)
        fmt::print(" {:.3f}", std::exp(log_ratios[i] / log_ratios.back()));
    fmt::print("\n");
}

}  // namespace
}  // namespace velatura::bench

int main(int argc, char** argv) {
    using namespace velatura::bench;
    velatura::CommandLine app("What motion costs rays, beside Embree's");
    Settings settings;
    add_scene_options(app, settings.scenes, settings.size, settings.rounds);
    app.add_option("--amount", settings.amount, "of motion, in 2 % of the scene's size");
    app.add_option("--segments", settings.segments, "of the motion").allow_extra_args(true);
    if (const auto code = velatura::bench::parse_options(app, argc, argv)) return *code;
    settings.size = settings.size / 16 * 16;
    run(settings);
}
