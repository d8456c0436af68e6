// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "../sampling/chi_square.h"
#include "hard_case.h"
#include "shading/ggx.h"

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <vector>

namespace velatura::shading::testing {

/// Cells of half vectors for χ² tests of ggx_sample: slope in units of the widths × azimuth of the
/// stretched normal.
struct HalfVectorCells {
    static constexpr int rows = 10, columns = 12, count = rows * columns;

    template <class Alpha>
    static size_t of(const Vec3d& m, const Alpha& alpha) {
        const double x = m.x / ggx_detail::along_x(alpha), y = m.y / ggx_detail::along_y(alpha);
        const int r = std::min(rows - 1, int(rows / std::sqrt(1 + (x * x + y * y) / (m.z * m.z))));
        const int c = std::min(columns - 1, int((std::atan2(y, x) / (2 * pi_d) + 0.5) * columns));
        return size_t(r * columns + c);
    }
};

/// Probability of each cell by the density that ggx_sample states, integrated by midpoints;
/// directions below the surface are in none.
template <class Alpha>
std::vector<double> cell_probabilities(const Vec3d& wo, const Alpha& alpha) {
    using Cells = HalfVectorCells;

    struct Steps {
        int rows, columns;
    };

    // Where reflections leave the hemisphere the density breaks off: fine steps across it
    constexpr Steps coarse = {40, 8}, fine = {200, 24};
    const auto normal_at = [&](double y, double phi) {
        const double slope = std::sqrt(std::max(0.0, 1 - y * y)) / y;
        Vec3d m(ggx_detail::along_x(alpha) * slope * std::cos(phi),
                ggx_detail::along_y(alpha) * slope * std::sin(phi), 1);
        m /= std::sqrt(m.dot(m));
        return m;
    };
    const auto reflects_up = [&](const Vec3d& m) {
        const double cos_m = wo.dot(m);
        return cos_m > 0 && 2 * cos_m * m.z > wo.z;
    };
    const auto y_of = [](int cell, double part) {
        return std::max((cell / Cells::columns + part) / Cells::rows, 1e-9);
    };
    const auto phi_of = [](int cell, double part) {
        return ((cell % Cells::columns + part) / Cells::columns - 0.5) * 2 * pi_d;
    };
    const auto is_cut = [&](int cell) {
        for (int r = 0; r <= coarse.rows; ++r) {
            for (int c = 0; c <= coarse.columns; ++c) {
                const double y = y_of(cell, double(r) / coarse.rows);
                if (!reflects_up(normal_at(y, phi_of(cell, double(c) / coarse.columns))))
                    return true;
            }
        }
        return false;
    };
    std::vector<double> probabilities(Cells::count);
    for (int cell = 0; cell < Cells::count; ++cell) {
        const Steps steps = is_cut(cell) ? fine : coarse;
        double sum = 0;
        for (int r = 0; r < steps.rows; ++r) {
            for (int c = 0; c < steps.columns; ++c) {
                const double y = y_of(cell, (r + 0.5) / steps.rows);
                const Vec3d m = normal_at(y, phi_of(cell, (c + 0.5) / steps.columns));
                if (!reflects_up(m)) continue;
                // y = 1/√(1 + slope²): D·cosθ_m·dω_m = 2y·dy·dφ/2π, dω_i = 4·cos_m·dω_m
                sum += 2 * y * ggx_pdf(wo, m, alpha) * 4 * wo.dot(m) / (ggx_d(m, alpha) * m.z);
            }
        }
        probabilities[size_t(cell)] = sum / (Cells::count * steps.rows * steps.columns);
    }
    return probabilities;
}

struct ChiSquareRun {
    double z = 0;         ///< normal deviate of the statistic
    double inside = 0;    ///< ∫ pdf over the upper hemisphere
    double lost = 0;      ///< share of the samples below it
    double heaviest = 0;  ///< largest f·cosθ_i / pdf, F = 1
};

/// χ² of ggx_sample, drawn in T, against the probabilities of the cells.
template <class T, class Alpha>
ChiSquareRun run_chi_square(const Vec3d& wo,
                            const Alpha& alpha,
                            const std::vector<double>& probabilities,
                            int count,
                            unsigned long long seed) {
    using Drawn = std::conditional_t<std::is_same_v<Alpha, double>, T, Imath::Vec2<T>>;
    sampling::testing::TestRandom random(seed);
    std::vector<double> counts(HalfVectorCells::count + 1, 0.0), expected;
    ChiSquareRun run;
    for (int i = 0; i < count; ++i) {
        const Imath::Vec2<T> u(T(random.uniform()), T(random.uniform()));
        const Vec3d wi(ggx_sample(Imath::Vec3<T>(wo), Drawn(alpha), u));
        if (wi.z <= 0) {
            counts.back() += 1;
            continue;
        }
        Vec3d m = wo + wi;
        m /= std::sqrt(m.dot(m));
        counts[HalfVectorCells::of(m, alpha)] += 1;
        run.heaviest = hardcase::larger(
            run.heaviest, ggx_visibility(wo, wi, alpha) * wi.z * ggx_pdf_divisor(wo, alpha));
    }
    for (const double p : probabilities) {
        expected.push_back(p * count);
        run.inside += p;
    }
    run.lost = counts.back() / count;
    expected.push_back(std::max(0.0, 1 - run.inside) * count);
    run.z = sampling::testing::chi_square(counts, expected).z;
    return run;
}

}  // namespace velatura::shading::testing
