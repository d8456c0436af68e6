// SPDX-License-Identifier: Apache-2.0
// Prints src/shading/generated/albedo_tables.cpp. Run it only when the parametrization in
// src/shading/albedo.h changes.
#include "albedo_quadrature.h"
#include "shading/albedo.h"

#include <cstdio>
#include <vector>

namespace {

using velatura::shading::testing::AlbedoReference;
using velatura::shading::testing::GaussLegendre;
using namespace velatura::shading::albedo_tables;

using Row = std::vector<double>;

double root_alpha(size_t i, size_t count) {
    const double low = double(root_alpha_min);
    return low + (1 - low) * double(i) / double(count - 1);
}

double at(const std::vector<Row>& rows, double a, double m) {
    const size_t i = std::min(size_t(a), alpha_count - 2), j = std::min(size_t(m), mu_count - 2);
    const double s = a - double(i), t = m - double(j);
    return (rows[i][j] * (1 - t) + rows[i][j + 1] * t) * (1 - s) +
           (rows[i + 1][j] * (1 - t) + rows[i + 1][j + 1] * t) * s;
}

/// Means with weight 2μ of the tables as the renderer interpolates them, so that compensation is
/// exact for them.
void average(const std::vector<Row>& losses,
             const std::vector<Row>& cosines,
             double root,
             double& loss_mean,
             double& schlick_mean) {
    constexpr int n = 1 << 14;
    const double alpha = root * root, low = double(root_alpha_min);
    const double a = (root - low) / (1 - low) * double(alpha_count - 1);
    loss_mean = schlick_mean = 0;
    for (int k = 0; k < n; ++k) {
        // Substitute μ = s³, to resolve grazing angles
        const double s = (k + 0.5) / n, mu = s * s * s, weight = 2 * mu * 3 * s * s / n;
        const double w = std::sqrt(1 - std::sqrt(alpha * (1 - mu) / (mu + alpha)));
        const double lost = at(losses, a, w * double(mu_count - 1));
        const double cosine = at(cosines, a, w * double(mu_count - 1)) * (mu + alpha);
        loss_mean += weight * lost;
        schlick_mean += weight * (1 - lost) * std::pow(std::max(1 - cosine, 0.0), 5);
    }
}

void print_table(const char* name, const std::vector<Row>& rows) {
    std::printf("\nconst float %s[alpha_count][mu_count] = {\n", name);
    for (const Row& row : rows) {
        std::printf("    {");
        for (size_t i = 0; i < row.size(); ++i) {
            std::printf("%.9gf%s", row[i] == 0 ? 0.0 : row[i],
                        i + 1 == row.size() ? "},\n" : (i % 5 == 4 ? ",\n     " : ", "));
        }
    }
    std::printf("};\n");
}

void print_row(const char* name, const Row& row) {
    std::printf("\nconst float %s[average_count] = {\n    ", name);
    for (size_t i = 0; i < row.size(); ++i) {
        std::printf("%.9gf%s", row[i],
                    i + 1 == row.size() ? "};\n" : (i % 5 == 4 ? ",\n    " : ", "));
    }
}

}  // namespace

int main() {
    const GaussLegendre rule(192);
    std::vector<Row> losses, cosines;
    Row average_losses, average_schlicks;
    for (size_t a = 0; a < alpha_count; ++a) {
        const double alpha = root_alpha(a, alpha_count) * root_alpha(a, alpha_count);
        Row lost(mu_count), ratio(mu_count);
        for (size_t m = 0; m < mu_count; ++m) {
            const double x = double(m) / double(mu_count - 1);
            // 1 − t = (1 − w²)² = α·(1 − μ)/(μ + α) solved for μ; the limit at grazing incidence
            // stands in for μ = 0
            const double rest = (1 - x * x) * (1 - x * x);
            const double mu = std::max(alpha * (1 - rest) / (alpha + rest), 1e-9);
            const AlbedoReference e = albedo_by_quadrature(mu, alpha, rule, 160);
            lost[m] = 1 - e.one;
            ratio[m] = (1 - std::pow(e.schlick / e.one, 0.2)) / (mu + alpha);
        }
        losses.push_back(std::move(lost));
        cosines.push_back(std::move(ratio));
    }
    for (size_t a = 0; a < average_count; ++a) {
        const double root = root_alpha(a, average_count);
        double lost = 0, schlick = 0;
        average(losses, cosines, root, lost, schlick);
        average_losses.push_back(lost / (root * root * root * root));
        average_schlicks.push_back(schlick);
    }
    std::printf(
        "// SPDX-License-Identifier: Apache-2.0\n"
        "// Written by tests/shading/make_albedo_tables.cpp; meaning in albedo.h.\n"
        "#include \"shading/albedo.h\"\n\n"
        "namespace velatura::shading::albedo_tables {\n");
    print_table("loss", losses);
    print_table("cosine", cosines);
    print_row("average_loss", average_losses);
    print_row("average_schlick", average_schlicks);
    std::printf("\n}  // namespace velatura::shading::albedo_tables\n");
}
