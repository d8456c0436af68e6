// SPDX-License-Identifier: Apache-2.0
#include "lights/cluster_tree.h"

#include <algorithm>
#include <cmath>

namespace velatura::lights {
namespace {

double sine_of(double cosine) {
    return std::sqrt(std::max(0.0, 1.0 - cosine * cosine));
}

/// cos(max(0, a − b)) and sin(max(0, a − b)) of angles in [0, π].
double cos_of_difference(double cos_a, double sin_a, double cos_b, double sin_b) {
    return cos_a > cos_b ? 1.0 : cos_a * cos_b + sin_a * sin_b;
}

double sin_of_difference(double cos_a, double sin_a, double cos_b, double sin_b) {
    return cos_a > cos_b ? 0.0 : sin_a * cos_b - cos_a * sin_b;
}

}  // namespace

double ClusterTree::importance(const Node& node, const ClusterReceiver& at) const {
    const Vec3d to_light = Vec3d(node.center) - at.p;
    const double d2 = to_light.dot(to_light);
    const double radius_squared = sqr(double(node.radius));
    const double nearest = std::max(d2, radius_squared);
    if (!(nearest > 0.0)) return 0.0;
    const double strength = double(node.intensity) / nearest;
    if (d2 <= radius_squared) return strength;  // any direction is possible from inside

    // Angles that the cluster's extent takes off
    const double sin2_extent = radius_squared / d2;
    const double sin_extent = std::sqrt(sin2_extent), cos_extent = std::sqrt(1.0 - sin2_extent);
    const Vec3d wi = to_light / std::sqrt(d2);

    // Least angle between an emitting normal and the direction to the receiver
    const double along = -Vec3d(node.axis).dot(wi);
    const double cos_w = std::clamp(node.is_two_sided ? std::abs(along) : along, -1.0, 1.0);
    const double cos_normals = double(node.cos_normals), sin_normals = sine_of(cos_normals);
    const double sin_w = sine_of(cos_w);
    const double cos_x = cos_of_difference(cos_w, sin_w, cos_normals, sin_normals);
    const double sin_x = sin_of_difference(cos_w, sin_w, cos_normals, sin_normals);
    const double cos_least = cos_of_difference(cos_x, sin_x, cos_extent, sin_extent);
    const double cos_spread = double(node.cos_spread);
    if (cos_least <= cos_spread - cosine_slack) return 0.0;
    const double falloff = std::max(cos_least, min_falloff_of(node));

    // Least angle of incidence
    if (at.n == Vec3d(0.0)) return strength * falloff;
    double cos_i = at.n.dot(wi);
    if (at.both_sides) cos_i = std::abs(cos_i);
    const double cos_incidence =
        cos_of_difference(cos_i, sine_of(cos_i), cos_extent, sin_extent) + cosine_slack;
    return cos_incidence > 0.0 ? strength * falloff * cos_incidence : 0.0;
}

std::optional<ClusterChoice> ClusterTree::descend(uint32_t index,
                                                  const ClusterReceiver& at,
                                                  double u,
                                                  double pmf) const {
    double rest = u;
    while (!nodes_[index].is_leaf) {
        const uint32_t left = nodes_[index].left;
        prefetch_below(left);
        prefetch_below(left + 1);
        const double a = importance(nodes_[left], at), b = importance(nodes_[left + 1], at);
        if (!(a + b > 0.0)) return std::nullopt;
        const double p = a / (a + b);
        const bool is_right = rest >= p;
        const double q = is_right ? 1.0 - p : p;
        rest = std::clamp((is_right ? rest - p : rest) / q, 0.0, 1.0 - 0x1p-53);
        pmf *= q;
        index = is_right ? left + 1 : left;
    }
    return ClusterChoice{nodes_[index].left, pmf, rest};
}

double ClusterTree::pmf_along(uint32_t index,
                              uint64_t trail,
                              const ClusterReceiver& at,
                              double pmf) const {
    for (; !nodes_[index].is_leaf; trail >>= 1) {
        const uint32_t left = nodes_[index].left;
        prefetch_below(left + uint32_t(trail & 1));
        const double a = importance(nodes_[left], at), b = importance(nodes_[left + 1], at);
        if (!(a + b > 0.0)) return 0.0;
        const double p = a / (a + b);
        const bool is_right = (trail & 1) != 0;
        pmf *= is_right ? 1.0 - p : p;
        index = is_right ? left + 1 : left;
    }
    return pmf;
}

}  // namespace velatura::lights
