// SPDX-License-Identifier: Apache-2.0
// Rays aimed at edges and vertices of closed meshes, which must all stay inside, and rays whose hit
// must be the one that testing every triangle finds, bit for bit. All counts must be 0; any other
// ends the program with code 1. The commit tests do the same with fewer rays (tests/hardcases).
#include "accel/bvh.h"
#include "accel/traverse.h"
#include "base/tasks.h"
#include "brute_force.h"
#include "compare.h"
#include "cpu_clock.h"
#include "leaks.h"
#include "parse_options.h"
#include "soups.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdio>

namespace velatura::bench {
namespace {

using namespace accel::test;

constexpr size_t chunk = 100000;

// Adds up body(chunk index, rays in it) over all chunks, on all threads.
template <class Count, class Body>
Count sum_chunks(size_t rays, const Body& body) {
    std::vector<Count> counts((rays + chunk - 1) / chunk);
    parallel_for(counts.size(),
                 [&](size_t i) { counts[i] = body(i, std::min(chunk, rays - i * chunk)); });
    Count sum;
    for (const Count& count : counts) sum += count;
    return sum;
}

// Returns: how many went wrong.
size_t shoot_at_edges(size_t rays) {
    std::vector<ClosedMesh> meshes = closed_meshes();
    meshes.push_back(
        {"sphere, 2 M", star_mesh(1000, 1000, 1, 0, Vec3d(0), 9), Vec3(0), Mat4(), true});
    fmt::print("rays at vertices and edges, from inside\n  {:18} {:>11} {:>7} {:>7} {:>7}\n",
               "mesh", "rays", "missed", "passed", "unseen");
    LeakCount all;
    for (size_t m = 0; m < meshes.size(); ++m) {
        const ClosedMesh& mesh = meshes[m];
        const auto bvh = accel::build_bvh(mesh.scene());
        const size_t share = rays * (m + 1) / meshes.size() - rays * m / meshes.size();
        const LeakCount count = sum_chunks<LeakCount>(
            share, [&](size_t i, size_t n) { return count_leaks(*bvh, mesh, n, m << 32 | i); });
        fmt::print("  {:18} {:11} {:7} {:7} {:7}\n", mesh.name, count.rays, count.misses,
                   count.passed, count.unseen);
        std::fflush(stdout);
        all += count;
    }
    fmt::print("  {:18} {:11} {:7} {:7} {:7}\n", "all", all.rays, all.misses, all.passed,
               all.unseen);
    return all.misses + all.passed + all.unseen;
}

struct SmallScene {
    const char* name;
    std::vector<Soup> soups;
    std::vector<Mat4> instances = {};

    accel::SoupScene scene() const {
        accel::SoupScene scene;
        for (const Soup& soup : soups) scene.shapes.push_back(soup.view());
        if (!instances.empty()) scene.prototypes = {scene.shapes};
        for (const Mat4& m : instances) scene.instances.push_back({0, m});
        return scene;
    }
};

std::vector<SmallScene> small_scenes() {
    std::vector<Mat4> placements;
    Random random(1);
    for (int i = 0; i < 4; ++i) {
        Mat4d scale, turn;
        scale.setScale(Vec3d(i % 2 ? 0.5 : -0.7, 0.01 + 0.2 * i, 0.4));
        turn.setAxisAngle(Vec3d(random.direction()), double(i));
        placements.emplace_back(scale * turn);
    }
    return {{"random", {random_soup(60, 0.5f, 2)}},
            {"needles", {needles(30, 1e2f, 3), needles(30, 1e6f, 4)}},
            {"flat boxes", {flat_triangles(40, 5), box(Vec3(-1), Vec3(1))}},
            {"instances", {random_soup(10, 0.8f, 6), box(Vec3(-0.5f), Vec3(0.5f))}, placements}};
}

size_t compare_with_brute_force(size_t rays) {
    struct Sum : Agreement {
        void operator+=(const Agreement& other) {
            this->rays += other.rays;
            hits += other.hits;
            different += other.different;
            different_occlusion += other.different_occlusion;
        }
    };

    fmt::print("rays against every triangle tested\n  {:18} {:>11} {:>7} {:>7} {:>8}\n", "scene",
               "rays", "hit %", "differ", "occluded");
    const std::vector<SmallScene> scenes = small_scenes();
    Sum all;
    for (size_t s = 0; s < scenes.size(); ++s) {
        const accel::SoupScene scene = scenes[s].scene();
        const auto bvh = accel::build_bvh(scene);
        const BruteForce brute(scene);
        const size_t share = rays * (s + 1) / scenes.size() - rays * s / scenes.size();
        const Sum count = sum_chunks<Sum>(share, [&](size_t i, size_t n) {
            Sum part;
            part += compare(*bvh, brute, mixed_rays(n, s << 32 | i));
            return part;
        });
        fmt::print("  {:18} {:11} {:7.1f} {:7} {:8}\n", scenes[s].name, count.rays,
                   100.0 * double(count.hits) / double(std::max<size_t>(count.rays, 1)),
                   count.different, count.different_occlusion);
        std::fflush(stdout);
        all += count;
    }
    fmt::print("  {:18} {:11} {:7.1f} {:7} {:8}\n", "all", all.rays,
               100.0 * double(all.hits) / double(std::max<size_t>(all.rays, 1)), all.different,
               all.different_occlusion);
    return all.different + all.different_occlusion;
}

}  // namespace
}  // namespace velatura::bench

int main(int argc, char** argv) {
    using namespace velatura::bench;
    velatura::CommandLine app("Shoots at edges and vertices; every count must be 0");
    size_t rays = 100'000'000;
    app.add_option("rays", rays, "rays at edges and vertices; a tenth as many against brute force")
        .range(size_t(10), size_t(1) << 40);
    if (const auto code = velatura::bench::parse_options(app, argc, argv)) return *code;
    fmt::print("{} kernels, {} threads\n", velatura::accel::best_kernels().name,
               velatura::thread_count());
    const double start = cpu_seconds();
    const size_t wrong = shoot_at_edges(rays) + compare_with_brute_force(rays / 10);
    fmt::print("{} wrong, {:.0f} CPU s\n", wrong, cpu_seconds() - start);
    return wrong == 0 ? 0 : 1;
}
