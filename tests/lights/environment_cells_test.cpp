// SPDX-License-Identifier: Apache-2.0
// Environment maps of the size and range of real ones (docs/engineering/hard_cases.md H27), every
// texel checked.
#include "base/tasks.h"
#include "hard_case.h"
#include "light_fixtures.h"
#include "lights/environment_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <vector>

namespace velatura::lights {
namespace {

constexpr int width = 8192, height = 4096;

EnvironmentImage flat_map() {
    EnvironmentImage image{width, height, {}};
    image.texels.assign(size_t(width) * size_t(height), Rgb(1.0f));
    return image;
}

/// Sun of 16 × 16 texels, in the rows 1000 to 1015.
EnvironmentImage sky_with_sun(float radiance) {
    EnvironmentImage image = flat_map();
    for (size_t y = 1000; y < 1016; ++y)
        for (size_t x = 3000; x < 3016; ++x) image.texels[y * size_t(width) + x] = Rgb(radiance);
    return image;
}

/// Luminance · sinθ at the texels' centers of a row.
std::vector<double> row_weights(const EnvironmentImage& image, size_t y) {
    const double sine = std::sin(pi_d * (double(y) + 0.5) / height);
    std::vector<double> weights(static_cast<size_t>(width));
    for (size_t x = 0; x < weights.size(); ++x)
        weights[x] = double(luminance(image.texels[y * size_t(width) + x])) * sine;
    return weights;
}

/// Integrals of the bilinear weight over the cells of a row, in texels.
std::vector<double> cell_weights(const EnvironmentImage& image, size_t row) {
    const std::vector<double> above = row_weights(image, row > 0 ? row - 1 : 0);
    const std::vector<double> below = row_weights(image, std::min(row, size_t(height) - 1));
    const double share = row == 0 || row == size_t(height) ? 0.5 : 1.0;
    std::vector<double> weights(static_cast<size_t>(width));
    for (size_t column = 0; column < weights.size(); ++column) {
        const size_t right = (column + 1) % size_t(width);
        weights[column] =
            share * 0.25 * (above[column] + above[right] + below[column] + below[right]);
    }
    return weights;
}

struct Deviations {
    double mass = 0;     ///< of the cells' probabilities from the weights
    double density = 0;  ///< of pdf · area from the probabilities
};

/// Masses of all cells, densities in every `density_stride`-th row of them.
Deviations deviations(const EnvironmentImage& image,
                      const EnvironmentMap& map,
                      size_t density_stride) {
    std::vector<long double> row_sums(size_t(height) + 1);
    parallel_for(size_t(height) + 1, [&](size_t row) {
        for (const double weight : cell_weights(image, row))
            row_sums[row] += static_cast<long double>(weight);
    });
    long double total = 0;
    for (const long double sum : row_sums) total += sum;
    // Across the middles of the cells of a row
    std::vector<Vec2d> across(static_cast<size_t>(width));
    for (size_t column = 0; column < across.size(); ++column) {
        const double longitude = 2.0 * pi_d * (0.5 - (double(column) + 1.0) / width);
        across[column] = Vec2d(std::sin(longitude), std::cos(longitude));
    }
    std::vector<Deviations> worst(size_t(height) + 1);
    parallel_for(size_t(height) + 1, [&](size_t row) {
        // The middle of a cell, where the bilinear weight is its mean
        const bool is_cap = row == 0 || row == size_t(height);
        const double share = is_cap ? 0.5 : 1.0;
        const double y = row == 0 ? 0.25 : is_cap ? height - 0.25 : double(row);
        const double theta = pi_d * y / height, sine = std::sin(theta), cosine = std::cos(theta);
        const double area = 2.0 * pi_d * pi_d * sine * share / (double(width) * height);
        const std::vector<double> weights = cell_weights(image, row);
        for (size_t column = 0; column < size_t(width); ++column) {
            const double probability = map.cell_probability(column, row);
            const double ideal = double(static_cast<long double>(weights[column]) / total);
            Deviations& w = worst[row];
            w.mass = hardcase::larger(w.mass, std::abs(probability / ideal - 1.0));
            if (row % density_stride != 0) continue;
            const Vec3d d(sine * across[column].x, cosine, sine * across[column].y);
            w.density =
                hardcase::larger(w.density, std::abs(map.view(d).pdf * area / probability - 1.0));
        }
    });
    Deviations result;
    for (const Deviations& w : worst) {
        result.mass = hardcase::larger(result.mass, w.mass);
        result.density = hardcase::larger(result.density, w.density);
    }
    return result;
}

TEST(H27EnvironmentMap, FlatMapIsSampledInEveryTexel) {
    const EnvironmentImage image = flat_map();
    const EnvironmentMap map(image, false);
    const Deviations worst = deviations(image, map, 16);
    hardcase::expect_within({"flat 8192 x 4096: probability of a texel, relative", worst.mass, 1e-6,
                             0, "weights in long double, all texels"});
    hardcase::expect_within(
        {"flat: density times area, relative", worst.density, 1e-6, 0, "probability of the texel"});

    // Evenly spaced numbers reach every column, and every row in which they are dense enough
    std::vector<int> columns(width, 0), rows(height, 0);
    const auto texel_of = [](const Vec3d& d) {
        const double u = 0.5 - std::atan2(d.x, d.z) / (2.0 * pi_d);
        const double v = std::acos(std::clamp(d.y, -1.0, 1.0)) / pi_d;
        return Vec2i(std::min(int(u * width), width - 1), std::min(int(v * height), height - 1));
    };
    for (int i = 0; i < 2 * width; ++i) {
        const float u = (float(i) + 0.5f) / (2 * width);
        const auto across = map.sample({u, 0.5f}), down = map.sample({0.5f, u});
        ASSERT_TRUE(across && down);
        ++columns[size_t(texel_of(across->direction).x)];
        ++rows[size_t(texel_of(down->direction).y)];
    }
    EXPECT_EQ(std::count(columns.begin(), columns.end(), 0), 0);
    const auto empty = [&rows](int first, int last) {
        return std::count(rows.begin() + first, rows.begin() + last, 0);
    };
    EXPECT_EQ(empty(height / 8, height * 7 / 8), 0);

    // One constant map, one irradiance
    const Estimate e = integrate(8192, [&](const Vec2& u) {
        const auto s = map.sample(u);
        return s ? std::max(0.0, s->direction.z) * double(s->radiance.x) / s->pdf : 0.0;
    });
    hardcase::expect_within({"flat: irradiance, relative", std::abs(e.mean / pi_d - 1), 1e-4,
                             e.detectable() / pi_d, "closed form"});
}

TEST(H27EnvironmentMap, SunTakesNoMassFromTheSky) {
    const EnvironmentImage image = sky_with_sun(6e10f);
    const EnvironmentMap map(image, false);
    const Deviations worst = deviations(image, map, 1);
    // What is drawn is what the density says; only beside the sun, where a texel has 1e-13 of the
    // probability, do sums in double let both differ a little from the image
    hardcase::expect_within({"sun of 6e10: density times area, relative", worst.density, 1e-6, 0,
                             "probability of the texel, all texels"});
    hardcase::expect_within({"sun: probability of a texel beside it, relative", worst.mass, 1e-3, 0,
                             "weights in long double"});

    // Irradiance of a surface that faces the sun: the sun's part and the sky's
    const double theta = pi_d * 1008.0 / height, longitude = 2.0 * pi_d * (0.5 - 3008.0 / width);
    const Vec3d n(std::sin(theta) * std::sin(longitude), std::cos(theta),
                  std::sin(theta) * std::cos(longitude));
    // Bilinear texels spread the sun over 17 × 17 cells with the integral of 16 × 16 texels; sinθ
    // and cosines over these 0.7° by quadrature
    double sun = 0;
    for (int j = -16; j < 17 * 16 + 16; ++j) {
        for (int i = -16; i < 17 * 16 + 16; ++i) {
            const double y = 999.5 + (j + 0.5) / 16, x = 2999.5 + (i + 0.5) / 16;
            const double t = pi_d * y / height, l = 2.0 * pi_d * (0.5 - x / width);
            const Vec3d d(std::sin(t) * std::sin(l), std::cos(t), std::sin(t) * std::cos(l));
            sun += (double(map.view(d).radiance.x) - 1.0) * n.dot(d) * std::sin(t);
        }
    }
    sun *= 2.0 * pi_d * pi_d / (double(width) * height * 256);
    const Estimate e = integrate(4096, [&](const Vec2& u) {
        const auto s = map.sample(u);
        return s ? std::max(0.0, n.dot(s->direction)) * double(s->radiance.x) / s->pdf : 0.0;
    });
    hardcase::expect_within({"sun and sky: irradiance, relative",
                             std::abs(e.mean - sun - pi_d) / sun, 1e-4, e.detectable() / sun,
                             "quadrature of both"});
}

}  // namespace
}  // namespace velatura::lights
