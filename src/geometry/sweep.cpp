// SPDX-License-Identifier: Apache-2.0
#include "geometry/sweep.h"

#include "geometry/bezier.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace velatura::geometry {

namespace {

double sqr(double x) {
    return x * x;
}

double min_of(const double c[4]) {
    return std::min(std::min(c[0], c[1]), std::min(c[2], c[3]));
}

double largest(const double c[4]) {
    return std::max(std::max(c[0], c[1]), std::max(c[2], c[3]));
}

/// Some unit vector perpendicular to a unit vector.
Vec3d perpendicular(const Vec3d& v) {
    const Vec3d axis = std::abs(v.x) < 0.6 ? Vec3d(1, 0, 0) : Vec3d(0, 1, 0);
    return normalize(v.cross(axis));
}

/// Largest value of a cubic.
double peak(const double c[4]) {
    double max = std::max(c[0], c[3]);
    if (largest(c) <= max) return max;
    // Where a·u² − 2b·u + d = 0
    const double d = c[1] - c[0], e = c[2] - c[1], f = c[3] - c[2];
    const double a = d - 2 * e + f, b = d - e;
    const double q = b + std::copysign(safe_sqrt(b * b - a * d), b);
    for (const double u : {q / a, d / q})
        if (u > 0 && u < 1) max = std::max(max, bezier_point(c, u));
    return max;
}

/// The curve at a place, in the frame of the line.
struct Place {
    double x, y, z, r, dx, dy, dz, dr;
};

void evaluate(const double c[4], double u, double& value, double& derivative) {
    const double v = 1.0 - u;
    const double a = c[0] * v + c[1] * u, b = c[1] * v + c[2] * u, d = c[2] * v + c[3] * u;
    const double e = a * v + b * u, f = b * v + d * u;
    value = e * v + f * u;
    derivative = 3.0 * (f - e);
}

}  // namespace

bool is_regular(const Sweep& sweep) {
    Vec3d first[3], second[2];
    double r_first[3], r_second[2];
    for (int i = 0; i < 3; ++i) {
        first[i] = (sweep.p[i + 1] - sweep.p[i]) * 3.0;
        r_first[i] = (sweep.r[i + 1] - sweep.r[i]) * 3.0;
    }
    for (int i = 0; i < 2; ++i) {
        second[i] = (first[i + 1] - first[i]) * 2.0;
        r_second[i] = (r_first[i + 1] - r_first[i]) * 2.0;
    }
    const Vec3d chord = sweep.p[3] - sweep.p[0];
    const double length = chord.length();
    double slowest = std::numeric_limits<double>::infinity(), fastest = 0, taper = 0;
    for (int i = 0; i < 3; ++i) {
        slowest = std::min(slowest, length > 0 ? first[i].dot(chord) / length : 0.0);
        fastest = std::max(fastest, first[i].length());
        taper = std::max(taper, std::abs(r_first[i]));
    }
    const double min_growth = std::min(r_first[0], std::min(r_first[1], r_first[2]));
    const double min_shrinking = -std::max(r_first[0], std::max(r_first[1], r_first[2]));
    if (std::max(min_growth, min_shrinking) >= fastest) return true;
    if (!(slowest > 0)) return false;
    // Of r'' + n·c'' what remains when the curve is run through evenly: its bend, and that of the
    // radius
    double bend = 0, widening = 0;
    for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < 2; ++k) {
            bend = std::max(bend, first[i].cross(second[k]).length());
            widening =
                std::max(widening, (first[i] * r_second[k] - second[k] * r_first[i]).length());
        }
    }
    const double thickest = largest(sweep.r);
    return sqr(slowest) - sqr(taper) > thickest * (bend + widening) / slowest;
}

Box3d bounds_of(const Sweep& sweep) {
    Box3d box;
    for (int k = 0; k < 3; ++k) {
        double lower[4], upper[4];
        for (int i = 0; i < 4; ++i) {
            lower[i] = sweep.r[i] - sweep.p[i][k];
            upper[i] = sweep.r[i] + sweep.p[i][k];
        }
        box.min[k] = -peak(lower);
        box.max[k] = peak(upper);
    }
    return box;
}

SweptRay::SweptRay(const Sweep& sweep, const Vec3d& o, const Vec3d& d) {
    length_ = std::sqrt(d.dot(d));
    along_ = d * (1.0 / length_);
    // The chord across the line in one plane with the line: the curve is then about as high in it
    // as it is bent
    const Vec3d chord = sweep.p[3] - sweep.p[0], out = along_.cross(chord);
    const double square = out.dot(out);
    const bool is_across = square > 0x1p-60 * chord.dot(chord);
    across_[1] = is_across ? out * (1.0 / std::sqrt(square)) : perpendicular(along_);
    across_[0] = across_[1].cross(along_);
    for (int i = 0; i < 4; ++i) {
        const Vec3d q = sweep.p[i] - o;
        x_[i] = q.dot(across_[0]);
        y_[i] = q.dot(across_[1]);
        z_[i] = q.dot(along_);
        r_[i] = sweep.r[i];
    }
    largest_r_ = largest(r_);
}

bool SweptRay::can_intersect(float t_max) const {
    const double r = largest_r_;
    return min_of(y_) <= r && largest(y_) >= -r && min_of(x_) <= r && largest(x_) >= -r &&
           largest(z_) + r > 0.0 && min_of(z_) - r <= double(t_max) * length_;
}

int SweptRay::find_stretches() {
    // Square of the radius less that of the distance, which is what the line is inside of a ball by
    const auto product = [&](int i, int k) {
        return r_[i] * r_[k] - x_[i] * x_[k] - y_[i] * y_[k];
    };
    const double g[7] = {product(0, 0),
                         product(0, 1),
                         0.4 * product(0, 2) + 0.6 * product(1, 1),
                         0.1 * product(0, 3) + 0.9 * product(1, 2),
                         0.4 * product(1, 3) + 0.6 * product(2, 2),
                         product(2, 3),
                         product(3, 3)};
    count_ = 0;
    add_stretches(g, 0.0, 1.0, 40);
    return count_;
}

void SweptRay::add_stretches(const double (&g)[7], double a, double b, int depth) {
    int changes = 0, top = 0;
    for (int i = 1; i < 7; ++i) {
        changes += (g[i] >= 0.0) != (g[i - 1] >= 0.0);
        if (g[i] > g[top]) top = i;
    }
    if (g[top] < 0.0) return;
    const bool begins_inside = g[0] >= 0.0, ends_inside = g[6] >= 0.0;
    if (changes <= 1) {
        // What goes on from where the last one ended is one with it
        Stretch* last = count_ > 0 ? &stretches_[count_ - 1] : nullptr;
        if (last && begins_inside && !last->is_open_b && last->b == a) {
            last->b = b;
            last->is_open_b = !ends_inside;
        } else if (count_ < 4) {
            stretches_[count_++] = {a, b, !begins_inside, !ends_inside, begins_inside ? a : b};
        }
        return;
    }
    // Touched at most, as far as numbers tell
    if (depth == 0) return;
    const double u = std::clamp(top / 6.0, 0.125, 0.875), middle = mixed(a, b, u);
    double left[7], right[7];
    bernstein_split(g, u, left, right);
    add_stretches(left, a, middle, depth - 1);
    add_stretches(right, middle, b, depth - 1);
}

SweepCrossing SweptRay::extremum(const Stretch& stretch, double side) const {
    Place at{};
    double square = 0;  // of half the chord within the ball
    const auto go_to = [&](double u) {
        evaluate(x_, u, at.x, at.dx);
        evaluate(y_, u, at.y, at.dy);
        evaluate(z_, u, at.z, at.dz);
        evaluate(r_, u, at.r, at.dr);
        square = (at.r - at.x) * (at.r + at.x) - sqr(at.y);
    };
    // The derivative of z ± root times the root, turned so that the extremum is where it falls
    // through zero: the least z − root of entries, the largest z + root of exits
    const auto rate = [&] { return at.r * at.dr - at.x * at.dx - at.y * at.dy; };
    const auto climb = [&] { return rate() + side * at.dz * safe_sqrt(square); };
    const auto crossing = [&](double u) {
        const double root = side * safe_sqrt(square);
        SweepCrossing c;
        c.t = (at.z + root) / length_;
        c.u = u;
        const Vec3d q = across_[0] * -at.x + across_[1] * -at.y + along_ * root;
        const double length = q.length();
        c.n = length > 0 ? q * (1.0 / length) : along_ * side;
        return c;
    };
    double lower = stretch.a, upper = stretch.b;
    if (!stretch.is_open_a) {
        go_to(lower);
        if (climb() <= 0.0) return crossing(lower);
    }
    if (!stretch.is_open_b) {
        go_to(upper);
        if (climb() >= 0.0) return crossing(upper);
    }
    // Begin where the chord is nearest to the line
    double u = x_[0] != x_[3] ? x_[0] / (x_[0] - x_[3]) : stretch.inside;
    if (!(u > lower && u < upper)) u = mixed(lower, upper, 0.5);
    double inside = stretch.inside;
    for (int i = 0; i < 200; ++i) {
        go_to(u);
        // In place of the curve its tangent cone
        const double b = rate(), w = -side * at.dz;
        const double a = sqr(at.dr) - sqr(at.dx) - sqr(at.dy), e = a - sqr(w);
        double step = 0;
        if (square < 0.0) {
            (u < inside ? lower : upper) = u;
        } else {
            inside = u;
            const double phi = b - w * std::sqrt(square);
            if (phi == 0.0) break;
            (phi > 0.0 ? lower : upper) = u;
        }
        const double disc = b * b - a * square;
        if (disc < 0.0) {
            step = -b / a;
        } else {
            const double s = w * std::sqrt(disc / -e);
            step = (s > 0.0) == (b > 0.0) ? (b * b - w * w * square) / (-e * (s + b)) : (s - b) / a;
        }
        double next = u + step;
        const bool is_good = next > lower && next < upper;
        // Every fourth step halves, whatever the others achieve
        if (!is_good || i % 4 == 3) {
            if (is_good && std::abs(step) < 0x1p-30) {
                u = next;
                go_to(u);
                break;
            }
            next = mixed(lower, upper, 0.5);
            if (!(next > lower && next < upper)) break;
        } else if (std::abs(step) < 0x1p-30) {
            u = next;
            go_to(u);
            break;
        }
        u = next;
    }
    return crossing(u);
}

}  // namespace velatura::geometry
