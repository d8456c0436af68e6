// SPDX-License-Identifier: Apache-2.0
#include "geometry/curve_rows.h"

#include "curve_fixtures.h"
#include "geometry/bezier.h"

#include <gtest/gtest.h>

namespace velatura::geometry::test {
namespace {

using Basis = scene::Curves::Basis;
using Wrap = scene::Curves::Wrap;
using Interpolation = scene::Interpolation;

constexpr Basis bases[] = {Basis::Linear, Basis::Bezier, Basis::Bspline, Basis::CatmullRom};
constexpr Wrap wraps[] = {Wrap::Nonperiodic, Wrap::Periodic, Wrap::Pinned};

TEST(CurveRows, CountsAreThoseOfUsdGeom) {
    const auto counts = [](Basis basis, Wrap wrap, size_t vertices) {
        return std::pair(scene::segment_count(basis, wrap, vertices),
                         scene::varying_count(basis, wrap, vertices));
    };
    using Pair = std::pair<size_t, size_t>;
    EXPECT_EQ(counts(Basis::Linear, Wrap::Nonperiodic, 5), Pair(4, 5));
    EXPECT_EQ(counts(Basis::Linear, Wrap::Periodic, 5), Pair(5, 5));
    EXPECT_EQ(counts(Basis::Linear, Wrap::Pinned, 2), Pair(1, 2));
    EXPECT_EQ(counts(Basis::Bezier, Wrap::Nonperiodic, 7), Pair(2, 3));
    EXPECT_EQ(counts(Basis::Bezier, Wrap::Nonperiodic, 8), Pair(0, 0));
    EXPECT_EQ(counts(Basis::Bezier, Wrap::Periodic, 6), Pair(2, 2));
    EXPECT_EQ(counts(Basis::Bezier, Wrap::Periodic, 7), Pair(0, 0));
    EXPECT_EQ(counts(Basis::Bspline, Wrap::Nonperiodic, 6), Pair(3, 4));
    EXPECT_EQ(counts(Basis::Bspline, Wrap::Nonperiodic, 3), Pair(0, 0));
    EXPECT_EQ(counts(Basis::CatmullRom, Wrap::Pinned, 2), Pair(1, 2));
    EXPECT_EQ(counts(Basis::Bspline, Wrap::Pinned, 6), Pair(5, 6));
    EXPECT_EQ(counts(Basis::CatmullRom, Wrap::Periodic, 6), Pair(6, 6));
    for (const Basis basis : bases)
        for (const Wrap wrap : wraps)
            for (const size_t few : {0u, 1u}) EXPECT_EQ(counts(basis, wrap, few), Pair(0, 0));
}

TEST(CurveRows, BasesAndWrapsAreTheirPolynomials) {
    Random random(1);
    for (const Basis basis : bases) {
        for (const Wrap wrap : wraps) {
            scene::Curves curves;
            curves.basis = basis;
            curves.wrap = wrap;
            for (uint32_t n = 2; n < 12; ++n)
                if (scene::segment_count(basis, wrap, n) > 0) curves.vertex_counts.push_back(n);
            for (const uint32_t n : curves.vertex_counts)
                for (uint32_t i = 0; i < n; ++i)
                    curves.points.push_back(to_float(random.in_cube(1)));
            const CurveRows rows(curves);
            for (uint32_t c = 0; c < rows.curve_count(); ++c) {
                const CurveOracle oracle(curves, c);
                ASSERT_EQ(rows.segment_count(c), oracle.segments());
                for (uint32_t s = 0; s < rows.segment_count(c); ++s) {
                    const uint32_t segment = rows.first_segment(c) + s;
                    EXPECT_EQ(rows.curve(segment), c);
                    const CurveRows::Stencil stencil = rows.vertices(segment);
                    Vec3d control[4];
                    for (int k = 0; k < 4; ++k) {
                        control[k] = Vec3d(0.0);
                        for (int j = 0; j < 4; ++j)
                            control[k] +=
                                Vec3d(curves.points[stencil.row[j]]) * stencil.weight[k][j];
                    }
                    for (const double u : {0.0, 0.25, 0.6, 1.0}) {
                        const Vec3d expected(oracle.point(s, Real(u)));
                        EXPECT_LT((bezier_point(control, u) - expected).length(), 1e-14)
                            << int(basis) << ' ' << int(wrap) << ' ' << s << ' ' << u;
                        // Primvars that vary as vertices do follow the same polynomials
                        const PrimvarRows row = rows.rows(segment, Interpolation::Vertex, float(u));
                        Vec3d sum(0.0);
                        for (int k = 0; k < row.count; ++k)
                            sum += Vec3d(curves.points[row.row[k]]) * double(row.weight[k]);
                        EXPECT_LT((sum - expected).length(), 1e-6);
                    }
                    const PrimvarRows uniform = rows.rows(segment, Interpolation::Uniform, 0.3f);
                    EXPECT_EQ(uniform.row[0], c);
                    const PrimvarRows varying = rows.rows(segment, Interpolation::Varying, 0.25f);
                    const size_t n = scene::varying_count(basis, wrap, oracle.count);
                    EXPECT_EQ(varying.row[0], oracle.first_varying + s);
                    EXPECT_EQ(varying.row[1], oracle.first_varying + (s + 1) % n);
                    EXPECT_EQ(varying.weight[1], 0.25f);
                }
            }
        }
    }
}

TEST(CurveRows, PinnedCurvesRunFromTheFirstPointToTheLast) {
    for (const Basis basis : {Basis::Bspline, Basis::CatmullRom}) {
        scene::Curves curves;
        curves.basis = basis;
        curves.wrap = Wrap::Pinned;
        curves.vertex_counts = {5};
        curves.points = {Vec3(1, 2, 3), Vec3(2, 0, 1), Vec3(4, 1, 0), Vec3(5, 5, 5), Vec3(7, 6, 2)};
        const CurveOracle oracle(curves, 0);
        EXPECT_LT(double((oracle.point(0, 0) - VecL(1, 2, 3)).length()), 1e-18);
        EXPECT_LT(double((oracle.point(3, 1) - VecL(7, 6, 2)).length()), 1e-18);
    }
}

}  // namespace
}  // namespace velatura::geometry::test
