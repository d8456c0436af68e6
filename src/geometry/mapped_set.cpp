// SPDX-License-Identifier: Apache-2.0
#include "geometry/mapped_set.h"

#include "geometry/absolute.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace velatura::geometry {

namespace {

constexpr double largest_distortion = 0x1p20;
constexpr double double_error = 16.0 * 0x1p-53;

double largest_entry(const Mat3d& m) {
    double max = 0;
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) max = std::max(max, std::abs(m[i][k]));
    return max;
}

}  // namespace

std::shared_ptr<const PrimitiveSet> MappedSet::make(std::shared_ptr<const PrimitiveSet> inner,
                                                    const Mat4d& outer_from_inner) {
    if (!inner || outer_from_inner == Mat4d()) return inner;
    std::shared_ptr<MappedSet> set(new MappedSet());
    const Mat3d cofactors = cofactor_matrix(outer_from_inner);
    const double det = determinant3(outer_from_inner);
    if (!(std::abs(det) > 0.0)) return nullptr;
    for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < 3; ++k) {
            set->forward_[i][k] = outer_from_inner[i][k];
            set->backward_[i][k] = cofactors[k][i] / det;
        }
    }
    set->origin_ = {outer_from_inner[3][0], outer_from_inner[3][1], outer_from_inner[3][2]};
    set->reach_ = absolute(set->forward_);
    set->round_trip_ = absolute(set->backward_) * set->reach_;
    set->condition_ =
        3.0 * std::max(1.0, 3.0 * largest_entry(set->forward_) * largest_entry(set->backward_));
    if (!(set->condition_ <= largest_distortion)) return nullptr;
    set->inner_ = std::move(inner);
    return set;
}

PrimitiveBounds MappedSet::bounds(uint32_t index) const {
    const PrimitiveBounds inner = inner_->bounds(index);
    PrimitiveBounds bounds;
    if (inner.box.isEmpty()) return bounds;
    bounds.condition = condition_ * inner.condition;
    const Vec3d center = inner.box.center() * forward_ + origin_;
    const Vec3d half = (inner.box.size() * 0.5) * reach_;
    // Rounding of places here and of rays there
    const Vec3d places = absolute(inner.box.center()) + inner.box.size();
    const Vec3d pad = (places * reach_ + absolute(origin_) + half) * round_trip_ * 0x1p-48;
    bounds.box = {center - half - pad, center + half + pad};
    return bounds;
}

std::optional<PrimitiveHit> MappedSet::intersect(uint32_t index,
                                                 const Vec3d& o,
                                                 const Vec3d& d,
                                                 float t_max) const {
    return inner_->intersect(index, (o - origin_) * backward_, d * backward_, t_max);
}

PrimitiveSurface MappedSet::surface(uint32_t index,
                                    const Vec3d& o,
                                    const Vec3d& d,
                                    const PrimitiveHit& hit) const {
    PrimitiveSurface surface =
        inner_->surface(index, (o - origin_) * backward_, d * backward_, hit);
    const Vec3d from_origin = surface.p * forward_;
    surface.error = surface.error * reach_ + (absolute(surface.p) * reach_ + absolute(origin_) +
                                              absolute(from_origin) * round_trip_) *
                                                 double_error;
    surface.p = origin_ + from_origin;
    // Covectors: the same number for what was carried over
    const Mat3d covector = backward_.transposed();
    surface.n = surface.n * covector;
    surface.facet_n = surface.facet_n * covector;
    surface.normal_by_p = backward_ * surface.normal_by_p * covector;
    return surface;
}

bool MappedSet::tangents(uint32_t index,
                         uint32_t face,
                         const Vec3d& p,
                         const PrimitiveHit& hit,
                         Vec3d& dpdu,
                         Vec3d& dpdv) const {
    const bool has_any = inner_->tangents(index, face, (p - origin_) * backward_, hit, dpdu, dpdv);
    dpdu = dpdu * forward_;
    dpdv = dpdv * forward_;
    return has_any;
}

bool MappedSet::fiber(uint32_t index, const PrimitiveHit& hit, PrimitiveFiber& out) const {
    if (!inner_->fiber(index, hit, out)) return false;
    out.middle = out.middle * forward_ + origin_;
    out.along = out.along * forward_;
    out.side = out.side * forward_;
    return true;
}

double MappedSet::area(uint32_t index) const {
    const double det = forward_.determinant();
    return inner_->area(index) * std::cbrt(det * det);
}

Vec3d MappedSet::point(uint32_t index, const Vec2d& u) const {
    return inner_->point(index, u) * forward_ + origin_;
}

}  // namespace velatura::geometry
