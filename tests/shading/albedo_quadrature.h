// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "shading/ggx.h"

#include <cmath>
#include <vector>

namespace velatura::shading::testing {

/// Nodes and weights of Gauss-Legendre quadrature on [0, 1] by Newton's method on the Legendre
/// polynomial.
struct GaussLegendre {
    std::vector<double> x, w;

    explicit GaussLegendre(int n) : x(size_t(n)), w(size_t(n)) {
        for (int i = 0; i < n; ++i) {
            double z = std::cos(pi_d * (i + 0.75) / (n + 0.5));
            double derivative = 0;
            for (int iteration = 0; iteration < 100; ++iteration) {
                double p0 = 1, p1 = z;
                for (int k = 2; k <= n; ++k) {
                    const double p2 = ((2 * k - 1) * z * p1 - (k - 1) * p0) / k;
                    p0 = p1;
                    p1 = p2;
                }
                derivative = n * (z * p1 - p0) / (z * z - 1);
                const double step = p1 / derivative;
                z -= step;
                if (std::abs(step) < 1e-15) break;
            }
            x[size_t(i)] = 0.5 * (1 - z);
            w[size_t(i)] = 1 / ((1 - z * z) * derivative * derivative);
        }
    }
};

struct AlbedoReference {
    double one = 0;      // F = 1
    double schlick = 0;  // F = (1 − cosθ)^5
};

/// Directional albedo of single-scattering GGX in double: quadrature over the unit square that
/// bounded VNDF sampling maps to directions, where the integrand is bounded and D cancels.
inline AlbedoReference albedo_by_quadrature(double mu,
                                            double alpha,
                                            const GaussLegendre& rule,
                                            int phi_count) {
    const Vec3d wo(std::sqrt(std::max(0.0, 1 - mu * mu)), 0, mu);
    const double divisor = ggx_pdf_divisor(wo, alpha);
    AlbedoReference sum;
    for (size_t i = 0; i < rule.x.size(); ++i) {
        for (int j = 0; j < phi_count; ++j) {
            const Vec3d wi = ggx_sample(wo, alpha, Vec2d((j + 0.5) / phi_count * 0.5, rule.x[i]));
            if (wi.z <= 0) continue;
            const Vec3d h = wo + wi;
            const double cos_h = std::min(1.0, 0.5 * std::sqrt(h.dot(h)));
            const double weight =
                rule.w[i] / phi_count * ggx_visibility(mu, wi.z, alpha) * wi.z * divisor;
            sum.one += weight;
            sum.schlick += weight * std::pow(1 - cos_h, 5);
        }
    }
    return sum;
}

}  // namespace velatura::shading::testing
