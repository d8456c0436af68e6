// SPDX-License-Identifier: Apache-2.0
#include "geometry/round_curves.h"

#include "geometry/absolute.h"
#include "geometry/bezier.h"

#include <algorithm>
#include <cmath>

namespace velatura::geometry {

namespace {

constexpr uint32_t max_levels = 12;  // of division

// Of division for the sake of boxes: so often, and only where it makes the sum of their areas this
// much smaller.
constexpr uint32_t max_box_levels = 2;
constexpr double worthwhile = 0.7;

// By how much of the radius a straight piece may stray from its curve.
constexpr double straightness = 0x1p-10;

// Derivatives in the neighbor's direction that are smaller are taken for none: what is filled by
// less than that is no wall that anyone could see, and rounding must not open joints.
constexpr double filled = 0x1p-30;

double thickest(const Sweep& s) {
    return std::max(std::max(s.r[0], s.r[1]), std::max(s.r[2], s.r[3]));
}

double half_area(const Box3d& box) {
    const Vec3d size = box.size();
    return size.x * size.y + size.y * size.z + size.z * size.x;
}

Sweep part_of(const Sweep& s, double a, double b) {
    Sweep part;
    bezier_part(s.p, a, b, part.p);
    bezier_part(s.r, a, b, part.r);
    return part;
}

void straighten(Sweep& s) {
    for (int i = 1; i < 3; ++i) {
        s.p[i] = mixed(s.p[0], s.p[3], i / 3.0);
        s.r[i] = mixed(s.r[0], s.r[3], i / 3.0);
    }
}

bool is_straight(const Sweep& s) {
    Sweep straight = s;
    straighten(straight);
    double max = 0;
    for (int i = 1; i < 3; ++i)
        max = std::max(max, (s.p[i] - straight.p[i]).length() + std::abs(s.r[i] - straight.r[i]));
    return max <= straightness * thickest(s);
}

/// How point and radius change from an end of a curve into it: the first difference that is one.
void leave(const Sweep& s, bool at_end, Vec3d& dp, double& dr) {
    const int end = at_end ? 3 : 0;
    for (int i = 1; i < 4; ++i) {
        const int other = at_end ? 3 - i : i;
        dp = s.p[other] - s.p[end];
        dr = s.r[other] - s.r[end];
        if (dp != Vec3d(0.0) || dr != 0.0) return;
    }
}

/// What a line is inside of: from the entry of one ball to the exit of another.
struct Span {
    SweepCrossing in, out;
};

/// The crossings of several stretches of a sweep, what overlaps made one, in order. Returns: their
/// number.
int joined_spans(const SweptRay& ray, int stretches, Span spans[4]) {
    for (int i = 0; i < stretches; ++i) spans[i] = {ray.entry(i), ray.exit(i)};
    std::sort(spans, spans + stretches,
              [](const Span& a, const Span& b) { return a.in.t < b.in.t; });
    int count = 0;
    for (int i = 0; i < stretches; ++i) {
        if (count > 0 && spans[i].in.t <= spans[count - 1].out.t) {
            if (spans[i].out.t > spans[count - 1].out.t) spans[count - 1].out = spans[i].out;
        } else {
            spans[count++] = spans[i];
        }
    }
    return count;
}

}  // namespace

std::shared_ptr<const RoundCurves> RoundCurves::make(const scene::Curves& curves) {
    std::shared_ptr<RoundCurves> set(new RoundCurves(curves));
    return set->pieces_.empty() ? nullptr : set;
}

RoundCurves::RoundCurves(const scene::Curves& curves) : rows_(curves) {
    set_controls(curves);
    for (uint32_t curve = 0; curve < rows_.curve_count(); ++curve) {
        first_piece_.push_back(uint32_t(pieces_.size()));
        for (uint32_t i = 0; i < rows_.segment_count(curve); ++i)
            divide(rows_.first_segment(curve) + i, 0, 0);
    }
    first_piece_.push_back(uint32_t(pieces_.size()));
    join_pieces();
    pieces_.shrink_to_fit();
}

void RoundCurves::set_controls(const scene::Curves& curves) {
    first_control_.reserve(rows_.segment_count());
    controls_.reserve(3 * size_t(rows_.segment_count()) + rows_.curve_count());
    const auto width = [&](uint32_t row) { return double(curves.widths[row]); };
    for (uint32_t curve = 0; curve < rows_.curve_count(); ++curve) {
        const auto curve_start = uint32_t(controls_.size());
        for (uint32_t i = 0; i < rows_.segment_count(curve); ++i) {
            const uint32_t segment = rows_.first_segment(curve) + i;
            const CurveRows::Stencil stencil = rows_.vertices(segment);
            Vec3d p[4] = {Vec3d(0.0), Vec3d(0.0), Vec3d(0.0), Vec3d(0.0)};
            double r[4] = {0, 0, 0, 0};
            for (int k = 0; k < 4; ++k) {
                for (int j = 0; j < 4; ++j) {
                    p[k] += Vec3d(curves.points[stencil.row[j]]) * stencil.weight[k][j];
                    if (curves.width_interpolation == scene::Interpolation::Vertex)
                        r[k] += 0.5 * width(stencil.row[j]) * stencil.weight[k][j];
                }
                if (curves.width_interpolation == scene::Interpolation::Vertex) {
                    // Where the basis overshoots
                    r[k] = std::max(r[k], 0.0);
                    continue;
                }
                const PrimvarRows rows =
                    rows_.rows(segment, curves.width_interpolation, float(k) / 3.0f);
                r[k] = 0.5 * width(rows.row[0]);
                if (rows.count == 2)
                    r[k] = 0.5 * mixed(width(rows.row[0]), width(rows.row[1]), k / 3.0);
            }
            first_control_.push_back(uint32_t(controls_.size() - (i > 0)));
            const bool closes = rows_.is_periodic() && i + 1 == rows_.segment_count(curve);
            for (int k = i > 0; k < 4; ++k) controls_.push_back({to_float(p[k]), float(r[k])});
            // Joined to the bit
            if (closes) controls_.back() = controls_[curve_start];
        }
    }
}

Sweep RoundCurves::segment_sweep(uint32_t segment) const {
    Sweep sweep;
    const Control* control = &controls_[first_control_[segment]];
    for (int i = 0; i < 4; ++i) {
        sweep.p[i] = Vec3d(control[i].p);
        sweep.r[i] = double(control[i].r);
    }
    // Inner control points are rounded to float, which would bend it
    if (rows_.is_linear()) straighten(sweep);
    return sweep;
}

Sweep RoundCurves::sweep_of(const Piece& piece) const {
    Sweep sweep = segment_sweep(piece.segment);
    if (piece.level > 0) sweep = part_of(sweep, piece.begin(), piece.end());
    if (piece.is_straight) straighten(sweep);
    return sweep;
}

/// Makes pieces of a part of a segment.
void RoundCurves::divide(uint32_t segment, uint32_t part, uint32_t level) {
    Piece piece{segment, part, level, 0, 0, 0, {}};
    const Sweep sweep = sweep_of(piece);
    const bool is_point =
        sweep.p[0] == sweep.p[1] && sweep.p[1] == sweep.p[2] && sweep.p[2] == sweep.p[3];
    if (is_point || !(thickest(sweep) > 0)) return;
    bool is_whole = is_regular(sweep);
    if (!is_whole && (is_straight(sweep) || level == max_levels)) {
        piece.is_straight = 1;
        is_whole = true;
    } else if (is_whole && level < max_box_levels) {
        const double parts = half_area(bounds_of(part_of(sweep, 0.0, 0.5))) +
                             half_area(bounds_of(part_of(sweep, 0.5, 1.0)));
        is_whole = parts > worthwhile * half_area(bounds_of(sweep));
    }
    if (is_whole) {
        piece.bound = ChordBound(sweep.p, thickest(sweep));
        pieces_.push_back(piece);
        return;
    }
    divide(segment, 2 * part, level + 1);
    divide(segment, 2 * part + 1, level + 1);
}

/// Whether one piece ends where the other begins; what is between may have been a point.
bool RoundCurves::join(const Piece& before, const Piece& after) const {
    const Sweep a = sweep_of(before), b = sweep_of(after);
    return a.p[3] == b.p[0] && a.r[3] == b.r[0];
}

void RoundCurves::join_pieces() {
    for (uint32_t curve = 0; curve < rows_.curve_count(); ++curve) {
        const uint32_t first = first_piece_[curve], end = first_piece_[curve + 1];
        for (uint32_t i = first; i < end; ++i) {
            const bool is_last = i + 1 == end;
            if (is_last && !rows_.is_periodic()) continue;
            Piece& next = pieces_[is_last ? first : i + 1];
            pieces_[i].joins_after = next.joins_before = join(pieces_[i], next);
        }
    }
}

PrimitiveBounds RoundCurves::bounds(uint32_t index) const {
    const Sweep sweep = sweep_of(pieces_[index]);
    PrimitiveBounds bounds;
    bounds.box = bounds_of(sweep);
    const Vec3d size = bounds.box.size();
    const double max = std::max(size.x, std::max(size.y, size.z));
    for (int k = 0; k < 3; ++k) {
        const double pad = 0x1p-44 * max + 0x1p-50 * std::max(std::abs(bounds.box.min[k]),
                                                              std::abs(bounds.box.max[k]));
        bounds.box.min[k] -= pad;
        bounds.box.max[k] += pad;
    }
    return bounds;
}

/// Whether a place on the ball at an end of a piece is inside of what goes on there.
bool RoundCurves::is_filled(uint32_t index, const SweepCrossing& crossing) const {
    const bool at_start = crossing.u == 0.0, at_end = crossing.u == 1.0;
    const Piece& piece = pieces_[index];
    if (!(at_start && piece.joins_before) && !(at_end && piece.joins_after)) return false;
    uint32_t other = at_start ? index - 1 : index + 1;
    if (rows_.is_periodic()) {
        const uint32_t curve = rows_.curve(piece.segment);
        const uint32_t first = first_piece_[curve], end = first_piece_[curve + 1];
        if (at_start && index == first) other = end - 1;
        if (at_end && index + 1 == end) other = first;
    }
    Vec3d dp(0.0);
    double dr = 0;
    leave(sweep_of(pieces_[other]), at_start, dp, dr);
    return crossing.n.dot(dp) + dr > filled * (dp.length() + std::abs(dr));
}

std::optional<PrimitiveHit> RoundCurves::intersect(uint32_t index,
                                                   const Vec3d& o,
                                                   const Vec3d& d,
                                                   float t_max) const {
    const Piece& piece = pieces_[index];
    if (piece.bound.is_missed(o, d, t_max)) return std::nullopt;
    SweptRay ray(sweep_of(piece), o, d);
    if (!ray.can_intersect(t_max)) return std::nullopt;
    const int stretches = ray.find_stretches();
    std::optional<PrimitiveHit> hit;
    // True when the search is over
    const auto take = [&](const SweepCrossing& crossing) {
        if (!(float(crossing.t) > 0.0f)) return false;
        if (!(float(crossing.t) < t_max)) return true;
        if (is_filled(index, crossing)) return false;
        hit = {crossing.t, float(mixed(piece.begin(), piece.end(), crossing.u)), 0.0f};
        return true;
    };
    // The usual one is entered from outside: no need to know where it is left
    if (stretches == 1) {
        if (!take(ray.entry(0))) take(ray.exit(0));
    } else if (stretches > 1) {
        Span spans[4];
        const int count = joined_spans(ray, stretches, spans);
        for (int i = 0; i < count; ++i)
            if (take(spans[i].in) || take(spans[i].out)) break;
    }
    return hit;
}

PrimitiveSurface RoundCurves::surface(uint32_t index,
                                      const Vec3d& o,
                                      const Vec3d& d,
                                      const PrimitiveHit& hit) const {
    const Piece& piece = pieces_[index];
    const Sweep sweep = sweep_of(piece);
    SweptRay ray(sweep, o, d);
    Span spans[4];
    const int count = joined_spans(ray, ray.find_stretches(), spans);
    SweepCrossing place;
    if (count == 0) {
        // A line that misses by rounding grazes: the nearest place on the ball that was met
        place.u =
            std::clamp((double(hit.u) - piece.begin()) / (piece.end() - piece.begin()), 0.0, 1.0);
        const Vec3d q = o + d * hit.t - bezier_point(sweep.p, place.u);
        place.n = q.length() > 0 ? q / q.length() : Vec3d(0.0, 0.0, 1.0);
    } else {
        place = spans[0].in;
        const auto consider = [&](const SweepCrossing& crossing) {
            if (std::abs(crossing.t - hit.t) < std::abs(place.t - hit.t)) place = crossing;
        };
        for (int i = 0; i < count; ++i) {
            consider(spans[i].in);
            consider(spans[i].out);
        }
    }
    const Vec3d center = bezier_point(sweep.p, place.u);
    const double r = bezier_point(sweep.r, place.u);
    PrimitiveSurface surface;
    surface.p = center + place.n * r;
    surface.n = place.n;
    // Rays leave by directions and normals that are rounded to float: see Quadric
    const double size = r + (sweep.p[3] - sweep.p[0]).length();
    surface.error = (absolute(center) + Vec3d(size)) * (16.0 * 0x1p-53) + Vec3d(0x1p-46 * size);

    // n = (p − c(u)) / r(u), where (p − c)·c' + r·r' = 0 says what u is; none of that on end balls
    surface.normal_by_p = Mat3d();
    const Vec3d dc = bezier_derivative(sweep.p, place.u);
    const double dr = bezier_derivative(sweep.r, place.u);
    const Vec3d ddc = bezier_second(sweep.p, place.u);
    const double bend =
        dc.dot(dc) - dr * dr - r * (bezier_second(sweep.r, place.u) + place.n.dot(ddc));
    const bool is_end = place.u == 0.0 || place.u == 1.0;
    for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < 3; ++k) {
            double m = i == k ? 1.0 : 0.0;
            if (!is_end && bend > 0) m -= dc[i] * (dc[k] + dr * place.n[k]) / bend;
            surface.normal_by_p[i][k] = m / r;
        }
    }
    return surface;
}

bool RoundCurves::tangents(uint32_t index,
                           uint32_t,
                           const Vec3d& p,
                           const PrimitiveHit& hit,
                           Vec3d& dpdu,
                           Vec3d& dpdv) const {
    const Sweep sweep = segment_sweep(pieces_[index].segment);
    const double u = double(hit.u);
    const Vec3d out = p - bezier_point(sweep.p, u), along = bezier_derivative(sweep.p, u);
    const double square = out.dot(out);
    if (!(square > 0)) return false;
    dpdu = along - out * (along.dot(out) / square);
    dpdv = out.cross(along);
    return dpdv != Vec3d(0.0);
}

bool RoundCurves::fiber(uint32_t index, const PrimitiveHit& hit, PrimitiveFiber& out) const {
    const Piece& piece = pieces_[index];
    const Sweep sweep = sweep_of(piece);
    const double u =
        std::clamp((double(hit.u) - piece.begin()) / (piece.end() - piece.begin()), 0.0, 1.0);
    out.middle = bezier_point(sweep.p, u);
    out.along = bezier_derivative(sweep.p, u);
    // Where control points coincide
    if (out.along == Vec3d(0.0)) out.along = sweep.p[3] - sweep.p[0];
    return out.along != Vec3d(0.0);
}

PrimvarRows RoundCurves::primvar_rows(uint32_t index,
                                      scene::Interpolation interpolation,
                                      const PrimitiveHit& hit) const {
    return rows_.rows(pieces_[index].segment, interpolation, hit.u);
}

size_t RoundCurves::bytes() const {
    return sizeof(*this) + rows_.bytes() + controls_.capacity() * sizeof(Control) +
           (first_piece_.capacity() + first_control_.capacity()) * sizeof(uint32_t) +
           pieces_.capacity() * sizeof(Piece);
}

double RoundCurves::area(uint32_t index) const {
    const Sweep sweep = sweep_of(pieces_[index]);
    constexpr int steps = 4;
    double area = 0;
    for (int i = 0; i < steps; ++i) {
        const double u = (i + 0.5) / steps;
        area +=
            2.0 * pi_d * bezier_point(sweep.r, u) * bezier_derivative(sweep.p, u).length() / steps;
    }
    return area;
}

Vec3d RoundCurves::point(uint32_t index, const Vec2d& u) const {
    const Sweep sweep = sweep_of(pieces_[index]);
    Vec3d along = bezier_derivative(sweep.p, u.x);
    const double speed = along.length();
    const Vec3d center = bezier_point(sweep.p, u.x);
    const double r = bezier_point(sweep.r, u.x), dr = bezier_derivative(sweep.r, u.x);
    if (!(speed > std::abs(dr))) return center + Vec3d(r, 0.0, 0.0);
    along /= speed;
    const Vec3d x =
        normalize(along.cross(std::abs(along.x) < 0.6 ? Vec3d(1, 0, 0) : Vec3d(0, 1, 0)));
    const Vec3d y = along.cross(x);
    const double lean = -dr / speed, turn = 2.0 * pi_d * u.y, c = safe_sqrt(1.0 - lean * lean);
    return center + (along * lean + x * (c * std::cos(turn)) + y * (c * std::sin(turn))) * r;
}

}  // namespace velatura::geometry
