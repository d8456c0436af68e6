// SPDX-License-Identifier: Apache-2.0
// The field: what it learns where, and what it must not depend on.
#include "guiding/guiding_field.h"

#include "../sampling/chi_square.h"
#include "base/tasks.h"
#include "sampling/warp.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

namespace velatura::guiding {
namespace {

using sampling::testing::TestRandom;

/// A floor (n = +y) that gets light from +x on its left half and from −x on its right half, and a
/// ceiling (n = −y) above it that gets light from straight below.
std::vector<TrainingSample> room_records(size_t count, float scale = 1.0f) {
    TestRandom random(21);
    std::vector<TrainingSample> records;
    for (size_t i = 0; i < count; ++i) {
        const float x = 10.0f * random.uniform(), z = 10.0f * random.uniform();
        const bool is_floor = random.uniform() < 0.5f;
        TrainingSample r;
        r.at = {Vec3(x, is_floor ? 0.0f : 0.05f, z) * scale, Vec3(0, is_floor ? 1.0f : -1.0f, 0)};
        const Vec3 jitter = sampling::uniform_sphere(Vec2(random.uniform(), random.uniform()));
        const Vec3 from = !is_floor ? Vec3(0, -1, 0) : Vec3(x < 5.0f ? 1.0f : -1.0f, 0.2f, 0);
        r.wi = normalize(from + jitter * 0.1f);
        r.weight = random.uniform() < 0.25f ? 0.0f : 2.0f * random.uniform();
        records.push_back(r);
    }
    return records;
}

std::vector<GuidingPoint> places(float scale = 1.0f) {
    TestRandom random(22);
    std::vector<GuidingPoint> out;
    for (int i = 0; i < 500; ++i) {
        // Some lie outside the records' box
        const Vec3 p(14.0f * random.uniform() - 2.0f, random.uniform(), 10.0f * random.uniform());
        out.push_back(
            {p * scale, sampling::uniform_sphere(Vec2(random.uniform(), random.uniform()))});
    }
    return out;
}

/// Everything that a field says about the places, bit by bit.
std::vector<float> answers(const GuidingField& field, float scale = 1.0f) {
    TestRandom random(23);
    std::vector<float> out;
    for (const GuidingPoint& at : places(scale)) {
        const std::optional<Guide> guide = field.at(at);
        if (!guide) {
            out.push_back(-1);
            continue;
        }
        const DirectionSample s =
            guide->directions.sample(Vec2(random.uniform(), random.uniform()));
        for (const float v :
             {guide->mean, s.wi.x, s.wi.y, s.wi.z, s.pdf, guide->directions.pdf(Vec3(0, 0, 1))}) {
            out.push_back(v);
        }
    }
    return out;
}

}  // namespace

TEST(GuidingField, TellsPlacesAndSidesApart) {
    const std::vector<TrainingSample> records = room_records(40000);
    const GuidingField field(records);
    ASSERT_GT(field.cell_count(), 20u);
    const auto density = [&](const Vec3& p, const Vec3& n, const Vec3& wi) {
        return field.at({p, n})->directions.pdf(normalize(wi));
    };
    const Vec3 up(0, 1, 0), down(0, -1, 0);
    // 20 times the density of the other side, at the least
    EXPECT_GT(density({2, 0, 5}, up, {1, 0.2f, 0}), 20 * density({2, 0, 5}, up, {-1, 0.2f, 0}));
    EXPECT_GT(density({8, 0, 5}, up, {-1, 0.2f, 0}), 20 * density({8, 0, 5}, up, {1, 0.2f, 0}));
    EXPECT_GT(density({2, 0.05f, 5}, down, {0, -1, 0}),
              20 * density({2, 0.05f, 5}, down, {1, 0.2f, 0}));
    // Mean of a weight: 3/4 of the mean 1 of 2u; 600 records and more tell it within 4 · 0.03
    EXPECT_NEAR(double(field.at({{2, 0, 5}, up})->mean), 0.75, 0.12);
}

TEST(GuidingField, EveryDensityIsNormalized) {
    const GuidingField field(room_records(20000));
    // By a grid of another equal-area map: cut cells at the borders leave an error of order 1/n
    constexpr int n = 1024;
    constexpr double bound = 0.02;
    for (size_t i = 0; i < 500; i += 50) {
        const std::optional<Guide> guide = field.at(places()[i]);
        ASSERT_TRUE(guide);
        EXPECT_GT(guide->mean, 0.0f);
        double sum = 0;
        for (int y = 0; y < n; ++y) {
            for (int x = 0; x < n; ++x) {
                const Vec2 u((float(x) + 0.5f) / n, (float(y) + 0.5f) / n);
                sum += double(guide->directions.pdf(sampling::uniform_sphere(u))) * 4 * pi_d;
            }
        }
        EXPECT_NEAR(sum / (double(n) * n), 1.0, bound);
    }
}

TEST(GuidingField, DoesNotDependOnThreads) {
    const std::vector<TrainingSample> records = room_records(30000);
    std::vector<float> expected;
    for (const int threads : {1, 2, 5}) {
        const ThreadLimit limit(threads);
        const std::vector<float> got = answers(GuidingField(records));
        if (expected.empty()) expected = got;
        EXPECT_EQ(got, expected) << threads;
    }
}

TEST(GuidingField, ScalingThePlacesByAPowerOfTwoChangesNoBit) {
    const std::vector<float> expected = answers(GuidingField(room_records(20000)));
    for (const int k : {-20, -3, 7, 30}) {
        const float scale = std::ldexp(1.0f, k);
        EXPECT_EQ(answers(GuidingField(room_records(20000, scale)), scale), expected) << "2^" << k;
    }
}

TEST(GuidingField, BadRecordsDoNotCount) {
    std::vector<TrainingSample> records = room_records(3000);
    const std::vector<float> expected = answers(GuidingField(records));
    for (const float bad :
         {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), -1.0f}) {
        TrainingSample r = records[0];
        r.weight = bad;
        records.push_back(r);
    }
    EXPECT_EQ(answers(GuidingField(records)), expected);
}

TEST(GuidingField, LearnsNothingFromNothing) {
    EXPECT_TRUE(GuidingField().is_empty());
    EXPECT_FALSE(GuidingField().at({Vec3(0.0f), Vec3(0, 0, 1)}));
    EXPECT_TRUE(GuidingField(std::vector<TrainingSample>{}).is_empty());
    std::vector<TrainingSample> dark = room_records(100);
    for (TrainingSample& r : dark) r.weight = 0;
    EXPECT_TRUE(GuidingField(dark).is_empty());
}

TEST(GuidingField, RecordsOfOnePointMakeOneCell) {
    std::vector<TrainingSample> records = room_records(5000);
    for (TrainingSample& r : records) r.at = {Vec3(3, 4, 5), Vec3(0, 0, 1)};
    const GuidingField field(records);
    EXPECT_EQ(field.cell_count(), 1u);
    EXPECT_TRUE(field.at({Vec3(-100, 4, 5), Vec3(1, 0, 0)}));
}

}  // namespace velatura::guiding
