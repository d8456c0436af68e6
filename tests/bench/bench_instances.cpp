// SPDX-License-Identifier: Apache-2.0
// Very many instances of one mesh: time and memory to build, and rays per second. CPU time; the
// memory is what the accelerator holds and what the process grew by at most while it was built.
#include "accel/bvh.h"
#include "base/tasks.h"
#include "bench_shapes.h"
#include "cpu_clock.h"
#include "parse_options.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <cmath>

namespace velatura::bench {
namespace {

double peak_bytes() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return double(usage.ru_maxrss) * 1024.0;
}

// Turned about all axes, no two alike.
Mat4 placement(const Vec3& middle, Random& random) {
    Mat4 m;
    m.rotate(Vec3(random(0.0f, 6.2f), random(0.0f, 6.2f), random(0.0f, 6.2f)));
    const float size = random(0.3f, 0.5f);
    for (int row = 0; row < 3; ++row) {
        for (int k = 0; k < 3; ++k) m[row][k] *= size;
    }
    for (int k = 0; k < 3; ++k) m[3][k] = middle[k];
    return m;
}

// On a jittered grid of unit cells.
std::vector<accel::SoupInstance> scatter(size_t count) {
    Random random(7);
    const auto edge = size_t(std::ceil(std::cbrt(double(count))));
    std::vector<accel::SoupInstance> instances;
    instances.reserve(count);
    for (size_t i = 0; i < count; ++i) {
        const Vec3 cell(float(i % edge), float(i / edge % edge), float(i / edge / edge));
        instances.push_back({0, placement(cell + random.in_cube(0.3f), random)});
    }
    return instances;
}

// Mrays/s of one thread.
double rate_of(const accel::Accelerator& bvh,
               const std::vector<geometry::Ray>& rays,
               double& hit_share) {
    size_t hits = 0;
    const double start = thread_seconds();
    for (const geometry::Ray& ray : rays) hits += bvh.intersect(ray).is_valid();
    const double seconds = thread_seconds() - start;
    hit_share = double(hits) / double(rays.size());
    return double(rays.size()) * 1e-6 / seconds;
}

int run(size_t count, int rings, size_t ray_count) {
    BenchMesh mesh;
    add_blob(mesh, {}, rings);
    accel::SoupScene scene;
    scene.prototypes.push_back({{mesh.positions, mesh.triangles}});
    scene.instances = scatter(count);
    fmt::print("{} instances of {} triangles\n", count, mesh.triangles.size());

    const double before = peak_bytes(), start = cpu_seconds();
    const auto bvh = accel::build_bvh(scene);
    const double seconds = cpu_seconds() - start;
    fmt::print(
        "  build {:.1f} CPU s; holds {:.2f} GB ({:.0f} bytes/instance); grew by {:.2f} GB at "
        "most\n",
        seconds, double(bvh->stats().bytes) * 1e-9, double(bvh->stats().bytes) / double(count),
        (peak_bytes() - before) * 1e-9);

    const Box3 box = bvh->bounds();
    const Vec3 size = box.size(), eye = box.center() - Vec3(0, 0, 0.8f * size.z);
    Random random(3);
    std::vector<geometry::Ray> primary, incoherent;
    const auto edge = int(std::sqrt(double(ray_count)));
    for (int y = 0; y < edge; ++y) {
        for (int x = 0; x < edge; ++x) {
            const Vec3 to(box.min.x + size.x * (float(x) + 0.5f) / float(edge),
                          box.min.y + size.y * (float(y) + 0.5f) / float(edge), box.center().z);
            primary.push_back({eye, (to - eye).normalized()});
        }
    }
    for (size_t i = 0; i < ray_count; ++i) {
        const Vec3 o(random(box.min.x, box.max.x), random(box.min.y, box.max.y),
                     random(box.min.z, box.max.z));
        Vec3 d = random.in_cube(1);
        if (d.dot(d) == 0.0f) d = Vec3(0, 0, 1);
        incoherent.push_back({o, d.normalized()});
    }
    double share = 0;
    const double of_primary = rate_of(*bvh, primary, share);
    fmt::print("  primary rays {:.2f} Mrays/s per core ({:.0f} % hit)\n", of_primary, 100 * share);
    const double of_incoherent = rate_of(*bvh, incoherent, share);
    fmt::print("  incoherent rays {:.2f} Mrays/s per core ({:.0f} % hit)\n", of_incoherent,
               100 * share);
    return 0;
}

}  // namespace
}  // namespace velatura::bench

int main(int argc, char** argv) {
    velatura::CommandLine app("Build time, memory and rays per second of very many instances");
    size_t count = 10000000, rays = 400000;
    int rings = 158;
    app.add_option("--count", count, "instances").range(1, 100000000);
    app.add_option("--rings", rings, "rings of the mesh; it has 4·rings² − 4·rings triangles")
        .range(3, 2000);
    app.add_option("--rays", rays, "rays of each kind").range(100, 100000000);
    if (const auto code = velatura::bench::parse_options(app, argc, argv)) return *code;
    return velatura::bench::run(count, rings, rays);
}
