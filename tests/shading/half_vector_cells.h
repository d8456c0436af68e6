// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "shading/ggx.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace velatura::shading::testing {

/// Cells of half vectors for χ² tests of ggx_sample: slope in units of the widths × azimuth of the
/// stretched normal.
struct HalfVectorCells {
    static constexpr int rows = 10, columns = 12, count = rows * columns;

    template <class Alpha>
    static size_t of(const Vec3d& m, const Alpha& alpha) {
        const double x = m.x / ggx_detail::along_x(alpha), y = m.y / ggx_detail::along_y(alpha);
        const int r =
            std::min(rows - 1, int(rows / std::sqrt(1 + (x * x + y * y) / (m.z * m.z))));
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
                if (!reflects_up(normal_at(y, phi_of(cell, double(c) / coarse.columns)))) return true;
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

}  // namespace velatura::shading::testing
