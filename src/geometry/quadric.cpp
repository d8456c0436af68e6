// SPDX-License-Identifier: Apache-2.0
#include "geometry/quadric.h"

#include "geometry/absolute.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace velatura::geometry {

namespace {

using Kind = scene::Gprim::Kind;

constexpr double infinity = std::numeric_limits<double>::infinity();

/// Largest sum of absolute values in a column: how much longer a vector's largest component grows.
double growth(const Mat3d& m) {
    double largest = 0;
    for (int k = 0; k < 3; ++k)
        largest = std::max(largest, std::abs(m[0][k]) + std::abs(m[1][k]) + std::abs(m[2][k]));
    return largest;
}

/// Roots of a·t² − 2b·t + c = 0 in order, given the root of the discriminant b² − a·c; one of them
/// is infinite where a is zero. False: no equation at all.
bool roots(double a, double b, double c, double root, double t[2]) {
    const double q = b + std::copysign(root, b);
    if (q == 0.0) {
        if (a == 0.0) return false;
        t[0] = t[1] = 0.0;
        return true;
    }
    t[0] = c / q;
    t[1] = q / a;
    if (t[1] < t[0]) std::swap(t[0], t[1]);
    return true;
}

}  // namespace

std::shared_ptr<const Quadric> Quadric::make(const scene::Gprim& gprim) {
    if (gprim.kind == Kind::Cube || gprim.kind == Kind::Plane) return nullptr;
    auto quadric = std::shared_ptr<Quadric>(new Quadric());
    Quadric& q = *quadric;
    q.kind_ = gprim.kind;
    const double ratio = gprim.kind == Kind::Sphere ? 0.0 : gprim.height / gprim.radius;
    const bool has_height = gprim.kind == Kind::Cylinder || gprim.kind == Kind::Cone;
    // Written so that NaN has no quadric
    if (!(gprim.radius > 0.0) || !(ratio <= largest_ratio)) return nullptr;
    if (!(ratio >= (has_height ? 1.0 / largest_ratio : 0.0))) return nullptr;
    q.half_ = gprim.kind == Kind::Cone ? ratio : 0.5 * ratio;
    const double height = q.half_ + (gprim.kind == Kind::Capsule ? 1.0 : 0.0);
    q.reach2_ = 1.0 + sqr(height);
    Mat4d shape_from_center = gprim.shape_from_gprim;
    if (gprim.kind == Kind::Cone) {
        Mat4d apex;
        apex.setTranslation(Vec3d(0.0, 0.0, 0.5 * gprim.height));
        shape_from_center = apex * shape_from_center;
    }
    if (!q.set_map(shape_from_center, gprim.radius)) return nullptr;
    q.set_bounds();
    return quadric;
}

const char* Quadric::kind() const {
    switch (kind_) {
        case Kind::Sphere:
            return "sphere";
        case Kind::Cylinder:
            return "cylinder";
        case Kind::Cone:
            return "cone";
        default:
            return "capsule";
    }
}

/// False when there is no inverse to speak of.
bool Quadric::set_map(const Mat4d& shape_from_gprim, double radius) {
    const Mat3d cofactors = cofactor_matrix(shape_from_gprim);
    const double det = determinant3(shape_from_gprim);
    if (!(std::abs(det) > 0.0)) return false;
    for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < 3; ++k) {
            forward_[i][k] = shape_from_gprim[i][k] * radius;
            backward_[i][k] = cofactors[k][i] / det / radius;
        }
    }
    origin_ = {shape_from_gprim[3][0], shape_from_gprim[3][1], shape_from_gprim[3][2]};
    round_trip_ = absolute(backward_) * absolute(forward_);
    const double size = growth(forward_);
    bounds_.condition = std::max(1.0, size * growth(backward_));
    // As much as squares of lengths of rays need that begin at coordinates below 2^126
    const bool fits = size > 0x1p-140 && size < 0x1p126 && absolute(origin_).length() < 0x1p126;
    // Directions and normals are rounded to float: by so much a ray that leaves along the surface
    // may go below it before it bends away
    slack_ = 0x1p-46 * size;
    return fits && bounds_.condition <= largest_ratio;
}

void Quadric::set_bounds() {
    const Mat3d& m = forward_;
    for (int k = 0; k < 3; ++k) {
        const double disc = std::sqrt(sqr(m[0][k]) + sqr(m[1][k]));
        double lower = -disc, upper = disc;
        const double along = std::abs(m[2][k]) * half_;
        switch (kind_) {
            case Kind::Sphere:
            case Kind::Capsule:
                upper = std::sqrt(sqr(disc) + sqr(m[2][k])) + along;
                lower = -upper;
                break;
            case Kind::Cone:
                lower = std::min(0.0, -m[2][k] * half_ - disc);
                upper = std::max(0.0, -m[2][k] * half_ + disc);
                break;
            default:
                lower -= along;
                upper += along;
                break;
        }
        const double pad =
            0x1p-44 * bounds_.condition * (upper - lower) + 0x1p-50 * std::abs(origin_[k]);
        bounds_.box.min[k] = origin_[k] + lower - pad;
        bounds_.box.max[k] = origin_[k] + upper + pad;
    }
}

Vec3d Quadric::to_canonical(const Vec3d& v) const {
    return v * backward_;
}

Vec3d Quadric::from_canonical(const Vec3d& v) const {
    return v * forward_;
}

Quadric::Line Quadric::line(const Vec3d& o, const Vec3d& d) const {
    Line line{to_canonical(o - origin_), to_canonical(d)};
    // Rays that start near keep their origin: which side of the surface it is on must not change
    if (line.o.dot(line.o) > 16.0 * reach2_) {
        line.moved = -line.o.dot(line.d) / line.d.dot(line.d);
        line.o += line.d * line.moved;
    }
    return line;
}

/// The unit ball around (0, 0, z). is_certain: the line is known to meet it, whatever rounding
/// says.
bool Quadric::intersect_sphere(const Line& line, double z, bool is_certain, Span& span) {
    const Vec3d o(line.o.x, line.o.y, line.o.z - z);
    const double a = line.d.dot(line.d), b = -o.dot(line.d);
    const Vec3d nearest = o + line.d * (b / a);
    double square = 1.0 - nearest.dot(nearest);
    if (is_certain) square = std::max(square, 0.0);
    if (!(square >= 0.0)) return false;
    const Face face = z > 0.0 ? Upper : z < 0.0 ? Lower : Side;
    span.face[0] = span.face[1] = face;
    return roots(a, b, o.dot(o) - 1.0, std::sqrt(a * square), span.t);
}

/// The endless tube of radius 1 around the z axis.
bool Quadric::intersect_tube(const Line& line, Span& span) {
    const Vec2d o(line.o.x, line.o.y), d(line.d.x, line.d.y);
    span.face[0] = span.face[1] = Side;
    const double a = d.dot(d), c = o.dot(o) - 1.0;
    // Along the axis the distance from it does not change as far as numbers tell
    if (!(a > 0x1p-200 * sqr(line.d.z))) {
        span.t[0] = -infinity;
        span.t[1] = infinity;
        return c <= 0.0;
    }
    const double b = -o.dot(d);
    const Vec2d nearest = o + d * (b / a);
    const double square = 1.0 - nearest.dot(nearest);
    return square >= 0.0 && roots(a, b, c, std::sqrt(a * square), span.t);
}

bool Quadric::intersect_slab(double o, double d, double lower, double upper, Span& span) {
    span.face[0] = d > 0.0 ? Lower : Upper;
    span.face[1] = d > 0.0 ? Upper : Lower;
    if (d == 0.0) {
        span.t[0] = -infinity;
        span.t[1] = infinity;
        return o >= lower && o <= upper;
    }
    span.t[0] = ((d > 0.0 ? lower : upper) - o) / d;
    span.t[1] = ((d > 0.0 ? upper : lower) - o) / d;
    return true;
}

/// Narrows b to where the line is inside of both.
bool Quadric::intersect_both(const Span& a, Span& b) {
    if (a.t[0] >= b.t[0]) {
        b.t[0] = a.t[0];
        b.face[0] = a.face[0];
    }
    if (a.t[1] <= b.t[1]) {
        b.t[1] = a.t[1];
        b.face[1] = a.face[1];
    }
    return b.t[0] <= b.t[1];
}

/// Apex at the origin, base at z = −half_.
bool Quadric::intersect_cone(const Line& line, Span& span) const {
    // x² + y² <= w², w being the distance below the apex, 1 at the base
    const double k = 1.0 / half_;
    const Vec3d o(line.o.x, line.o.y, -line.o.z * k), d(line.d.x, line.d.y, -line.d.z * k);
    const double a = d.x * d.x + d.y * d.y - d.z * d.z;
    const double b = -(o.x * d.x + o.y * d.y - o.z * d.z);
    const double c = o.x * o.x + o.y * o.y - o.z * o.z;
    // Lagrange's identity: b² − a·c without the cancellation between the two
    const Vec3d m = o.cross(d);
    const double across = std::hypot(m.x, m.y);
    const double square = (across - m.z) * (across + m.z);
    Span cone;
    cone.face[0] = cone.face[1] = Side;
    if (a < 0.0) {
        // Steeper than the slope: in both cones, endless in each
        if (!roots(a, b, c, std::sqrt(std::max(square, 0.0)), cone.t)) return false;
        if (d.z > 0.0) {
            cone.t[0] = cone.t[1];
            cone.t[1] = infinity;
        } else {
            cone.t[1] = cone.t[0];
            cone.t[0] = -infinity;
        }
    } else {
        if (!(square >= 0.0) || !roots(a, b, c, std::sqrt(square), cone.t)) return false;
    }
    // Which also leaves out the cone above the apex
    if (!intersect_slab(o.z, d.z, 0.0, 1.0, span)) return false;
    for (Face& face : span.face) face = face == Lower ? Side : Lower;
    return intersect_both(cone, span);
}

bool Quadric::intersect_capsule(const Line& line, Span& span) const {
    Span tube;
    if (!intersect_tube(line, tube)) return false;
    const auto face_at = [&](double t) {
        const double z = line.o.z + t * line.d.z;
        return z > half_ ? Upper : z < -half_ ? Lower : Side;
    };
    const Face first = face_at(tube.t[0]), last = face_at(tube.t[1]);
    // Between two faces the line passes the disc where they meet
    const bool is_certain = first != last;
    span = tube;
    const auto end_at = [&](Face face, int end) {
        if (face == Side) return true;
        Span sphere;
        if (!intersect_sphere(line, face == Upper ? half_ : -half_, is_certain, sphere))
            return false;
        span.t[end] = sphere.t[end];
        span.face[end] = face;
        return true;
    };
    return end_at(first, 0) && end_at(last, 1);
}

bool Quadric::intersect_primitive(const Line& line, Span& span) const {
    switch (kind_) {
        case Kind::Sphere:
            return intersect_sphere(line, 0.0, false, span);
        case Kind::Capsule:
            return intersect_capsule(line, span);
        case Kind::Cone:
            return intersect_cone(line, span);
        default: {
            Span tube;
            return intersect_tube(line, tube) &&
                   intersect_slab(line.o.z, line.d.z, -half_, half_, span) &&
                   intersect_both(tube, span);
        }
    }
}

std::optional<PrimitiveHit> Quadric::intersect(uint32_t,
                                               const Vec3d& o,
                                               const Vec3d& d,
                                               float t_max) const {
    const Line l = line(o, d);
    Span span;
    if (!intersect_primitive(l, span)) return std::nullopt;
    for (const double end : span.t) {
        const double t = l.moved + end;
        if (!(float(t) > 0.0f)) continue;
        if (!(float(t) < t_max)) return std::nullopt;
        return PrimitiveHit{t};
    }
    return std::nullopt;
}

/// The nearest point of a face, about.
Vec3d Quadric::put_on(Face face, const Vec3d& p) const {
    const auto in_height = [&](double z) { return std::clamp(z, -half_, half_); };
    const double r = std::hypot(p.x, p.y);
    switch (kind_) {
        case Kind::Sphere:
            return p / p.length();
        case Kind::Cone: {
            if (face == Lower) return {p.x, p.y, -half_};
            const double z = std::clamp(p.z, -half_, 0.0), scale = r > 0.0 ? -z / (half_ * r) : 0.0;
            return {p.x * scale, p.y * scale, z};
        }
        case Kind::Capsule: {
            if (face == Side) return {p.x / r, p.y / r, in_height(p.z)};
            const Vec3d center(0.0, 0.0, face == Upper ? half_ : -half_);
            const Vec3d out = p - center;
            return center + out / out.length();
        }
        default:
            if (face == Side) return {p.x / r, p.y / r, in_height(p.z)};
            return {p.x, p.y, face == Upper ? half_ : -half_};
    }
}

/// Gradient of what is zero on the face, and the diagonal of its derivative by p.
Vec3d Quadric::canonical_normal(Face face, const Vec3d& p, Vec3d& by_p) const {
    by_p = Vec3d(1.0, 1.0, 0.0);
    const Vec3d across(p.x, p.y, 0.0);
    switch (kind_) {
        case Kind::Sphere:
            by_p.z = 1.0;
            return p;
        case Kind::Cone: {
            const double k2 = 1.0 / sqr(half_);
            by_p.z = -k2;
            if (face == Lower) break;
            const bool is_apex = p.x == 0.0 && p.y == 0.0;
            return is_apex ? Vec3d(0.0, 0.0, 1.0) : Vec3d(p.x, p.y, -k2 * p.z);
        }
        case Kind::Capsule:
            if (face == Side) return across;
            by_p.z = 1.0;
            return p - Vec3d(0.0, 0.0, face == Upper ? half_ : -half_);
        default:
            if (face == Side) return across;
            break;
    }
    by_p = Vec3d(0.0);
    return {0.0, 0.0, face == Upper ? 1.0 : -1.0};
}

PrimitiveSurface Quadric::surface(uint32_t,
                                  const Vec3d& o,
                                  const Vec3d& d,
                                  const PrimitiveHit& hit) const {
    const Line l = line(o, d);
    Span span;
    // A line that misses by rounding grazes: its nearest point is the place
    if (!intersect_primitive(l, span)) span.t[0] = span.t[1] = -l.o.dot(l.d) / l.d.dot(l.d);
    const double t = hit.t - l.moved;
    const int end = std::abs(span.t[0] - t) <= std::abs(span.t[1] - t) ? 0 : 1;
    const Vec3d p = put_on(span.face[end], l.o + l.d * span.t[end]);

    PrimitiveSurface surface;
    surface.face = span.face[end];
    const Vec3d from_origin = from_canonical(p);
    surface.p = origin_ + from_origin;
    constexpr double double_error = 16.0 * 0x1p-53;
    surface.error = (absolute(origin_) + absolute(p) * absolute(forward_) +
                     absolute(from_origin) * round_trip_) *
                        double_error +
                    Vec3d(slack_);
    // Gradients go the other way: they are covectors
    Vec3d by_p;
    const Mat3d covector = backward_.transposed();
    surface.n = canonical_normal(span.face[end], p, by_p) * covector;
    Mat3d diagonal;
    for (int k = 0; k < 3; ++k) diagonal[k][k] = by_p[k];
    surface.normal_by_p = backward_ * diagonal * covector;
    return surface;
}

bool Quadric::tangents(
    uint32_t, uint32_t face, const Vec3d& p, const PrimitiveHit&, Vec3d& dpdu, Vec3d& dpdv) const {
    // Around the axis, and from the lower pole to the upper one
    Vec3d q = to_canonical(p - origin_);
    const Vec3d around(-q.y, q.x, 0.0);
    Vec3d up(0.0, 0.0, 1.0);
    const bool is_ball = kind_ == Kind::Sphere || (kind_ == Kind::Capsule && face != Side);
    if (is_ball) {
        if (kind_ == Kind::Capsule) q.z -= face == Upper ? half_ : -half_;
        up = q.cross(around);
    } else if (face != Side) {
        up = Vec3d(q.x, q.y, 0.0) * (face == Upper ? -1.0 : 1.0);
    } else if (kind_ == Kind::Cone) {
        up = -q;
    }
    dpdu = from_canonical(around);
    dpdv = from_canonical(up);
    return around != Vec3d(0.0) && up != Vec3d(0.0);
}

double Quadric::area(uint32_t) const {
    double area = 4.0 * pi_d;
    if (kind_ == Kind::Capsule) area += 4.0 * pi_d * half_;
    if (kind_ == Kind::Cylinder) area = 4.0 * pi_d * half_ + 2.0 * pi_d;
    if (kind_ == Kind::Cone) area = pi_d * std::sqrt(1.0 + sqr(half_)) + pi_d;
    return area * std::cbrt(sqr(forward_.determinant()));
}

Vec3d Quadric::point(uint32_t, const Vec2d& u) const {
    const double turn = 2.0 * pi_d * u.y, c = std::cos(turn), s = std::sin(turn);
    const auto at = [&](double r, double z) { return origin_ + from_canonical({r * c, r * s, z}); };
    const double slope = std::sqrt(1.0 + sqr(half_));
    double x = u.x;
    // Of each kind the part by its share of the area, then the place within
    switch (kind_) {
        case Kind::Cone: {
            const double side = slope / (slope + 1.0);
            if (x >= side) return at(std::sqrt((x - side) / (1.0 - side)), -half_);
            const double r = std::sqrt(x / side);
            return at(r, -half_ * r);
        }
        case Kind::Cylinder: {
            const double side = 2.0 * half_ / (2.0 * half_ + 1.0);
            if (x < side) return at(1.0, half_ * (2.0 * x / side - 1.0));
            x = 2.0 * (x - side) / (1.0 - side);
            return x < 1.0 ? at(std::sqrt(x), -half_)
                           : at(std::sqrt(std::min(x - 1.0, 1.0)), half_);
        }
        default: {
            // By Archimedes a ball and a tube have equal areas between equal heights
            const double z = (2.0 * x - 1.0) * (1.0 + half_);
            const double beyond = std::max(std::abs(z) - half_, 0.0);
            return at(safe_sqrt(1.0 - sqr(beyond)), z);
        }
    }
}

}  // namespace velatura::geometry
