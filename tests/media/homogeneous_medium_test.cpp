// SPDX-License-Identifier: Apache-2.0
// Ways through matter that is the same everywhere, against e^(−σd).
#include "media/homogeneous_medium.h"

#include "grid_fixtures.h"
#include "media/volume_set.h"

#include <gtest/gtest.h>

#include <cmath>

namespace velatura::media {
namespace {

using sampling::RandomStream;
using testing::add_field;
using testing::add_volume;
using testing::constant_box;

const scene::MediumProperties colored{Rgb(0.3f, 0.0f, 2.0f), Rgb(0.5f, 0.2f, 3.0f), 0.4f};
const scene::MediumProperties lossless_in_red{Rgb(0.0f), Rgb(0.0f, 0.5f, 4.0f), 0.0f};

/// Means of what arrives at the end of a way of this length, and of what collides on it.
struct Means {
    Vec3d arrived = Vec3d(0.0), collided = Vec3d(0.0);
    double largest_sum = 0.0;  ///< that a path of the sum 1 goes on with
};

Means means_of(const scene::MediumProperties& interior, const Rgb& carried, float length) {
    constexpr int ways = 1 << 16;
    const HomogeneousMedium medium(interior);
    Means means;
    for (uint64_t i = 0; i < ways; ++i) {
        const FreePath way = medium.draw(carried, RandomStream(mix64(i), (double(i) + 0.5) / ways));
        const bool collides = way.end < length;
        const Rgb weight = carried * (collides ? way.weight_of_collision() : way.weight_at(length));
        (collides ? means.collided : means.arrived) += Vec3d(weight) / ways;
        means.largest_sum = std::max(means.largest_sum, double(weight.x + weight.y + weight.z));
    }
    return means;
}

TEST(HomogeneousMedium, WeighsWhatArrivesAndWhatCollides) {
    for (const scene::MediumProperties& interior : {colored, lossless_in_red}) {
        for (const Rgb& carried : {Rgb(0.2f, 0.5f, 0.3f), Rgb(0.7f, 0.3f, 0.0f)}) {
            for (const float length : {0.05f, 1.0f, 4.0f}) {
                const Means means = means_of(interior, carried, length);
                for (int c = 0; c < 3; ++c) {
                    const double sigma = double(interior.absorption[c] + interior.scattering[c]);
                    const double left = std::exp(-sigma * double(length));
                    EXPECT_NEAR(means.arrived[c], double(carried[c]) * left, 4e-3);
                    EXPECT_NEAR(means.collided[c], double(carried[c]) * (1 - left), 4e-3);
                }
                // No path gets brighter than it was
                EXPECT_LE(means.largest_sum, 1.0 + 1e-5);
            }
        }
    }
}

TEST(HomogeneousMedium, IsExactWhereChannelsAreAlike) {
    const HomogeneousMedium fog({Rgb(0.0f), Rgb(2.0f), 0.0f});
    EXPECT_EQ(fog.albedo(), Rgb(1.0f));
    const FreePath way = fog.draw(Rgb(0.1f, 0.7f, 0.3f), RandomStream(1, 0.5));
    EXPECT_NEAR(way.end, std::log(2.0) / 2, 1e-6);
    EXPECT_EQ(way.weight_at(0.5f * way.end), Rgb(1.0f));
    EXPECT_EQ(way.weight_of_collision(), Rgb(1.0f));
}

TEST(HomogeneousMedium, StaysFiniteHoweverThick) {
    constexpr float infinite = std::numeric_limits<float>::infinity();
    const HomogeneousMedium medium({Rgb(0.0f, 0.0f, 1e12f), Rgb(1e-12f, 1e5f, 1.0f), 0.9f});
    for (uint64_t i = 0; i < 4096; ++i) {
        const FreePath way = medium.draw(Rgb(1.0f), RandomStream(i, -1.0));
        for (const Rgb& w :
             {way.weight_at(way.end), way.weight_of_collision(), way.weight_at(0.0f)})
            for (int c = 0; c < 3; ++c) EXPECT_TRUE(w[c] >= 0.0f && w[c] <= 3.001f) << w[c];
    }
    const FreePath clear{.extinction = Rgb(0.0f, 1.0f, infinite)};
    EXPECT_EQ(clear.weight_at(infinite), Rgb(1.0f, 0.0f, 0.0f));
    EXPECT_EQ(clear.weight_at(0.0f), Rgb(1.0f));
}

// What glows within the way is dimmed by it: ε/σ·(1 − e^−σd)
TEST(HomogeneousMedium, DimsWhatGlowsOnTheWay) {
    scene::Scene scene;
    scene::Volume& glow = add_volume(scene, constant_box(Vec3d(-1, -1, 0), Vec3d(1, 1, 2), 0.0f));
    glow.emission = add_field(scene, constant_box(Vec3d(-1, -1, 0), Vec3d(1, 1, 2), 0.25f));
    scene.volumes[0].optics.emission = Rgb(1.0f);
    const VolumeSet set(scene);
    const HomogeneousMedium medium(colored);
    TrackingCounts counts;
    Flight flight;
    Vec3d mean(0.0);
    constexpr int ways = 1 << 16;
    for (uint64_t i = 0; i < ways; ++i) {
        const FreePath around =
            medium.draw(Rgb(1.0f), RandomStream(mix64(i), (double(i) + 0.5) / ways));
        set.fly(Vec3(0, 0, 2.5f), Vec3(0, 0, -1), 9.0f, Rgb(1.0f), around,
                RandomStream(mix64(i + ways), -1.0), flight, counts);
        mean += Vec3d(flight.emitted) / ways;
    }
    for (int c = 0; c < 3; ++c) {
        const double s = double(colored.absorption[c] + colored.scattering[c]);
        const double expected = 0.25 * std::exp(-0.5 * s) * (1 - std::exp(-2 * s)) / s;
        EXPECT_NEAR(mean[c], expected, 0.02 * expected);
    }
}

}  // namespace
}  // namespace velatura::media
