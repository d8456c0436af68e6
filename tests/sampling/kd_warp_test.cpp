// SPDX-License-Identifier: Apache-2.0
#include "sampling/kd_warp.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace velatura::sampling {
namespace {

using Point = KdWarp::Point;

class Numbers {
  public:
    explicit Numbers(unsigned seed) : random_(seed) {}

    Point next() {
        Point u;
        for (double& x : u) x = unit_(random_);
        return u;
    }

  private:
    std::mt19937_64 random_;
    std::uniform_real_distribution<double> unit_;
};

/// 4 in the box [1/2, 3/4) × [0, 1/4) of axes 2 and 6, else 1/16: mean 1/4 + 15/256.
double box(const Point& u) {
    return u[2] >= 0.5 && u[2] < 0.75 && u[6] < 0.25 ? 4.0 : 0.0625;
}

constexpr double mean_of_box = 4.0 / 16 + 0.0625 * 15 / 16;

template <class Value>
std::vector<KdWarp::Sample> samples_of(size_t count, const Value& value) {
    Numbers numbers(1);
    std::vector<KdWarp::Sample> out(count);
    for (KdWarp::Sample& s : out) {
        s.u = numbers.next();
        const double v = value(s.u);
        s.square = v * v;
    }
    return out;
}

/// Mean and variance of value / density over warped numbers.
template <class Value>
std::pair<double, double> estimate(const KdWarp& warp, size_t count, const Value& value) {
    Numbers numbers(2);
    double sum = 0, sum2 = 0;
    for (size_t i = 0; i < count; ++i) {
        Point u = numbers.next();
        const double density = warp.warp(u);
        EXPECT_GT(density, 0.2);
        for (const double x : u) EXPECT_TRUE(x >= 0.0 && x < 1.0);
        EXPECT_NEAR(warp.density(u) / density, 1.0, 1e-12);
        const double v = value(u) / density;
        sum += v;
        sum2 += v * v;
    }
    const double mean = sum / double(count);
    return {mean, sum2 / double(count) - mean * mean};
}

TEST(KdWarp, UniformUnlessItLearns) {
    const KdWarp uniform, black(samples_of(4096, [](const Point&) { return 0.0; })),
        gray(samples_of(4096, [](const Point&) { return 0.5; })),
        none{std::span<const KdWarp::Sample>()};
    for (const KdWarp* warp : {&uniform, &black, &gray, &none}) {
        EXPECT_EQ(warp->cell_count(), 1u);
        Point u = Numbers(3).next();
        const Point before = u;
        EXPECT_EQ(warp->warp(u), 1.0);
        EXPECT_EQ(u, before);
    }
}

// The cuts can be those of the box: each of its cells has the density that the roots of the mean
// squares say, a quarter of it uniform
TEST(KdWarp, LearnsABoxAndStaysUnbiased) {
    const KdWarp warp(samples_of(65536, box));
    Point in{}, out{};
    in[2] = 0.6;
    out[2] = 0.1;
    EXPECT_NEAR(warp.density(in), 0.75 * 4.0 / mean_of_box + 0.25, 0.05);
    EXPECT_NEAR(warp.density(out), 0.75 * 0.0625 / mean_of_box + 0.25, 0.02);
    constexpr size_t count = 200'000;
    const auto [mean, variance] = estimate(warp, count, box);
    const auto [uniform_mean, uniform_variance] = estimate({}, count, box);
    const double error = std::sqrt(variance / double(count));
    fmt::print("box: mean {:.5f}, closed {:.5f}, detectable {:.2g}; variance {:.3g} of uniform's\n",
               mean, mean_of_box, 5.28 * error, variance / uniform_variance);
    EXPECT_NEAR(mean, mean_of_box, 4 * error);
    EXPECT_LT(variance, 0.05 * uniform_variance);
}

TEST(KdWarp, SamplesOfAWarpTeachAsUniformOnesDo) {
    const std::vector<KdWarp::Sample> uniform = samples_of(65536, box);
    const KdWarp first(uniform);
    Numbers numbers(4);
    std::vector<KdWarp::Sample> warped(uniform.size());
    for (KdWarp::Sample& s : warped) {
        s.u = numbers.next();
        s.density = first.warp(s.u);
        s.square = box(s.u) * box(s.u);
    }
    const KdWarp second(warped);
    Point in{};
    in[2] = 0.6;
    EXPECT_NEAR(second.density(in), first.density(in), 0.1);
}

// Values that are rare and bright at random places: what one half of the samples has met is no
// reason to look there
TEST(KdWarp, NoiseCutsLittle) {
    Numbers chance(5);
    const KdWarp warp(
        samples_of(65536, [&](const Point&) { return chance.next()[0] < 1e-3 ? 1000.0 : 1.0; }));
    Numbers numbers(6);
    double largest = 0;
    double smallest = 10;
    for (int i = 0; i < 10000; ++i) {
        const double d = warp.density(numbers.next());
        largest = std::max(largest, d);
        smallest = std::min(smallest, d);
    }
    fmt::print("noise: {} cells, densities {:.3g} to {:.3g}\n", warp.cell_count(), smallest,
               largest);
    EXPECT_LT(largest, 3.0);
}

}  // namespace
}  // namespace velatura::sampling
