// SPDX-License-Identifier: Apache-2.0
// What degenerate input costs: time to build and to trace scenes of docs/engineering/hard_cases.md
// H07 and H09 … H12, against ordinary scenes with as many triangles that count. No ratio should be
// above 3. That the hits are right is shown by tests/hardcases.
#include "accel/bvh.h"
#include "base/tasks.h"
#include "cpu_clock.h"
#include "parse_options.h"
#include "soups.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

namespace velatura::bench {
namespace {

using namespace accel::test;
using geometry::Ray;

constexpr float nan = std::numeric_limits<float>::quiet_NaN();
constexpr float inf = std::numeric_limits<float>::infinity();
constexpr double limit = 3;

// A scene that owns its triangles, and rays for it.
struct Input {
    Soup soup;
    std::vector<Mat4> instances;  ///< none = the soup is placed directly
    std::vector<Ray> rays;

    accel::SoupScene scene() const {
        accel::SoupScene scene;
        if (instances.empty()) {
            scene.shapes.push_back(soup.view());
        } else {
            scene.prototypes.push_back({soup.view()});
        }
        for (const Mat4& m : instances) scene.instances.push_back({0, m});
        return scene;
    }
};

struct Times {
    double build = 0, trace = 0;
    size_t hits = 0, triangles = 0;
};

double median(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
}

Times measure_once(const Input& input) {
    Times times;
    const accel::SoupScene scene = input.scene();
    double start = cpu_seconds();
    const auto bvh = accel::build_bvh(scene);
    times.build = cpu_seconds() - start;
    times.triangles = bvh->stats().triangles;
    start = thread_seconds();
    for (const Ray& ray : input.rays) {
        times.hits += bvh->intersect(ray).is_valid();
        times.hits += bvh->is_occluded(ray);
    }
    times.trace = thread_seconds() - start;
    return times;
}

class Table {
  public:
    explicit Table(int rounds) : rounds_(rounds) {
        fmt::print("{:44} {:>10} {:>8} {:>8} {:>8} {:>8}\n", "degenerate / ordinary", "triangles",
                   "build", "trace", "build s", "trace s");
    }

    // Both in turns; medians of the rounds' ratios.
    void add(const char* name, const Input& degenerate, const Input& ordinary) {
        std::vector<double> build, trace;
        Times a;
        for (int round = 0; round < rounds_; ++round) {
            a = measure_once(degenerate);
            const Times b = measure_once(ordinary);
            build.push_back(a.build / b.build);
            trace.push_back(a.trace / double(degenerate.rays.size()) /
                            (b.trace / double(ordinary.rays.size())));
        }
        const double worst = std::max(median(build), median(trace));
        fmt::print("{:44} {:10} {:8.2f} {:8.2f} {:8.2f} {:8.2f}{}\n", name, a.triangles,
                   median(build), median(trace), a.build, a.trace, worst > limit ? "  over" : "");
        std::fflush(stdout);
        over_ += worst > limit;
    }

    int over() const { return over_; }

  private:
    int rounds_;
    int over_ = 0;
};

std::vector<Ray> rays_at(const Vec3& half, size_t count) {
    Random random(2);
    std::vector<Ray> rays;
    for (size_t i = 0; i < count; ++i) {
        const Vec3 o = random.in_cube(2), to = random.in_cube(1);
        rays.push_back({o * half, (to - o) * half});
    }
    return rays;
}

constexpr size_t ray_count = 200000;

Input ordinary(size_t triangles) {
    return {random_soup(triangles, 1.0f / std::cbrt(float(triangles)), 1),
            {},
            rays_at(Vec3(1), ray_count)};
}

// As the ordinary one, with `bad(random)` triangles after its own.
Input with_bad(Input input, size_t count, const std::function<void(Soup&, Random&)>& bad) {
    Random random(3);
    for (size_t i = 0; i < count; ++i) bad(input.soup, random);
    return input;
}

// n triangles, each one of `kinds` orders of the same three corners.
Input coincident(size_t n, size_t kinds) {
    Input input;
    input.soup.positions = {Vec3(-1, -1, 0.3f), Vec3(1, -1, -0.2f), Vec3(0, 1, 0.1f)};
    const std::array<uint32_t, 3> orders[] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1},
                                              {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};
    for (size_t i = 0; i < n; ++i) input.soup.triangles.push_back(orders[i % kinds]);
    input.rays = rays_at(Vec3(1), ray_count);
    return input;
}

// Every triangle of the ordinary soup `copies` times.
Input duplicated(Input input, size_t copies) {
    const auto triangles = input.soup.triangles;
    for (size_t i = 1; i < copies; ++i)
        input.soup.triangles.insert(input.soup.triangles.end(), triangles.begin(), triangles.end());
    return input;
}

// All in one plane, every point of which lies in some eight triangles: which of them a ray meets is
// decided by their order.
Input coplanar(size_t n) {
    Input input = ordinary(n);
    Random random(4);
    const float size = 12.0f / std::sqrt(float(n));
    input.soup = {};
    for (size_t i = 0; i < n; ++i) {
        Vec3 p[3];
        p[0] = random.in_cube(1);
        for (int k = 1; k < 3; ++k) p[k] = p[0] + random.in_cube(size);
        for (Vec3& v : p) v.z = 0.5f;
        input.soup.add(p[0], p[1], p[2]);
    }
    return input;
}

// Two grids of triangles, top and bottom of a slab, seen from above.
Input slab(const Vec3& half, size_t side) {
    Input input;
    for (const float z : {-1.0f, 1.0f}) {
        const auto first = uint32_t(input.soup.positions.size());
        for (size_t i = 0; i <= side; ++i) {
            for (size_t j = 0; j <= side; ++j) {
                const float x = 2 * float(i) / float(side) - 1, y = 2 * float(j) / float(side) - 1;
                input.soup.positions.push_back(Vec3(x, y, z) * half);
            }
        }
        for (size_t i = 0; i < side; ++i) {
            for (size_t j = 0; j < side; ++j) {
                const auto at = first + uint32_t(i * (side + 1) + j), up = at + uint32_t(side + 1);
                input.soup.triangles.push_back({at, up, at + 1});
                input.soup.triangles.push_back({at + 1, up, up + 1});
            }
        }
    }
    // From above: rays that graze a slab meet most of it, in any tree
    Random random(6);
    for (size_t i = 0; i < ray_count; ++i) {
        const Vec3 o = random.in_cube(1) * half, to = random.in_cube(1) * half;
        const Vec3 from(o.x, o.y, random.between(1, 3) * half.x);
        input.rays.push_back({from, Vec3(to.x, to.y, half.z) - from});
    }
    return input;
}

// Instances of a soup, each placed by place(i, random).
Input instances(size_t n, const std::function<Mat4(size_t, Random&)>& place) {
    Input input = ordinary(1000);
    Random random(5);
    for (size_t i = 0; i < n; ++i) input.instances.push_back(place(i, random));
    return input;
}

Mat4 placement(Random& random, const Vec3d& size) {
    Mat4d scale, turn, move;
    scale.setScale(size);
    turn.setAxisAngle(Vec3d(random.direction()), double(random.between(0, 6)));
    move.setTranslation(Vec3d(random.in_cube(1)));
    return Mat4(scale * turn * move);
}

void run(Table& table, size_t n) {
    table.add("H07 slab of 5.9e11 x 1.2e5 / of 2 x 2 x 2",
              slab(Vec3(2.95e11f, 2.95e11f, 6e4f), size_t(std::sqrt(double(n) / 4))),
              slab(Vec3(1), size_t(std::sqrt(double(n) / 4))));
    const auto good = [](size_t, Random& random) { return placement(random, Vec3d(0.02)); };
    const size_t placed = n / 10;
    table.add("H09 as many singular or NaN instances more",
              instances(2 * placed,
                        [&](size_t i, Random& random) {
                            Mat4 m = placement(random, Vec3d(0.02));
                            if (i % 4 == 1) m[0][0] = m[0][1] = m[0][2] = 0;
                            if (i % 4 == 3) m[3][1] = nan;
                            return m;
                        }),
              instances(placed, good));
    table.add("H09 instances flattened 1e4 times",
              instances(placed,
                        [](size_t, Random& random) {
                            return placement(random, Vec3d(0.02, 0.02, 2e-6));
                        }),
              instances(placed, good));
    const Input plain = ordinary(n);
    table.add("H10 as many triangles without area more",
              with_bad(plain, n,
                       [](Soup& soup, Random& random) {
                           const Vec3 a = random.in_cube(1), b = random.in_cube(1);
                           soup.add(a, b, b);
                       }),
              plain);
    table.add("H10 as many NaN and infinite triangles more",
              with_bad(plain, n,
                       [](Soup& soup, Random& random) {
                           const Vec3 a = random.in_cube(1);
                           soup.add(a, Vec3(random.below(2) ? nan : inf, 0, 0), a * 0.5f);
                       }),
              plain);
    Input nan_rays = plain;
    for (size_t i = 0; i < nan_rays.rays.size(); ++i) {
        Ray& ray = nan_rays.rays[i];
        (i % 2 ? ray.o : ray.d)[int(i / 2 % 3)] = i % 4 < 2 ? nan : inf;
    }
    table.add("H10 rays with NaN or infinite components", nan_rays, plain);
    table.add("H11 exact duplicates of one triangle", coincident(n, 1), plain);
    table.add("H11 one triangle, corners in six orders", coincident(n, 6), plain);
    table.add("H11 1000 copies of each of n/1000 triangles", duplicated(ordinary(n / 1000), 1000),
              plain);
    table.add("H11 4 copies of each of n/4 triangles", duplicated(ordinary(n / 4), 4), plain);
    table.add("H12 all in one plane, overlapping", coplanar(n), plain);
}

}  // namespace
}  // namespace velatura::bench

int main(int argc, char** argv) {
    using namespace velatura;
    using namespace velatura::bench;
    CommandLine app("Time to build and trace degenerate scenes against ordinary ones");
    size_t triangles = 1'000'000;
    int rounds = 3;
    app.add_option("--triangles", triangles, "of each scene")
        .range(size_t(10000), size_t(100'000'000));
    app.add_option("--rounds", rounds, "how often each is timed").range(1, 99);
    if (const auto code = bench::parse_options(app, argc, argv)) return *code;
    const ThreadLimit one(1);
    Table table(rounds);
    run(table, triangles);
    fmt::print("{} of them over {:g}\n", table.over(), limit);
    return table.over() == 0 ? 0 : 1;
}
