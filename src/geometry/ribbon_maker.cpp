// SPDX-License-Identifier: Apache-2.0
#include "geometry/ribbon_maker.h"

#include "geometry/bezier.h"
#include "geometry/ribbons.h"

#include <algorithm>
#include <cmath>

namespace velatura::geometry {

namespace {

// How finely segments are divided: for the fit of their edges, and for the sake of boxes, where
// that makes the sum of their areas so much smaller.
constexpr uint32_t max_levels = 7, max_box_levels = 2;
constexpr double worthwhile = 0.7;
constexpr double closeness = 0x1p-8;  // of edges, in half widths

Vec3d unit_or_zero(const Vec3d& v) {
    const double length = v.length();
    return length > 0.0 ? v / length : Vec3d(0.0);
}

/// Direction of a cubic at u, also where it stands still at an end.
Vec3d direction(const Vec3d c[4], double u) {
    const Vec3d d = unit_or_zero(bezier_derivative(c, u));
    if (d != Vec3d(0.0)) return d;
    const int end = u < 0.5 ? 0 : 3, step = u < 0.5 ? 1 : -1;
    for (int i = 2; i <= 3; ++i) {
        const Vec3d e = unit_or_zero((c[end + step * i] - c[end]) * double(step));
        if (e != Vec3d(0.0)) return e;
    }
    return Vec3d(0.0);
}

/// The cubic through values at 0, 1/3, 2/3 and 1.
void interpolate(const Vec3d v[4], Vec3d c[4]) {
    c[0] = v[0];
    c[1] = (v[0] * -5.0 + v[1] * 18.0 - v[2] * 9.0 + v[3] * 2.0) / 6.0;
    c[2] = (v[0] * 2.0 - v[1] * 9.0 + v[2] * 18.0 - v[3] * 5.0) / 6.0;
    c[3] = v[3];
}

double half_area(const Vec3d left[4], const Vec3d right[4]) {
    Box3d box;
    for (int i = 0; i < 4; ++i) {
        box.extendBy(left[i]);
        box.extendBy(right[i]);
    }
    const Vec3d size = box.size();
    return size.x * size.y + size.y * size.z + size.z * size.x;
}

/// Whether boxes of both halves are much smaller than that of the whole.
bool has_small_halves(const Vec3d left[4], const Vec3d right[4]) {
    double halves = 0;
    for (const double begin : {0.0, 0.5}) {
        Vec3d l[4], r[4];
        bezier_part(left, begin, begin + 0.5, l);
        bezier_part(right, begin, begin + 0.5, r);
        halves += half_area(l, r);
    }
    return halves <= worthwhile * half_area(left, right);
}

}  // namespace

RibbonShape::RibbonShape(const scene::Curves& curves, const CurveRows& rows)
    : curves_(curves), rows_(rows) {}

void RibbonShape::set_curve(uint32_t curve) {
    first_ = rows_.first_segment(curve);
    const uint32_t count = rows_.segment_count(curve);
    joints_.assign(count + 1, Vec3d(0.0));
    for (uint32_t i = 0; i < count; ++i) {
        Vec3d c[4];
        middle(first_ + i, c);
        joints_[i] += direction(c, 0.0);
        joints_[i + 1] += direction(c, 1.0);
    }
    if (rows_.is_periodic()) joints_[0] = joints_[count] = joints_[0] + joints_[count];
    for (Vec3d& joint : joints_) joint = unit_or_zero(joint);
}

void RibbonShape::middle(uint32_t segment, Vec3d out[4]) const {
    const CurveRows::Stencil stencil = rows_.vertices(segment);
    for (int k = 0; k < 4; ++k) {
        out[k] = Vec3d(0.0);
        for (int j = 0; j < 4; ++j)
            out[k] += Vec3d(curves_.points[stencil.row[j]]) * stencil.weight[k][j];
    }
}

bool RibbonShape::is_point(uint32_t segment) const {
    Vec3d c[4];
    middle(segment, c);
    return c[0] == c[1] && c[1] == c[2] && c[2] == c[3];
}

Vec3d RibbonShape::normal(uint32_t segment, double u) const {
    const PrimvarRows rows = rows_.rows(segment, curves_.normal_interpolation, float(u));
    Vec3d n(0.0);
    for (int i = 0; i < rows.count; ++i)
        n += Vec3d(curves_.normals[rows.row[i]]) * double(rows.weight[i]);
    return n;
}

double RibbonShape::width(uint32_t segment, double u) const {
    const PrimvarRows rows = rows_.rows(segment, curves_.width_interpolation, float(u));
    double width = 0;
    for (int i = 0; i < rows.count; ++i)
        width += double(curves_.widths[rows.row[i]]) * double(rows.weight[i]);
    // Where the basis overshoots
    return std::max(width, 0.0);
}

Vec3d RibbonShape::half(uint32_t segment, double u) const {
    Vec3d c[4];
    middle(segment, c);
    // What joints turn at the ends is spread over the segment
    const Vec3d begin = direction(c, 0.0), end = direction(c, 1.0);
    const Vec3d joint[2] = {joints_[segment - first_], joints_[segment - first_ + 1]};
    Vec3d along = direction(c, u);
    if (joint[0] != Vec3d(0.0)) along += (joint[0] - begin) * (1.0 - u);
    if (joint[1] != Vec3d(0.0)) along += (joint[1] - end) * u;
    Vec3d side = unit_or_zero(along.cross(normal(segment, u)));
    // A normal along the curve says nothing
    if (side == Vec3d(0.0))
        side = unit_or_zero(along.cross(std::abs(along.x) < 0.6 * along.length() ? Vec3d(1, 0, 0)
                                                                                 : Vec3d(0, 1, 0)));
    return side * (0.5 * width(segment, u));
}

/// Divides segments into pieces and fits their edges.
class Ribbons::Maker {
  public:
    Maker(Ribbons& ribbons, const scene::Curves& curves)
        : ribbons_(ribbons), shape_(curves, ribbons.rows_) {}

    void run() {
        for (uint32_t curve = 0; curve < ribbons_.rows_.curve_count(); ++curve) {
            shape_.set_curve(curve);
            is_first_ = true;
            const size_t first_control = ribbons_.controls_.size();
            const size_t first_piece = ribbons_.pieces_.size();
            for (uint32_t i = 0; i < ribbons_.rows_.segment_count(curve); ++i) {
                const uint32_t segment = ribbons_.rows_.first_segment(curve) + i;
                if (!shape_.is_point(segment)) divide(segment, 0, 0);
            }
            // Closed to the bit
            if (ribbons_.rows_.is_periodic() && ribbons_.pieces_.size() > first_piece)
                ribbons_.controls_.back() = ribbons_.controls_[first_control];
        }
    }

  private:
    void divide(uint32_t segment, uint32_t part, uint32_t level) {
        Piece piece{segment, 0, part, level, {}};
        Vec3d whole[4], middle[4], at[4], half[4], left[4], right[4];
        shape_.middle(segment, whole);
        bezier_part(whole, piece.begin(), piece.end(), middle);
        const auto place = [&](double u) { return mixed(piece.begin(), piece.end(), u); };
        for (int i = 0; i < 4; ++i) at[i] = shape_.half(segment, place(i / 3.0));
        interpolate(at, half);
        double widest = 0, off = 0;
        for (const double u : {1.0 / 6, 0.5, 5.0 / 6}) {
            const Vec3d ideal = shape_.half(segment, place(u));
            off = std::max(off, (bezier_point(half, u) - ideal).length());
            widest = std::max(widest, ideal.length());
        }
        for (const Vec3d& h : at) widest = std::max(widest, h.length());
        if (!(widest > 0.0)) {
            is_first_ = true;
            return;
        }
        for (int i = 0; i < 4; ++i) {
            left[i] = middle[i] - half[i];
            right[i] = middle[i] + half[i];
        }
        const bool is_close = off <= closeness * widest || level == max_levels;
        if (is_close && (level >= max_box_levels || !has_small_halves(left, right))) {
            add(piece, left, right);
            return;
        }
        divide(segment, 2 * part, level + 1);
        divide(segment, 2 * part + 1, level + 1);
    }

    void add(Piece piece, const Vec3d left[4], const Vec3d right[4]) {
        std::vector<Control>& controls = ribbons_.controls_;
        // Joined to the bit: the first control is the last one's last
        if (is_first_) controls.push_back({to_float(left[0]), to_float(right[0])});
        is_first_ = false;
        piece.first = uint32_t(controls.size()) - 1;
        for (int i = 1; i < 4; ++i) controls.push_back({to_float(left[i]), to_float(right[i])});
        Vec3d middle[4];
        double widest = 0;
        for (int i = 0; i < 4; ++i) {
            middle[i] = mixed(left[i], right[i], 0.5);
            widest = std::max(widest, (right[i] - left[i]).length());
        }
        piece.bound = ChordBound(middle, 0.5 * widest);
        ribbons_.pieces_.push_back(piece);
    }

    Ribbons& ribbons_;
    RibbonShape shape_;
    bool is_first_ = true;  // no piece to join
};

std::shared_ptr<const Ribbons> Ribbons::make(const scene::Curves& curves) {
    std::shared_ptr<Ribbons> set(new Ribbons(curves));
    return set->pieces_.empty() ? nullptr : set;
}

Ribbons::Ribbons(const scene::Curves& curves) : rows_(curves) {
    Maker(*this, curves).run();
    controls_.shrink_to_fit();
    pieces_.shrink_to_fit();
}

}  // namespace velatura::geometry
