// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "geometry/primitive_set.h"
#include "oracle_numbers.h"
#include "scene/curves.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

namespace velatura::geometry::test {

/// A curve in long double, by the formulas of its basis: what a set of curves is held against.
struct CurveOracle {
    using Basis = scene::Curves::Basis;
    using Wrap = scene::Curves::Wrap;

    const scene::Curves& curves;
    size_t first_vertex = 0, count = 0, first_varying = 0, index = 0;

    /// The curve number `which` of the set.
    CurveOracle(const scene::Curves& set, size_t which) : curves(set), index(which) {
        for (size_t i = 0; i < which; ++i) {
            first_vertex += set.vertex_counts[i];
            first_varying += scene::varying_count(set.basis, set.wrap, set.vertex_counts[i]);
        }
        count = set.vertex_counts[which];
    }

    size_t segments() const { return scene::segment_count(curves.basis, curves.wrap, count); }

    /// Value of what `row(vertex)` gives at vertices, at u of a segment: the textbook polynomials.
    template <class Row>
    auto at(size_t segment, Real u, const Row& row) const {
        const auto v = [&](int64_t i) {
            if (curves.wrap == Wrap::Periodic) i = (i + int64_t(count)) % int64_t(count);
            const auto inside = [&](int64_t k) { return row(first_vertex + size_t(k)); };
            if (i < 0) return inside(0) * Real(2) - inside(1);
            if (i >= int64_t(count))
                return inside(int64_t(count) - 1) * Real(2) - inside(int64_t(count) - 2);
            return inside(i);
        };
        const auto s = int64_t(segment);
        const bool is_pinned = curves.wrap == Wrap::Pinned;
        const Real w = 1 - u, u2 = u * u, u3 = u2 * u;
        switch (curves.basis) {
            case Basis::Linear:
                return v(s) * w + v(s + 1) * u;
            case Basis::Bezier:
                return v(3 * s) * (w * w * w) + v(3 * s + 1) * (3 * w * w * u) +
                       v(3 * s + 2) * (3 * w * u2) + v(3 * s + 3) * u3;
            case Basis::Bspline: {
                const int64_t k = is_pinned ? s - 1 : s;
                return (v(k) * (w * w * w) + v(k + 1) * (3 * u3 - 6 * u2 + 4) +
                        v(k + 2) * (-3 * u3 + 3 * u2 + 3 * u + 1) + v(k + 3) * u3) *
                       (Real(1) / 6);
            }
            default: {
                const int64_t k = is_pinned ? s - 1 : s;
                return (v(k) * (-u3 + 2 * u2 - u) + v(k + 1) * (3 * u3 - 5 * u2 + 2) +
                        v(k + 2) * (-3 * u3 + 4 * u2 + u) + v(k + 3) * (u3 - u2)) *
                       Real(0.5);
            }
        }
    }

    VecL point(size_t segment, Real u) const {
        return at(segment, u, [&](size_t i) { return VecL(curves.points[i]); });
    }

    Real radius(size_t segment, Real u) const {
        const auto half = [&](size_t i) { return Real(curves.widths[i]) / 2; };
        switch (curves.width_interpolation) {
            case scene::Interpolation::Constant:
                return half(0);
            case scene::Interpolation::Uniform:
                return half(index);
            case scene::Interpolation::Vertex:
                return at(segment, u, half);
            default: {
                const size_t n = scene::varying_count(curves.basis, curves.wrap, count);
                return half(first_varying + segment) * (1 - u) +
                       half(first_varying + (segment + 1) % n) * u;
            }
        }
    }
};

/// Every curve of a set, sampled finely: the balls that it is made of.
struct Balls {
    struct Ball {
        VecL c;
        Real r;
    };

    std::vector<Ball> balls;  // along the curves
    std::vector<CurveOracle> oracles;
    std::vector<std::array<size_t, 3>> places;  // of each: oracle, segment, step
    int steps;

    Balls(const scene::Curves& curves, int steps_per_segment) : steps(steps_per_segment) {
        for (size_t i = 0; i < curves.vertex_counts.size(); ++i) {
            oracles.emplace_back(curves, i);
            for (size_t s = 0; s < oracles[i].segments(); ++s) {
                for (int k = 0; k <= steps; ++k) {
                    const Real u = Real(k) / steps;
                    balls.push_back({oracles[i].point(s, u), oracles[i].radius(s, u)});
                    places.push_back({i, s, size_t(k)});
                }
            }
        }
    }

    /// Half the chord that a line of unit direction has in a ball, squared, and its middle.
    static Real chord(const Ball& ball, const VecL& o, const VecL& d, Real& middle) {
        const VecL q = ball.c - o;
        middle = q.dot(d);
        const VecL across = q - d * middle;
        return ball.r * ball.r - across.dot(across);
    }

    /// The smallest t at which the line enters any ball; nothing when it meets none. d: unit.
    std::optional<Real> first_entry(const VecL& o, const VecL& d) const {
        Real best = std::numeric_limits<Real>::infinity();
        size_t at = 0;
        for (size_t i = 0; i < balls.size(); ++i) {
            Real middle = 0;
            const Real square = chord(balls[i], o, d, middle);
            if (square < 0) continue;
            const Real t = middle - std::sqrt(square);
            if (t < best) {
                best = t;
                at = i;
            }
        }
        if (!std::isfinite(best)) return std::nullopt;
        // Closer, around the best of the samples
        return std::min(best, closest(at, [&](const Ball& ball) {
                            Real middle = 0;
                            const Real square = chord(ball, o, d, middle);
                            return square < 0 ? std::numeric_limits<Real>::infinity()
                                              : middle - std::sqrt(square);
                        }));
    }

    /// How far outside of all balls a place is; negative inside.
    Real outside(const VecL& p) const {
        Real min = std::numeric_limits<Real>::infinity();
        size_t at = 0;
        for (size_t i = 0; i < balls.size(); ++i) {
            const Real distance = (p - balls[i].c).length() - balls[i].r;
            if (distance < min) at = i;
            min = std::min(min, distance);
        }
        return std::min(
            min, closest(at, [&](const Ball& ball) { return (p - ball.c).length() - ball.r; }));
    }

    /// The least value of a function of balls near a sample, in the segment before a joint, too.
    template <class Function>
    Real closest(size_t at, const Function& f) const {
        Real min = std::numeric_limits<Real>::infinity();
        for (size_t i = at > 0 ? at - 1 : 0; i < std::min(at + 2, balls.size()); ++i) {
            const CurveOracle& oracle = oracles[places[i][0]];
            const size_t segment = places[i][1], step = places[i][2];
            const auto value = [&](Real u) {
                return f(Ball{oracle.point(segment, u), oracle.radius(segment, u)});
            };
            Real a = std::max(Real(0), Real(step) - 1) / steps;
            Real b = std::min(Real(steps), Real(step) + 1) / steps;
            const Real golden = (std::sqrt(Real(5)) - 1) / 2;
            for (int k = 0; k < 80; ++k) {
                const Real c = b - (b - a) * golden, e = a + (b - a) * golden;
                if (value(c) < value(e))
                    b = e;
                else
                    a = c;
            }
            min = std::min(min, value((a + b) / 2));
        }
        return min;
    }
};

/// The first hit among all pieces of a set.
struct FirstHit {
    uint32_t index = 0;
    PrimitiveHit hit;
};

inline std::optional<FirstHit> first_hit(const PrimitiveSet& set,
                                         const Vec3d& o,
                                         const Vec3d& d,
                                         float t_max = far_away) {
    std::optional<FirstHit> best;
    for (uint32_t i = 0; i < set.size(); ++i) {
        const auto hit = set.intersect(i, o, d, t_max);
        if (hit && (!best || hit->t < best->hit.t)) best = FirstHit{i, *hit};
    }
    return best;
}

inline scene::Curves bezier(std::vector<Vec3> points, std::vector<float> widths) {
    scene::Curves curves;
    curves.vertex_counts = {uint32_t(points.size())};
    curves.points = std::move(points);
    curves.width_interpolation =
        widths.size() == 1 ? scene::Interpolation::Constant : scene::Interpolation::Vertex;
    curves.widths = std::move(widths);
    return curves;
}

/// A Bézier curve of two segments, joined smoothly or with a kink.
inline scene::Curves some_curve(Random& random, int kind, double thickness) {
    std::vector<Vec3> p;
    std::vector<float> w;
    Vec3d at = random.in_cube(0.3), along = random.direction() * 0.4;
    for (int k = 0; k < 7; ++k) {
        p.push_back(to_float(at));
        w.push_back(float(thickness * (kind % 3 == 0 ? 1.0 : random.between(0.3, 1.0))));
        // Kinds that wriggle, that hardly bend, that double back
        const double turn = kind % 4 == 3 ? 1.5 : kind % 4 == 2 ? 0.1 : 0.5;
        if (k != 3 || kind % 2 == 0) along += random.in_cube(turn * 0.4);
        at += along;
    }
    // The joint in the middle of its neighbors: smooth
    if (kind % 2 == 1) p[4] = p[3] * 2.0f - p[2];
    return bezier(p, w);
}

}  // namespace velatura::geometry::test
