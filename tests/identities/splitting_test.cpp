// SPDX-License-Identifier: Apache-2.0
// An image whose paths divide is the same image with other noise, layer by layer, and one
// image however it is made.
#include "base/tasks.h"
#include "integrator/splitting_trial.h"
#include "integrator/world.h"
#include "usd_render.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>

namespace velatura::test {

namespace {

integrator::RenderOptions options_of(uint64_t samples, uint64_t seed = 3) {
    integrator::RenderOptions options;
    options.end_sample = samples;
    options.seed = seed;
    options.tile_size = 16;
    return options;
}

/// A small lamp behind the camera and a wall that is lit by it alone, or also by the room around
/// them.
std::string wall_usda(bool is_room) {
    const std::string room = R"usda(
def Sphere "Room" {
    double radius = 6
    color3f[] primvars:displayColor = [(0.5, 0.5, 0.5)]
}
)usda";
    return R"usda(#usda 1.0
( upAxis = "Y" )
def Camera "Cam" {
    float focalLength = 30
    float2 clippingRange = (0, 0)
    double3 xformOp:translate = (0, 0, 3)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def Mesh "Wall" {
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(-9, -9, -1), (9, -9, -1), (9, 9, -1), (-9, 9, -1)]
    uniform token subdivisionScheme = "none"
    color3f[] primvars:displayColor = [(0.5, 0.5, 0.5)]
}
def SphereLight "Lamp" {
    float inputs:intensity = 2000
    float inputs:radius = 0.03
    double3 xformOp:translate = (0, 1.5, 3.5)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
)usda" + (is_room ? room : "");
}

integrator::SplittingTrial trial_of(const scene::Scene& scene,
                                    int threads = 0,
                                    std::optional<film::Window> window = {}) {
    const ThreadLimit limit(threads);
    Diagnostics diagnostics;
    const integrator::World world(
        scene, {.width = scene.settings.width, .height = scene.settings.height}, {}, diagnostics);
    return integrator::try_splitting(
        world, {.seed = 1},
        window.value_or(film::Window{0, 0, scene.settings.width, scene.settings.height}));
}

}  // namespace

TEST(Splitting, IntoOneBranchChangesNoBit) {
    const scene::Scene scene = scene_from_usda(room_usda(), 24, 20);
    EXPECT_NE(fingerprint(render_scene(scene, options_of(8), {.branches = 1})),
              fingerprint(render_scene(scene, options_of(8), {.branches = 2})));
    Diagnostics diagnostics;
    EXPECT_EQ(fingerprint(render_scene(scene, options_of(8), {.branches = 1})),
              fingerprint(render_scene(scene, options_of(8))));
}

// Every accumulator of the film: bounces, groups, their cells, unoccluded light, halves.
TEST(Splitting, KeepsTheMeanOfEveryLayer) {
    const scene::Scene scene = scene_from_usda(room_usda(), 20, 16);
    constexpr int runs = 24;

    struct Sums {
        std::vector<double> sum, squares;
    };

    const auto measure = [&](uint32_t branches, uint64_t first_seed) {
        Sums sums;
        for (int run = 0; run < runs; ++run) {
            const film::Film film = render_scene(scene, options_of(16, first_seed + uint64_t(run)),
                                                 {.branches = branches});
            const uint32_t count = film.sums().table().total_count();
            sums.sum.resize(count);
            sums.squares.resize(count);
            for (uint32_t a = 0; a < count; ++a) {
                double total = 0;
                for (int y = 0; y < 16; ++y) {
                    for (int x = 0; x < 20; ++x) {
                        const accumulate::Triple t = film.sums().total(x, y, a);
                        total += t.x + t.y + t.z;
                    }
                }
                sums.sum[a] += total;
                sums.squares[a] += total * total;
            }
        }
        return sums;
    };
    const Sums one = measure(1, 100), four = measure(4, 200);
    double largest = 0, widest = 0, worst_z = 0;
    for (size_t a = 0; a < one.sum.size(); ++a) {
        const double mean_1 = one.sum[a] / runs, mean_4 = four.sum[a] / runs;
        const double variance =
            (one.squares[a] / runs - mean_1 * mean_1 + four.squares[a] / runs - mean_4 * mean_4) /
            (runs - 1);
        if (!(variance > 0)) {
            EXPECT_DOUBLE_EQ(mean_1, mean_4);
            continue;
        }
        const double z = (mean_4 - mean_1) / std::sqrt(variance);
        EXPECT_LT(std::abs(z), 5.0) << "accumulator " << a;
        worst_z = std::max(worst_z, std::abs(z));
        largest = std::max(largest, mean_1);
        widest = std::max(widest, 5 * std::sqrt(variance));
    }
    std::printf("%zu accumulators, worst |z| %.2f, detectable %.2f %% of the brightest\n",
                one.sum.size(), worst_z, 100 * widest / largest);
}

TEST(Splitting, TilesThreadsPartsAndCropsGiveTheSameBits) {
    const scene::Scene scene = scene_from_usda(room_usda(), 40, 34);
    RenderSetup setup{.threads = 1, .branches = 0};
    const film::Film whole = render_scene(scene, options_of(24), setup);
    integrator::RenderOptions tiles = options_of(24);
    tiles.mode = integrator::RenderMode::Tile;
    tiles.tile_size = 64;
    setup.threads = 3;
    EXPECT_EQ(fingerprint(render_scene(scene, tiles, setup)), fingerprint(whole));
    setup.sample_splits = {5, 16};
    EXPECT_EQ(fingerprint(render_scene(scene, tiles, setup)), fingerprint(whole));
    setup.window = film::Window{7, 5, 31, 29};
    const film::Film crop = render_scene(scene, tiles, setup);
    for (int y = 5; y < 29; ++y) {
        for (int x = 7; x < 31; ++x) {
            for (uint32_t a = 0; a < whole.sums().table().total_count(); ++a) {
                const accumulate::Triple p = crop.sums().total(x, y, a),
                                         q = whole.sums().total(x, y, a);
                ASSERT_TRUE(p.x == q.x && p.y == q.y && p.z == q.z);
            }
        }
    }
}

// The trial of a part is that of the whole there, and costs as much as the part.
TEST(Splitting, IsTriedNearWhatIsRenderedAlone) {
    const scene::Scene scene = scene_from_usda(room_usda(), 150, 110);
    const integrator::SplittingTrial whole = trial_of(scene);
    EXPECT_GT(whole.map.mean(), 1.1);
    for (const film::Window& window :
         {film::Window{70, 50, 75, 85}, film::Window{0, 0, 1, 1}, film::Window{149, 109, 150, 110},
          film::Window{-30, 100, 9, 200}}) {
        const integrator::SplittingTrial part = trial_of(scene, 0, window);
        EXPECT_LT(part.rays.paths, whole.rays.paths / 3);
        double sum = 0;
        for (int y = window.y0; y < window.y1; ++y) {
            for (int x = window.x0; x < window.x1; ++x) {
                ASSERT_EQ(part.map.at(x, y), whole.map.at(x, y)) << x << " " << y;
                sum += part.map.at(x, y);
            }
        }
        EXPECT_GE(sum, 1);
    }
}

// Overscan: pixels beside the image divide like the nearest ones in it.
TEST(Splitting, GoesOnBesideTheImage) {
    const integrator::SplittingMap map(2, {1, 2, 4, 2, 4, 1});
    for (int y = -40; y < 80; ++y) {
        for (int x = -40; x < 80; ++x)
            ASSERT_EQ(map.at(x, y), map.at(std::clamp(x, 0, 31), std::clamp(y, 0, 47)))
                << x << " " << y;
    }
    EXPECT_EQ(integrator::SplittingMap(2).at(-100, 1000), 2u);
    const scene::Scene scene = scene_from_usda(room_usda(), 20, 16);
    const film::Film film = render_scene(scene, options_of(2),
                                         {.window = film::Window{-70, -60, 90, 70}, .branches = 0});
    EXPECT_EQ(film.sums().total(-60, 0, accumulate::AccumulatorTable::coverage).z, 2.0);
}

TEST(Splitting, IsChosenWhereIndirectLightMakesTheNoise) {
    const integrator::SplittingTrial alone = trial_of(scene_from_usda(wall_usda(false), 64, 48)),
                                     room = trial_of(scene_from_usda(wall_usda(true), 64, 48));
    std::printf("mean branches: wall %.2f, room %.2f\n", alone.map.mean(), room.map.mean());
    EXPECT_LT(alone.map.mean(), 1.5);
    EXPECT_GT(room.map.mean(), 1.9);
    EXPECT_EQ(trial_of(scene_from_usda(wall_usda(true), 64, 48), 3).map.mean(), room.map.mean());
}

// Without any noise there is nothing to gain
TEST(Splitting, IsLeftWhereNothingIsNoisy) {
    std::string dark = wall_usda(true);
    dark.replace(dark.find("intensity = 2000"), 16, "intensity = 0   ");
    EXPECT_EQ(trial_of(scene_from_usda(dark, 64, 48)).map.mean(), 1.0);
}

TEST(Splitting, LowersTheErrorForItsTime) {
    // Of a room, by rays: the time of a machine at hand is no matter of tests
    const scene::Scene scene = scene_from_usda(wall_usda(true), 32, 24);
    const auto relative_variance = [&](uint32_t branches) {
        constexpr int runs = 16;
        std::vector<double> sum, squares;
        for (int run = 0; run < runs; ++run) {
            const std::vector<double> image =
                beauty(render_scene(scene, options_of(16, uint64_t(run)), {.branches = branches}));
            sum.resize(image.size());
            squares.resize(image.size());
            for (size_t i = 0; i < image.size(); ++i) {
                sum[i] += image[i] / runs;
                squares[i] += image[i] * image[i] / runs;
            }
        }
        double total = 0;
        for (size_t i = 0; i < sum.size(); ++i)
            total += (squares[i] - sum[i] * sum[i]) / (sum[i] * sum[i] + 0.01);
        return total;
    };
    // Four branches cost less than four times as much
    const double gain = relative_variance(1) / relative_variance(4);
    std::printf("four branches: error x %.2f\n", 1 / gain);
    EXPECT_GT(gain, 3.0);
}

}  // namespace velatura::test
