// SPDX-License-Identifier: Apache-2.0
#include "geometry/ribbons.h"

#include "geometry/absolute.h"
#include "geometry/bezier.h"

#include <algorithm>
#include <cmath>

namespace velatura::geometry {

namespace {

double cross(const Vec2d& a, const Vec2d& b) {
    return a.x * b.y - a.y * b.x;
}

/// Two unit vectors across a unit one, by its own numbers alone. Ref: Duff et al. 2017.
void make_frame(const Vec3d& n, Vec3d& x, Vec3d& y) {
    const double sign = std::copysign(1.0, n.z);
    const double a = -1.0 / (sign + n.z), b = n.x * n.y * a;
    x = {1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x};
    y = {b, sign + n.y * n.y * a, -n.y};
}

/// The edges of a piece across a line: where they are in one plane with it is zero.
struct Turning {
    Vec2d left[4], right[4];

    double operator()(double u) const {
        return cross(bezier_point(left, u), bezier_point(right, u));
    }

    double derivative(double u) const {
        return cross(bezier_derivative(left, u), bezier_point(right, u)) +
               cross(bezier_point(left, u), bezier_derivative(right, u));
    }
};

/// Finds roots of a polynomial of degree 6 by its Bernstein coefficients, and refines them by f,
/// the same polynomial. Roots that it only touches are none: it is not crossed.
class RootFinder {
  public:
    explicit RootFinder(const Turning& f) : f_(f) {}

    int find(const double (&c)[7], double roots[6]) {
        roots_ = roots;
        isolate(c, 0.0, 1.0, 40);
        return count_;
    }

  private:
    void isolate(const double (&c)[7], double a, double b, int depth) {
        int changes = 0;
        for (int i = 1; i < 7; ++i) changes += (c[i] >= 0.0) != (c[i - 1] >= 0.0);
        if (changes == 0 || depth == 0 || count_ == 6) return;
        if (changes == 1) {
            roots_[count_++] = refined(a, b, c[0] >= 0.0);
            return;
        }
        double left[7], right[7];
        bernstein_split(c, 0.5, left, right);
        const double middle = 0.5 * (a + b);
        isolate(left, a, middle, depth - 1);
        isolate(right, middle, b, depth - 1);
    }

    /// The root between a and b, where f changes sign: Newton's steps, kept within a bracket.
    double refined(double a, double b, bool begins_above) const {
        const double fa = f_(a), fb = f_(b);
        // As the coefficients say, whatever rounding makes of f at the ends
        if ((fa >= 0.0) != begins_above) return a;
        if ((fb >= 0.0) == begins_above) return b;
        double u = (a * fb - b * fa) / (fb - fa);
        if (!(u > a && u < b)) u = 0.5 * (a + b);
        for (int i = 0; i < 200; ++i) {
            const double fu = f_(u);
            ((fu >= 0.0) == begins_above ? a : b) = u;
            const double step = -fu / f_.derivative(u), next = u + step;
            const bool is_good = next > a && next < b;
            // Roundoff: the next step would be the square of this one
            if (fu == 0.0 || (is_good && std::abs(step) < 0x1p-30)) return fu == 0.0 ? u : next;
            // Every fourth step halves, whatever the others achieve
            u = is_good && i % 4 != 3 ? next : 0.5 * (a + b);
            if (!(u > a && u < b)) break;
        }
        return u;
    }

    const Turning& f_;
    double* roots_ = nullptr;
    int count_ = 0;
};

/// Largest value of a cubic by its hull.
double hull_peak(const Vec3d c[4], int axis, double sign) {
    double max = sign * c[0][axis];
    for (int i = 1; i < 4; ++i) max = std::max(max, sign * c[i][axis]);
    return max;
}

}  // namespace

int Ribbons::intersect_primitive(const Edges& edges,
                                 const Vec3d& o,
                                 const Vec3d& d,
                                 Intersection out[6]) {
    const double length = std::sqrt(d.dot(d));
    const Vec3d along = d * (1.0 / length);
    Vec3d x(0.0), y(0.0);
    make_frame(along, x, y);
    Turning turning;
    Vec2d min(1e300), max(-1e300);
    const auto place = [&](const Vec3d& p) {
        const Vec3d q = p - o;
        const Vec2d across(q.dot(x), q.dot(y));
        min = {std::min(min.x, across.x), std::min(min.y, across.y)};
        max = {std::max(max.x, across.x), std::max(max.y, across.y)};
        return across;
    };
    for (int i = 0; i < 4; ++i) {
        turning.left[i] = place(edges.left[i]);
        turning.right[i] = place(edges.right[i]);
    }
    if (min.x > 0.0 || min.y > 0.0 || max.x < 0.0 || max.y < 0.0) return 0;
    const auto pair = [&](int i, int k) {
        return cross(turning.left[i], turning.right[k]) +
               (i != k ? cross(turning.left[k], turning.right[i]) : 0.0);
    };
    const double c[7] = {pair(0, 0),
                         0.5 * pair(0, 1),
                         0.2 * pair(0, 2) + 0.6 * pair(1, 1),
                         0.05 * pair(0, 3) + 0.45 * pair(1, 2),
                         0.2 * pair(1, 3) + 0.6 * pair(2, 2),
                         0.5 * pair(2, 3),
                         pair(3, 3)};
    double roots[6];
    const int found = RootFinder(turning).find(c, roots);
    int count = 0;
    for (int i = 0; i < found; ++i) {
        const double u = roots[i];
        const Vec2d left = bezier_point(turning.left, u);
        const Vec2d side = bezier_point(turning.right, u) - left;
        const double square = side.dot(side);
        const double across = square > 0.0 ? -left.dot(side) / square : -1.0;
        if (!(across >= 0.0 && across <= 1.0)) continue;
        const Vec3d p = mixed(bezier_point(edges.left, u), bezier_point(edges.right, u), across);
        out[count++] = {(p - o).dot(along) / length, u, across};
    }
    return count;
}

Ribbons::Edges Ribbons::edges(uint32_t index) const {
    Edges edges;
    const Control* control = &controls_[pieces_[index].first];
    for (int i = 0; i < 4; ++i) {
        edges.left[i] = Vec3d(control[i].left);
        edges.right[i] = Vec3d(control[i].right);
    }
    return edges;
}

PrimitiveBounds Ribbons::bounds(uint32_t index) const {
    const Edges e = edges(index);
    PrimitiveBounds bounds;
    for (int k = 0; k < 3; ++k) {
        const double lower = -std::max(hull_peak(e.left, k, -1.0), hull_peak(e.right, k, -1.0));
        const double upper = std::max(hull_peak(e.left, k, 1.0), hull_peak(e.right, k, 1.0));
        bounds.box.min[k] = lower;
        bounds.box.max[k] = upper;
    }
    const Vec3d size = bounds.box.size();
    const double longest = std::max(size.x, std::max(size.y, size.z));
    for (int k = 0; k < 3; ++k) {
        const double far = std::max(std::abs(bounds.box.min[k]), std::abs(bounds.box.max[k]));
        const double pad = 0x1p-44 * longest + 0x1p-50 * far;
        bounds.box.min[k] -= pad;
        bounds.box.max[k] += pad;
    }
    return bounds;
}

std::optional<PrimitiveHit> Ribbons::intersect(uint32_t index,
                                               const Vec3d& o,
                                               const Vec3d& d,
                                               float t_max) const {
    const Piece& piece = pieces_[index];
    if (piece.bound.is_missed(o, d, t_max)) return std::nullopt;
    Intersection meetings[6];
    const int count = intersect_primitive(edges(index), o, d, meetings);
    const Intersection* best = nullptr;
    for (int i = 0; i < count; ++i) {
        const auto t = float(meetings[i].t);
        if (t > 0.0f && t < t_max && (!best || meetings[i].t < best->t)) best = &meetings[i];
    }
    if (!best) return std::nullopt;
    return PrimitiveHit{best->t, float(mixed(piece.begin(), piece.end(), best->u)),
                        float(best->across)};
}

PrimitiveSurface Ribbons::surface(uint32_t index,
                                  const Vec3d& o,
                                  const Vec3d& d,
                                  const PrimitiveHit& hit) const {
    const Piece& piece = pieces_[index];
    const Edges e = edges(index);
    Intersection meetings[6];
    const int count = intersect_primitive(e, o, d, meetings);
    // A line that misses by rounding: the place as it was found
    Intersection place{
        hit.t,
        std::clamp((double(hit.u) - piece.begin()) / (piece.end() - piece.begin()), 0.0, 1.0),
        double(hit.v)};
    for (int i = 0; i < count; ++i) {
        const bool is_nearer = std::abs(meetings[i].t - hit.t) < std::abs(place.t - hit.t);
        if (i == 0 || is_nearer) place = meetings[i];
    }
    const double u = place.u, w = place.across;
    PrimitiveSurface surface;
    surface.p = mixed(bezier_point(e.left, u), bezier_point(e.right, u), w);
    const double size = (e.left[3] - e.left[0]).length() + (e.right[0] - e.left[0]).length() +
                        (e.right[3] - e.left[3]).length();
    surface.error = (absolute(surface.p) + Vec3d(size)) * (16.0 * 0x1p-53) + Vec3d(0x1p-46 * size);

    // The normal is that of the ruled surface, n = side × along
    const auto both = [&](auto derivative) {
        return mixed(derivative(e.left, u), derivative(e.right, u), w);
    };
    const Vec3d along = both([](const Vec3d* c, double v) { return bezier_derivative(c, v); });
    const Vec3d bend = both([](const Vec3d* c, double v) { return bezier_second(c, v); });
    const Vec3d side = bezier_point(e.right, u) - bezier_point(e.left, u);
    const Vec3d twist = bezier_derivative(e.right, u) - bezier_derivative(e.left, u);
    surface.n = side.cross(along);
    const double square = surface.n.dot(surface.n);
    surface.normal_by_p = Mat3d(0.0);
    if (!(square > 0.0)) {
        // A tip of no width
        surface.n = std::abs(along.x) < std::abs(along.y) ? along.cross(Vec3d(1, 0, 0))
                                                          : along.cross(Vec3d(0, 1, 0));
        if (surface.n == Vec3d(0.0)) surface.n = Vec3d(0, 0, 1);
        return surface;
    }
    const Vec3d by_u = (along * side.dot(side) - side * along.dot(side)) * (1.0 / square);
    const Vec3d by_w = (side * along.dot(along) - along * along.dot(side)) * (1.0 / square);
    const Vec3d n_u = twist.cross(along) + side.cross(bend), n_w = side.cross(twist);
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) surface.normal_by_p[i][k] = by_u[i] * n_u[k] + by_w[i] * n_w[k];
    return surface;
}

bool Ribbons::tangents(uint32_t index,
                       uint32_t,
                       const Vec3d&,
                       const PrimitiveHit& hit,
                       Vec3d& dpdu,
                       Vec3d& dpdv) const {
    const Piece& piece = pieces_[index];
    const Edges e = edges(index);
    const double u =
        std::clamp((double(hit.u) - piece.begin()) / (piece.end() - piece.begin()), 0.0, 1.0);
    dpdu = mixed(bezier_derivative(e.left, u), bezier_derivative(e.right, u), double(hit.v));
    dpdv = bezier_point(e.right, u) - bezier_point(e.left, u);
    return dpdu.cross(dpdv) != Vec3d(0.0);
}

bool Ribbons::fiber(uint32_t index, const PrimitiveHit& hit, PrimitiveFiber& out) const {
    const Edges e = edges(index);
    const double u = std::clamp(
        (double(hit.u) - pieces_[index].begin()) / (pieces_[index].end() - pieces_[index].begin()),
        0.0, 1.0);
    const Vec3d left = bezier_point(e.left, u), right = bezier_point(e.right, u);
    out.middle = mixed(left, right, 0.5);
    out.along = mixed(bezier_derivative(e.left, u), bezier_derivative(e.right, u), 0.5);
    out.side = right - left;
    return out.along.cross(out.side) != Vec3d(0.0);
}

PrimvarRows Ribbons::primvar_rows(uint32_t index,
                                  scene::Interpolation interpolation,
                                  const PrimitiveHit& hit) const {
    return rows_.rows(pieces_[index].segment, interpolation, hit.u);
}

size_t Ribbons::bytes() const {
    return sizeof(*this) + rows_.bytes() + controls_.capacity() * sizeof(Control) +
           pieces_.capacity() * sizeof(Piece);
}

double Ribbons::area(uint32_t index) const {
    const Edges e = edges(index);
    constexpr int steps = 4;
    double area = 0;
    for (int i = 0; i < steps; ++i) {
        const double u = (i + 0.5) / steps;
        const Vec3d along = mixed(bezier_derivative(e.left, u), bezier_derivative(e.right, u), 0.5);
        area += along.cross(bezier_point(e.right, u) - bezier_point(e.left, u)).length() / steps;
    }
    return area;
}

Vec3d Ribbons::point(uint32_t index, const Vec2d& u) const {
    const Edges e = edges(index);
    return mixed(bezier_point(e.left, u.x), bezier_point(e.right, u.x), u.y);
}

}  // namespace velatura::geometry
