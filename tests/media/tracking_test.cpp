// SPDX-License-Identifier: Apache-2.0
// Ways of light through matter against closed forms, and two ways to find them against each other
// (H34 to H37).
#include "grid_fixtures.h"
#include "hard_case.h"
#include "media/volume_set.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <string>

namespace velatura::media {
namespace {

using sampling::RandomStream;
using scene::Scene;
using scene::Vec3i;
using scene::VoxelGrid;
using testing::add_field;
using testing::add_volume;
using testing::constant_box;
using testing::make_voxel_grid;

constexpr float far_away = 1e6f;

/// Mean and standard error of three channels.
class Mean {
  public:
    void add(const Rgb& value) {
        ++count_;
        for (int c = 0; c < 3; ++c) {
            sum_[c] += double(value[c]);
            squares_[c] += double(value[c]) * double(value[c]);
        }
    }

    double mean(int c) const { return sum_[c] / double(count_); }

    double error(int c) const {
        return std::sqrt(std::max(squares_[c] / double(count_) - mean(c) * mean(c), 0.0) /
                         double(count_ - 1));
    }

  private:
    uint64_t count_ = 0;
    Vec3d sum_ = Vec3d(0.0), squares_ = Vec3d(0.0);
};

void expect_mean(const Mean& mean,
                 const Rgb& expected,
                 const std::string& what,
                 double relative = 0.02) {
    for (int c = 0; c < 3; ++c) {
        std::printf("%s, channel %d: %.6g, expected %.6g, error %.2g\n", what.c_str(), c,
                    mean.mean(c), double(expected[c]), mean.error(c));
        EXPECT_NEAR(mean.mean(c), double(expected[c]),
                    4.0 * mean.error(c) + 1e-6 * double(expected[c]))
            << what << " " << c;
        if (expected[c] <= 0.0f) continue;
        const double truth = double(expected[c]);
        hardcase::expect_in_hard_case({fmt::format("{}, channel {}, relative", what, c),
                                       std::abs(mean.mean(c) / truth - 1), relative,
                                       5.28 * mean.error(c) / truth, "closed form"});
    }
}

struct Ray {
    Vec3 o, d;
};

/// Transmittance by whether light collides, with what its weights say.
Mean by_flights(const VolumeSet& set, const Ray& ray, uint64_t count, TrackingCounts& counts) {
    Mean mean;
    Flight flight;
    for (uint64_t i = 0; i < count; ++i) {
        set.fly(ray.o, ray.d, far_away, Rgb(1.0f), FreePath{}, RandomStream(i, -1.0), flight,
                counts);
        mean.add(flight.medium ? Rgb(0.0f) : flight.weight);
    }
    return mean;
}

Mean by_ratios(const VolumeSet& set, const Ray& ray, uint64_t count, TrackingCounts& counts) {
    Mean mean;
    for (uint64_t i = 0; i < count; ++i) {
        RandomStream numbers(~i, -1.0);
        mean.add(set.transmittance(ray.o, ray.d, far_away, nullptr, numbers, counts));
    }
    return mean;
}

/// A wave of one period over 63 cells, whose interpolation has the mean sigma0: along z.
VoxelGrid wave(float sigma0) {
    const auto number = [&](int, int, int z) {
        return sigma0 * (1.0f + float(std::cos(2.0 * pi_d * z / 63.0)));
    };
    VoxelGrid grid = make_voxel_grid(Vec3i(16, 16, 64), 1.0f / 63.0f, number);
    // Without the soft edges before and behind it
    grid.box_min.z += 1.0f;
    grid.box_max.z -= 1.0f;
    return grid;
}

const Ray along_wave{Vec3(0.11f, 0.12f, 3.0f), Vec3(0, 0, -1)};

Rgb exponential(const Rgb& tau) {
    return {std::exp(-tau.x), std::exp(-tau.y), std::exp(-tau.z)};
}

}  // namespace

TEST(H35ThickMedia, TransmittanceOfOneNumberIsTheClosedForm) {
    double worst = 0;
    for (const double tau : {1e-6, 1e-3, 0.5, 2.0, 50.0, 80.0, 1e4}) {
        Scene scene;
        add_volume(scene, constant_box(Vec3d(-1, -1, -3), Vec3d(1, 1, -1), float(tau / 2)));
        const VolumeSet set(scene);
        TrackingCounts counts;
        RandomStream numbers(1, -1.0);
        const Rgb passed = set.transmittance(Vec3(0.2f, -0.3f, 0.0f), Vec3(0, 0, -1), far_away,
                                             nullptr, numbers, counts);
        const double expected = std::exp(-tau);
        for (int c = 0; c < 3; ++c) {
            EXPECT_GE(passed[c], 0.0f);
            // A float of depth tau is known to tau 2^-24; e^-1e4 is none
            if (expected > 1e-38)
                worst = hardcase::larger(
                    worst, std::abs(double(passed[c]) / expected - 1) / std::max(1.0, tau));
            else
                EXPECT_EQ(passed[c], 0.0f);
        }
    }
    hardcase::expect_within({"transmittance for tau 1e-6 to 1e4, relative, over max(1, tau)", worst,
                             1e-6, 0, "closed form"});
}

TEST(MovingMedia, AreNowhereWhereTheyAreFlat) {
    Scene scene;
    add_volume(scene, constant_box(Vec3d(-1, -1, -3), Vec3d(1, 1, -1), 1.0f));
    Mat4d flat;
    flat[0][0] = 0.0;
    scene.volumes[0].later_render_from_volume = {flat};
    const VolumeSet set(scene);
    const Vec3 o(0.0f), d(0, 0, -1);
    for (const float time : {0.0f, 0.5f, 1.0f}) {
        TrackingCounts counts;
        RandomStream numbers(1, -1.0);
        const Rgb passed = set.transmittance(o, d, far_away, nullptr, numbers, counts, time);
        EXPECT_NEAR(passed.x, time < 1.0f ? std::exp(-2.0f) : 1.0f, 1e-5f) << time;
        size_t collisions = 0;
        for (uint64_t i = 0; i < 64; ++i) {
            Flight flight;
            set.fly(o, d, far_away, Rgb(1.0f), FreePath{}, RandomStream(i, -1.0), flight, counts,
                    nullptr, time);
            collisions += flight.medium != nullptr;
        }
        EXPECT_EQ(collisions > 0, time < 1.0f) << time;
    }
}

TEST(H34ThinMedia, CollideAsOftenAsTheyShould) {
    // The first number decides: below 1 − e^−τ light collides, and where is known
    for (const double tau : {1e-6, 1e-5, 1e-4, 1e-3}) {
        Scene scene;
        add_volume(scene, constant_box(Vec3d(-1, -1, -2), Vec3d(1, 1, -1), float(tau)));
        const VolumeSet set(scene);
        Flight flight;
        TrackingCounts counts;
        const auto fly = [&](double u) {
            set.fly(Vec3(0.0f), Vec3(0, 0, -1), far_away, Rgb(1.0f), FreePath{}, RandomStream(1, u),
                    flight, counts);
            return flight.medium != nullptr;
        };
        double low = 0.0, high = 1.0;
        for (int i = 0; i < 60; ++i) (fly(0.5 * (low + high)) ? low : high) = 0.5 * (low + high);
        hardcase::expect_within({fmt::format("share that collides, tau {}, relative", tau),
                                 std::abs(low + std::expm1(-double(float(tau)))) / tau, 1e-6, 0,
                                 "closed form"});
        const double u = 0.25 * tau;
        ASSERT_TRUE(fly(u));
        EXPECT_NEAR(double(flight.t), 1.0 - std::log1p(-u) / double(float(tau)), 1e-6);
    }
}

TEST(H37Trackers, OfAWaveHaveTheMeanOfTheWave) {
    for (const float sigma0 : {0.5f, 3.0f}) {
        Scene scene;
        add_volume(scene, wave(sigma0));
        const Rgb expected(std::exp(-sigma0));
        for (const Majorants majorants : {Majorants::Bricks, Majorants::One}) {
            const VolumeSet set(scene, {.majorants = majorants});
            TrackingCounts counts;
            const uint64_t rays = hardcase::sized(200000, 10000000, 100000000);
            const double bound = sigma0 < 1.0f ? 0.02 : 0.06;
            expect_mean(by_flights(set, along_wave, rays, counts), expected, "wave by flights",
                        bound);
            expect_mean(by_ratios(set, along_wave, rays, counts), expected, "wave by ratios",
                        bound);
            hardcase::expect_within(
                {"numbers above the bound", double(counts.violations), 0, 0, "counter"});
            EXPECT_EQ(counts.capped, 0u);
        }
    }
}

TEST(H36LowMajorants, AreNoticedAndKeepTheMean) {
    Scene scene;
    add_volume(scene, wave(1.0f));
    const VolumeSet set(scene, {.majorant_factor = 0.5f});
    TrackingCounts counts;
    const uint64_t rays = hardcase::sized(1000000, 40000000, 400000000);
    expect_mean(by_flights(set, along_wave, rays, counts), Rgb(std::exp(-1.0f)),
                "wave with half the bound, by flights");
    EXPECT_GT(counts.violations, 1000u);
    counts = {};
    expect_mean(by_ratios(set, along_wave, rays, counts), Rgb(std::exp(-1.0f)),
                "wave with half the bound, by ratios");
    EXPECT_GT(counts.violations, 1000u);
}

TEST(Tracking, KeepsEveryChannel) {
    Scene scene;
    add_volume(scene, wave(1.0f)).optics.extinction_color = Rgb(2.0f, 0.5f, 0.0f);
    const VolumeSet set(scene);
    TrackingCounts counts;
    const Rgb expected = exponential(Rgb(2.0f, 0.5f, 0.0f));
    expect_mean(by_flights(set, along_wave, 200000, counts), expected, "colored wave by flights");
    expect_mean(by_ratios(set, along_wave, 200000, counts), expected, "colored wave by ratios");
}

TEST(Tracking, AddsVolumesThatOverlap) {
    Scene scene;
    add_volume(scene, wave(0.7f));
    Mat4d turned;
    turned.rotate(Vec3d(0, 0, 0.3));
    add_volume(scene, constant_box(Vec3d(-2, -2, 0.25), Vec3d(2, 2, 0.75), 1.0f), turned);
    add_volume(scene, constant_box(Vec3d(-2, -2, -5), Vec3d(2, 2, -4), 0.5f))
        .optics.extinction_color = Rgb(1.0f, 0.0f, 0.5f);
    const VolumeSet set(scene);
    TrackingCounts counts;
    const Rgb expected = exponential(Rgb(1.2f) + Rgb(0.5f, 0.0f, 0.25f));
    expect_mean(by_flights(set, along_wave, 200000, counts), expected, "three volumes by flights");
    expect_mean(by_ratios(set, along_wave, 200000, counts), expected, "three volumes by ratios");
}

TEST(H37Trackers, OfOneVoxelIsThatOfItsInterpolation) {
    // Along x through the middle of the voxel the density is a tent of area σ
    constexpr float sigma = 1.5f;
    Scene scene;
    add_volume(scene, make_voxel_grid(Vec3i(1), 1.0f, [&](int, int, int) { return sigma; }));
    const VolumeSet set(scene);
    TrackingCounts counts;
    const Ray ray{Vec3(-5.0f, 0.0f, 0.0f), Vec3(1, 0, 0)};
    const uint64_t rays = hardcase::sized(400000, 20000000, 200000000);
    expect_mean(by_flights(set, ray, rays, counts), Rgb(std::exp(-sigma)), "one voxel by flights");
    expect_mean(by_ratios(set, ray, rays, counts), Rgb(std::exp(-sigma)), "one voxel by ratios");
    // A quarter of a cell aside in y and z it is 9/16 of that
    const Ray aside{Vec3(-5.0f, 0.25f, -0.25f), Vec3(1, 0, 0)};
    expect_mean(by_ratios(set, aside, 100000, counts), Rgb(std::exp(-sigma * 0.5625f)),
                "one voxel, aside");
}

TEST(H37Trackers, OfNothingChangesNothing) {
    Scene scene;
    add_volume(scene, make_voxel_grid(Vec3i(20), 0.1f, [](int, int, int) { return 0.0f; }));
    const VolumeSet set(scene);
    TrackingCounts counts;
    Flight flight;
    RandomStream numbers(7, -1.0);
    set.fly(Vec3(1, 1, 5), Vec3(0, 0, -1), far_away, Rgb(1.0f), FreePath{}, numbers, flight,
            counts);
    EXPECT_EQ(flight.medium, nullptr);
    EXPECT_EQ(flight.weight, Rgb(1.0f));
    const Rgb passed =
        set.transmittance(Vec3(1, 1, 5), Vec3(0, 0, -1), far_away, nullptr, numbers, counts);
    EXPECT_EQ(passed, Rgb(1.0f));
    hardcase::expect_within(
        {"what an empty grid takes", double(1.0f - passed.x), 0, 0, "closed form"});
}

TEST(H35ThickMedia, TrackingEnds) {
    Scene scene;
    add_volume(scene, wave(1e4f));
    const VolumeSet set(scene);
    TrackingCounts counts;
    const Mean mean = by_ratios(set, along_wave, 1000, counts);
    hardcase::expect_within(
        {"what a wave of depth 1e4 lets through", mean.mean(0), 1e-30, 0, "closed form"});
    EXPECT_GE(mean.mean(0), 0.0);
    EXPECT_EQ(counts.capped, 0u);
}

TEST(Emission, IsThatOfTheWay) {
    // ε·d where nothing absorbs, and ε/σ·(1 − e^−σd) where something does
    Scene scene;
    scene::Volume& glow = add_volume(scene, constant_box(Vec3d(-1, -1, 0), Vec3d(1, 1, 2), 0.0f));
    glow.emission = add_field(scene, constant_box(Vec3d(-1, -1, 0), Vec3d(1, 1, 2), 0.25f));
    scene.volumes[0].optics.emission = Rgb(2.0f, 1.0f, 0.0f);
    const auto expect = [&](const Rgb& sigma_a, const Rgb& expected, const char* what) {
        const VolumeSet set(scene);
        TrackingCounts counts;
        Mean mean;
        Flight flight;
        for (uint64_t i = 0; i < 20000; ++i) {
            set.fly(along_wave.o, along_wave.d, far_away, Rgb(1.0f),
                    FreePath{.extinction = sigma_a}, RandomStream(i, -1.0), flight, counts);
            mean.add(flight.emitted);
        }
        expect_mean(mean, expected, what);
    };
    expect(Rgb(0.0f), Rgb(1.0f, 0.5f, 0.0f), "glow");
    const double begin = 1.0, d = 2.0, s = 0.7;  // the way begins outside, in what absorbs
    const float within = float(std::exp(-s * begin) * (1.0 - std::exp(-s * d)) / s * 0.25);
    expect(Rgb(float(s)), Rgb(2.0f * within, within, 0.0f), "glow in a body that absorbs");
    add_volume(scene, constant_box(Vec3d(-1, -1, 0), Vec3d(1, 1, 2), 1.5f));
    const float shaded = float((1.0 - std::exp(-3.0)) / 1.5 * 0.25);
    expect(Rgb(0.0f), Rgb(2.0f * shaded, shaded, 0.0f), "glow in smoke");
}

TEST(Emission, OfColdMatterIsNotSeen) {
    Scene scene;
    scene::Volume& cold = add_volume(scene, constant_box(Vec3d(-1, -1, 0), Vec3d(1, 1, 1), 5.0f));
    cold.temperature = add_field(scene, constant_box(Vec3d(-1, -1, 0), Vec3d(1, 1, 1), 600.0f));
    scene.volumes[0].optics.blackbody = 1.0f;
    const VolumeSet set(scene);
    TrackingCounts counts;
    Flight flight;
    set.fly(along_wave.o, along_wave.d, far_away, Rgb(1.0f), FreePath{}, RandomStream(1, -1.0),
            flight, counts);
    EXPECT_EQ(flight.emitted, Rgb(0.0f));
}

TEST(Emission, OfABlackBodyIsWhatItAbsorbs) {
    // Kirchhoff: thick matter of one temperature shines like its black body, thin matter by its
    // share
    for (const float tau : {0.5f, 30.0f}) {
        Scene scene;
        scene::Volume& hot = add_volume(scene, constant_box(Vec3d(-1, -1, 0), Vec3d(1, 1, 1), tau));
        hot.temperature = add_field(scene, constant_box(Vec3d(-1, -1, 0), Vec3d(1, 1, 1), 2.0f));
        scene.volumes[0].optics.temperature_scale = 1000.0f;
        scene.volumes[0].optics.blackbody = 0.1f;
        scene.volumes[0].optics.blackbody_colors = {Rgb(0.0f), Rgb(1.0f, 0.5f, 0.25f)};
        const VolumeSet set(scene);
        TrackingCounts counts;
        Mean mean;
        Flight flight;
        for (uint64_t i = 0; i < 40000; ++i) {
            set.fly(along_wave.o, along_wave.d, far_away, Rgb(1.0f), FreePath{},
                    RandomStream(i, -1.0), flight, counts);
            mean.add(flight.emitted);
        }
        expect_mean(mean, Rgb(1.0f, 0.5f, 0.25f) * (1.6f * (1.0f - std::exp(-tau))), "black body");
    }
}

}  // namespace velatura::media
