// SPDX-License-Identifier: Apache-2.0
// The kernel is compiled once per instruction set by Highway, as those of accel are.
#include "lights/cluster_weights.h"

#include "base/check.h"

#include <algorithm>
#include <cmath>

#ifndef VELATURA_LIGHTS_LANE_RECEIVER
#define VELATURA_LIGHTS_LANE_RECEIVER

namespace velatura::lights {

/// A ClusterReceiver in the units of the lanes.
struct LaneReceiver {
    Vec3 p, n;
    bool has_normal = false, both_sides = true;
    float widening = 0;  ///< of every radius
};

}  // namespace velatura::lights
#endif

// clang-format off
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "lights/cluster_weights.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
// clang-format on

HWY_BEFORE_NAMESPACE();

namespace velatura::lights {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Lanes16 = hn::CappedTag<float, 16>;
using V = hn::Vec<Lanes16>;

HWY_INLINE V dot(V ax, V ay, V az, V bx, V by, V bz) {
    return hn::Add(hn::Add(hn::Mul(ax, bx), hn::Mul(ay, by)), hn::Mul(az, bz));
}

HWY_INLINE V sine_of(V cosine) {
    const Lanes16 d;
    return hn::Sqrt(hn::Max(hn::Zero(d), hn::Sub(hn::Set(d, 1.0f), hn::Mul(cosine, cosine))));
}

// cos(max(0, a − b)) and sin(max(0, a − b)) of angles in [0, π]
HWY_INLINE V cos_of_difference(V cos_a, V sin_a, V cos_b, V sin_b) {
    const Lanes16 d;
    return hn::IfThenElse(hn::Gt(cos_a, cos_b), hn::Set(d, 1.0f),
                          hn::Add(hn::Mul(cos_a, cos_b), hn::Mul(sin_a, sin_b)));
}

HWY_INLINE V sin_of_difference(V cos_a, V sin_a, V cos_b, V sin_b) {
    return hn::IfThenZeroElse(hn::Gt(cos_a, cos_b),
                              hn::Sub(hn::Mul(sin_a, cos_b), hn::Mul(cos_a, sin_b)));
}

// The steps of ClusterTree::importance, with both sides of each choice
HWY_INLINE V weigh(const ClusterWeights::Lanes& lanes, size_t i, const LaneReceiver& at) {
    const Lanes16 d;
    const auto row = [&](const ClusterWeights::Lanes::Row& r)
                         HWY_ATTR { return hn::Load(d, r.data() + i); };
    const V zero = hn::Zero(d), one = hn::Set(d, 1.0f);
    const V slack = hn::Set(d, ClusterTree::cosine_slack_float);
    const V x = hn::Sub(row(lanes.center[0]), hn::Set(d, at.p.x));
    const V y = hn::Sub(row(lanes.center[1]), hn::Set(d, at.p.y));
    const V z = hn::Sub(row(lanes.center[2]), hn::Set(d, at.p.z));
    const V d2 = dot(x, y, z, x, y, z);
    const V radius = hn::Add(row(lanes.radius), hn::Set(d, at.widening));
    const V radius2 = hn::Mul(radius, radius);
    const V inverse2 = hn::Div(one, hn::Max(d2, radius2)), inverse = hn::Sqrt(inverse2);
    const V strength = hn::Mul(row(lanes.intensity), inverse2);

    // Angles that the cluster's extent takes off
    const V sin_extent = hn::Mul(radius, inverse), cos_extent = sine_of(sin_extent);
    const V wx = hn::Mul(x, inverse), wy = hn::Mul(y, inverse), wz = hn::Mul(z, inverse);

    // Least angle between an emitting normal and the direction to the receiver
    const V along =
        hn::Neg(dot(row(lanes.axis[0]), row(lanes.axis[1]), row(lanes.axis[2]), wx, wy, wz));
    const auto is_two_sided = hn::Gt(row(lanes.two_sided), zero);
    const V cos_w =
        hn::Min(one, hn::Max(hn::Neg(one), hn::IfThenElse(is_two_sided, hn::Abs(along), along)));
    const V sin_w = sine_of(cos_w);
    const V cos_normals = row(lanes.cos_normals), sin_normals = row(lanes.sin_normals);
    const V cos_x = cos_of_difference(cos_w, sin_w, cos_normals, sin_normals);
    const V sin_x = sin_of_difference(cos_w, sin_w, cos_normals, sin_normals);
    const V cos_least = cos_of_difference(cos_x, sin_x, cos_extent, sin_extent);
    const auto is_lit = hn::Gt(cos_least, hn::Sub(row(lanes.cos_spread), slack));
    V weight = hn::Mul(strength, hn::Max(cos_least, row(lanes.min_falloff)));

    // Least angle of incidence
    if (at.has_normal) {
        const V cos_n = dot(hn::Set(d, at.n.x), hn::Set(d, at.n.y), hn::Set(d, at.n.z), wx, wy, wz);
        const V cos_i = at.both_sides ? hn::Abs(cos_n) : cos_n;
        const V incidence = cos_of_difference(cos_i, sine_of(cos_i), cos_extent, sin_extent);
        const V min = hn::Set(d, float(ClusterTree::cosine_slack));
        weight = hn::IfThenElseZero(hn::Gt(incidence, hn::Neg(slack)),
                                    hn::Mul(weight, hn::Max(incidence, min)));
    }
    // Any direction is possible from inside
    return hn::IfThenElse(hn::Le(d2, radius2), strength, hn::IfThenElseZero(is_lit, weight));
}

void evaluate(const ClusterWeights::Lanes& lanes, size_t count, const LaneReceiver& at, float* out);

void evaluate(const ClusterWeights::Lanes& lanes,
              size_t count,
              const LaneReceiver& at,
              float* out) {
    const Lanes16 d;
    for (size_t i = 0; i < count; i += hn::Lanes(d)) hn::Store(weigh(lanes, i, at), d, out + i);
}

}  // namespace HWY_NAMESPACE
}  // namespace velatura::lights

HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace velatura::lights {

HWY_EXPORT(evaluate);

ClusterWeights::ClusterWeights(const ClusterTree& tree, std::span<const uint32_t> nodes)
    : size_(nodes.size()) {
    VELATURA_CHECK(size_ <= capacity, "more clusters than allocated");
    if (nodes.empty()) return;
    const Box3d& box = tree.bounds().box;
    const auto largest = [](const Vec3d& v) {
        return std::max(std::abs(v.x), std::max(std::abs(v.y), std::abs(v.z)));
    };
    center_ = box.center();
    double size = largest(box.size());
    // A single point has no size of its own
    if (!(size > 0.0)) size = largest(center_);
    if (size > 0.0) scale_ = normalizing_scale(size);
    for (size_t i = 0; i < size_; ++i) {
        const ClusterTree::Node& node = tree.node(nodes[i]);
        const Vec3d center = (Vec3d(node.center) - center_) * scale_;
        for (int k = 0; k < 3; ++k) {
            lanes_.center[k][i] = float(center[k]);
            lanes_.axis[k][i] = node.axis[k];
        }
        lanes_.radius[i] = float(double(node.radius) * scale_);
        lanes_.cos_normals[i] = node.cos_normals;
        lanes_.sin_normals[i] = float(safe_sqrt(1.0 - sqr(double(node.cos_normals))));
        lanes_.cos_spread[i] = node.cos_spread;
        lanes_.min_falloff[i] = float(ClusterTree::min_falloff_of(node));
        lanes_.intensity[i] = node.intensity;
        lanes_.two_sided[i] = node.is_two_sided ? 1.0f : 0.0f;
    }
}

void ClusterWeights::evaluate(const ClusterReceiver& at, Weights& weights) const {
    LaneReceiver receiver;
    receiver.p = to_float((at.p - center_) * scale_);
    receiver.n = to_float(at.n);
    receiver.has_normal = at.n != Vec3d(0.0);
    receiver.both_sides = at.both_sides;
    // Rounding of both ends of the way, several times over
    receiver.widening = 0x1p-21f * (1.0f + std::abs(receiver.p.x) + std::abs(receiver.p.y) +
                                    std::abs(receiver.p.z));
    alignas(64) float found[capacity];
    HWY_DYNAMIC_DISPATCH(evaluate)(lanes_, size_, receiver, found);
    const double unit = scale_ * scale_;
    for (size_t i = 0; i < size_; ++i) weights[i] = double(found[i]) * unit;
}

}  // namespace velatura::lights
#endif
