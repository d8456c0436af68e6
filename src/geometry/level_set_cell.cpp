// SPDX-License-Identifier: Apache-2.0
#include "geometry/level_set_cell.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace velatura::geometry {

namespace {

/// Exactly a or b at the ends.
double between(double a, double b, double t) {
    return a * (1.0 - t) + b * t;
}

/// c0 + c1·s + c2·s² + c3·s³: the numbers along a segment, but for rounding. Tells where they turn;
/// what they are is asked of the cell.
struct Cubic {
    double c1 = 0, c2 = 0, c3 = 0;

    double slope(double s) const { return (3.0 * c3 * s + 2.0 * c2) * s + c1; }

    /// Places in (0, 1) where the numbers turn, in order. Returns: how many.
    int turns(double out[2]) const {
        const double a = 3.0 * c3, b = c2, c = c1;  // a·s² + 2b·s + c
        const double discriminant = b * b - a * c;
        if (!(discriminant > 0.0)) return 0;
        const double q = -(b + std::copysign(std::sqrt(discriminant), b));
        double roots[2] = {q / a, c / q};
        if (roots[1] < roots[0]) std::swap(roots[0], roots[1]);
        int count = 0;
        // Division by zero gives what is not within
        for (const double s : roots)
            if (s > 0.0 && s < 1.0) out[count++] = s;
        return count;
    }
};

Cubic cubic_along(const std::array<double, 8>& v, const Vec3d& p, const Vec3d& e) {
    // number = … + x·kx + y·ky + z·kz + xy·kxy + yz·kyz + zx·kzx + xyz·kxyz
    const double kx = v[1] - v[0], ky = v[2] - v[0], kz = v[4] - v[0];
    const double kxy = (v[3] - v[2]) - kx, kyz = (v[6] - v[4]) - ky, kzx = (v[5] - v[1]) - kz;
    const double kxyz = ((v[7] - v[6]) - (v[5] - v[4])) - ((v[3] - v[2]) - (v[1] - v[0]));
    Cubic cubic;
    cubic.c3 = kxyz * e.x * e.y * e.z;
    cubic.c2 = kxy * e.x * e.y + kyz * e.y * e.z + kzx * e.z * e.x +
               kxyz * (p.x * e.y * e.z + p.y * e.x * e.z + p.z * e.x * e.y);
    cubic.c1 = kx * e.x + ky * e.y + kz * e.z + kxy * (p.x * e.y + p.y * e.x) +
               kyz * (p.y * e.z + p.z * e.y) + kzx * (p.z * e.x + p.x * e.z) +
               kxyz * (p.x * p.y * e.z + p.x * p.z * e.y + p.y * p.z * e.x);
    return cubic;
}

/// Numbers with a change of sides between them.
struct Bracket {
    double a, b;
    double at_a, at_b;
};

/// Where sides change: by Newton's steps where they stay within, by halves where not.
template <class Number, class Slope>
double refine(const Bracket& bracket, const Number& number, const Slope& slope) {
    constexpr int max_steps = 64;
    double a = bracket.a, b = bracket.b;
    double s = a + (b - a) * (bracket.at_a / (bracket.at_a - bracket.at_b));
    for (int i = 0; i < max_steps; ++i) {
        if (!(s > a && s < b)) s = 0.5 * (a + b);
        if (!(s > a && s < b)) break;
        const double f = number(s);
        const bool is_like_a = LevelSetCell::is_inside(f) == LevelSetCell::is_inside(bracket.at_a);
        (is_like_a ? a : b) = s;
        const double step = f / slope(s);
        if (std::abs(step) <= 0x1p-52) break;
        s -= step;
    }
    return std::clamp(s, a, b);
}

}  // namespace

bool LevelSetCell::is_mixed() const {
    const bool first = is_inside(corner[0]);
    for (const double v : corner)
        if (is_inside(v) != first) return true;
    return false;
}

double LevelSetCell::number(const Vec3d& p) const {
    const auto edge = [&](int i) { return between(corner[size_t(i)], corner[size_t(i) + 1], p.x); };
    return between(between(edge(0), edge(2), p.y), between(edge(4), edge(6), p.y), p.z);
}

Vec3d LevelSetCell::gradient(const Vec3d& p) const {
    const auto& v = corner;
    const auto plane = [](double a, double b, double c, double d, double s, double t) {
        return between(between(a, b, s), between(c, d, s), t);
    };
    return {plane(v[1] - v[0], v[3] - v[2], v[5] - v[4], v[7] - v[6], p.y, p.z),
            plane(v[2] - v[0], v[3] - v[1], v[6] - v[4], v[7] - v[5], p.x, p.z),
            plane(v[4] - v[0], v[5] - v[1], v[6] - v[2], v[7] - v[3], p.x, p.y)};
}

LevelSetCell::Crossings LevelSetCell::crossings(const Vec3d& p, const Vec3d& q) const {
    const Cubic cubic = cubic_along(corner, p, q - p);
    const auto at = [&](double s) {
        if (s <= 0.0) return number(p);
        if (s >= 1.0) return number(q);
        return number(p * (1.0 - s) + q * s);
    };

    // Between turns there is one crossing at most
    double ends[4] = {0.0};
    const int turns = cubic.turns(ends + 1);
    ends[turns + 1] = 1.0;
    Crossings found;
    double from = at(0.0);
    for (int i = 0; i <= turns; ++i) {
        const double to = at(ends[i + 1]);
        if (is_inside(from) != is_inside(to)) {
            const Bracket bracket{ends[i], ends[i + 1], from, to};
            found.at[size_t(found.count++)] =
                refine(bracket, at, [&](double s) { return cubic.slope(s); });
        }
        from = to;
    }
    return found;
}

}  // namespace velatura::geometry
