// SPDX-License-Identifier: Apache-2.0
#include "lights/light_tree.h"

#include "lights/emitter.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace velatura::lights {
namespace {

/// From this depth on clusters are halved by count, so that a trail fits its bits.
constexpr int deepest_by_cost = 32;
constexpr int bin_count = 12;

/// Part of its intensity that a light is taken to send sideways or backwards, where its cone goes
/// that far: the cosine says nothing there.
constexpr double least_falloff = 0.1;

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

/// Solid angle of the directions into which a cluster shines, weighed by the cosine beyond the
/// normals. Ref: Conty Estevez & Kulla 2018, eq. 1.
double direction_measure(const EmissionCone& cone) {
    const double o = cone.normals, w = std::min(o + cone.spread, pi_d);
    return 2.0 * pi_d * (1.0 - std::cos(o)) + pi_d / 2.0 *
                                                  (2.0 * w * std::sin(o) - std::cos(o - 2.0 * w) -
                                                   2.0 * o * std::sin(o) + std::cos(o));
}

double surface_area(const Box3d& box) {
    if (box.isEmpty()) return 0.0;
    const Vec3d s = box.size();
    return 2.0 * (s.x * s.y + s.y * s.z + s.z * s.x);
}

struct Bin {
    LightBounds bounds;
    size_t count = 0;

    void add(const LightBounds& b, size_t n) {
        bounds = count == 0 ? b : LightBounds::merged(bounds, b);
        count += n;
    }

    /// Flat clusters have an area of zero along one split: their extent keeps them apart.
    double cost() const {
        if (count == 0) return 0.0;
        const Vec3d s = bounds.box.size();
        return bounds.cone.intensity * direction_measure(bounds.cone) *
               (surface_area(bounds.box) + s.dot(s));
    }
};

size_t bin_of(double center, double low, double size) {
    const double x = (center - low) / size * bin_count;
    return size_t(std::clamp(x, 0.0, double(bin_count - 1)));
}

}  // namespace

LightTree::Node LightTree::make_node(const LightBounds& bounds) {
    Node n{};
    n.center = bounds.box.center();
    const Vec3d half = bounds.box.size() / 2.0;
    n.radius_squared = half.dot(half);
    n.axis = bounds.cone.axis;
    n.cos_normals = std::cos(bounds.cone.normals);
    n.sin_normals = std::sin(bounds.cone.normals);
    n.cos_spread = std::cos(bounds.cone.spread);
    n.intensity = bounds.cone.intensity;
    return n;
}

LightTree::LightTree(const LightSet& lights, const std::vector<uint32_t>& on)
    : places_(lights.size()) {
    std::vector<Leaf> leaves;
    std::vector<uint32_t> infinite;
    for (const uint32_t light : on) {
        if (lights.is_infinite(light)) {
            infinite.push_back(light);
            continue;
        }
        const LightBounds bounds = lights.bounds(light);
        leaves.push_back({light, bounds, bounds.box.center()});
    }
    if (!leaves.empty()) {
        nodes_.reserve(2 * leaves.size());
        nodes_.emplace_back();
        build(0, leaves, 0, leaves.size(), 0);
        choose_cut();
    }
    entry_count_ = cut_.size();
    for (uint32_t entry = 0; entry < cut_.size(); ++entry) note_places(cut_[entry], entry, 0, 0);
    add_infinite(lights, infinite);
}

LightBounds LightTree::build(
    uint32_t node, std::vector<Leaf>& leaves, size_t first, size_t end, int depth) {
    if (end - first == 1) {
        nodes_[node] = make_node(leaves[first].bounds);
        nodes_[node].left = leaves[first].light;
        nodes_[node].is_leaf = true;
        return leaves[first].bounds;
    }

    // Find the cheapest of the planes between bins along each axis
    Box3d centers;
    for (size_t i = first; i < end; ++i) centers.extendBy(leaves[i].center);
    const Vec3d size = centers.size();
    const double longest = std::max({size.x, size.y, size.z});
    double best = std::numeric_limits<double>::infinity();
    int best_axis = -1, best_plane = 0;
    for (int axis = 0; axis < 3 && depth < deepest_by_cost; ++axis) {
        if (!(size[axis] > 0.0)) continue;
        std::array<Bin, bin_count> bins;
        for (size_t i = first; i < end; ++i) {
            const size_t b = bin_of(leaves[i].center[axis], centers.min[axis], size[axis]);
            bins[b].add(leaves[i].bounds, 1);
        }
        std::array<double, bin_count> above{};
        Bin sum;
        for (int b = bin_count - 1; b > 0; --b) {
            if (bins[size_t(b)].count > 0) sum.add(bins[size_t(b)].bounds, bins[size_t(b)].count);
            above[size_t(b)] = sum.cost();
        }
        sum = {};
        for (int b = 0; b + 1 < bin_count; ++b) {
            if (bins[size_t(b)].count > 0) sum.add(bins[size_t(b)].bounds, bins[size_t(b)].count);
            // Thin slabs are worse clusters than their area tells
            const double cost = longest / size[axis] * (sum.cost() + above[size_t(b) + 1]);
            if (sum.count > 0 && sum.count < end - first && cost < best) {
                best = cost;
                best_axis = axis;
                best_plane = b;
            }
        }
    }

    // Divide there, or in the middle where no plane divides
    size_t middle = first;
    const auto begin = leaves.begin();
    if (best_axis >= 0) {
        const auto is_left = [&](const Leaf& leaf) {
            return bin_of(leaf.center[best_axis], centers.min[best_axis], size[best_axis]) <=
                   size_t(best_plane);
        };
        middle = size_t(std::stable_partition(begin + std::ptrdiff_t(first),
                                              begin + std::ptrdiff_t(end), is_left) -
                        begin);
    }
    if (middle == first || middle == end) middle = first + (end - first) / 2;

    const uint32_t left = uint32_t(nodes_.size());
    nodes_.resize(nodes_.size() + 2);
    const LightBounds a = build(left, leaves, first, middle, depth + 1);
    const LightBounds b = build(left + 1, leaves, middle, end, depth + 1);
    const LightBounds both = LightBounds::merged(a, b);
    nodes_[node] = make_node(both);
    nodes_[node].left = left;
    nodes_[node].is_leaf = false;
    return both;
}

void LightTree::choose_cut() {
    // Open the largest and strongest clusters first: their own estimate is the worst
    cut_ = {0};
    while (cut_.size() < cut_size) {
        auto widest = cut_.end();
        double worst = -1.0;
        for (auto it = cut_.begin(); it != cut_.end(); ++it) {
            const Node& n = nodes_[*it];
            const double badness = n.intensity * n.radius_squared;
            if (!n.is_leaf && badness > worst) {
                worst = badness;
                widest = it;
            }
        }
        if (widest == cut_.end()) break;
        const uint32_t left = nodes_[*widest].left;
        *widest = left;
        cut_.push_back(left + 1);
    }
}

void LightTree::note_places(uint32_t node, uint32_t entry, uint64_t trail, int depth) {
    const Node& n = nodes_[node];
    if (n.is_leaf) {
        places_[n.left] = {entry, trail, 0.0f};
        return;
    }
    note_places(n.left, entry, trail, depth + 1);
    note_places(n.left + 1, entry, trail | uint64_t(1) << depth, depth + 1);
}

void LightTree::add_infinite(const LightSet& lights, const std::vector<uint32_t>& infinite) {
    std::vector<std::pair<double, uint32_t>> ranked;
    for (const uint32_t light : infinite) ranked.push_back({lights.mean_irradiance(light), light});
    std::stable_sort(ranked.begin(), ranked.end(),
                     [](const auto& a, const auto& b) { return a.first > b.first; });
    const size_t single = ranked.size() <= infinite_size ? ranked.size() : infinite_size - 1;
    for (size_t i = 0; i < single; ++i) {
        places_[ranked[i].second].entry = uint32_t(entry_count_++);
        infinite_.push_back(ranked[i].second);
        infinite_irradiance_.push_back(ranked[i].first);
    }
    if (single == ranked.size()) return;

    // The weaker ones stand behind one entry, chosen among by strength
    double sum = 0.0;
    for (size_t i = single; i < ranked.size(); ++i) {
        sum += ranked[i].first;
        rest_.push_back(ranked[i].second);
        rest_cdf_.push_back(sum);
    }
    double before = 0.0;
    for (size_t i = 0; i < rest_.size(); ++i) {
        places_[rest_[i]].entry = uint32_t(entry_count_);
        places_[rest_[i]].share = float((rest_cdf_[i] - before) / sum);
        before = rest_cdf_[i];
    }
    infinite_irradiance_.push_back(sum);
    ++entry_count_;
}

double LightTree::importance(const Node& node, const Receiver& at) const {
    const Vec3d to_light = node.center - Vec3d(at.p);
    const double d2 = to_light.dot(to_light);
    const double nearest = std::max(d2, node.radius_squared);
    if (!(nearest > 0.0)) return 0.0;
    const double strength = node.intensity / nearest;
    if (d2 <= node.radius_squared) return strength;  // any direction is possible from inside

    // Angles that the cluster's extent takes off
    const double sin2_extent = node.radius_squared / d2;
    const double sin_extent = std::sqrt(sin2_extent), cos_extent = std::sqrt(1.0 - sin2_extent);
    const Vec3d wi = to_light / std::sqrt(d2);

    // Least angle between an emitting normal and the direction to the receiver
    const double cos_w = std::clamp(-node.axis.dot(wi), -1.0, 1.0), sin_w = sine_of(cos_w);
    const double cos_x = cos_of_difference(cos_w, sin_w, node.cos_normals, node.sin_normals);
    const double sin_x = sin_of_difference(cos_w, sin_w, node.cos_normals, node.sin_normals);
    const double cos_least = cos_of_difference(cos_x, sin_x, cos_extent, sin_extent);
    if (cos_least <= node.cos_spread) return 0.0;
    const double falloff = node.cos_spread < 0.0 ? std::max(cos_least, least_falloff) : cos_least;

    // Least angle of incidence
    if (at.n == Vec3(0.0f)) return strength * falloff;
    double cos_i = Vec3d(at.n).dot(wi);
    if (at.both_sides) cos_i = std::abs(cos_i);
    const double cos_incidence = cos_of_difference(cos_i, sine_of(cos_i), cos_extent, sin_extent);
    return cos_incidence > 0.0 ? strength * falloff * cos_incidence : 0.0;
}

double LightTree::entry_weights(const Receiver& at, Weights& weights) const {
    double total = 0.0;
    size_t entry = 0;
    for (const uint32_t node : cut_) total += weights[entry++] = importance(nodes_[node], at);
    for (const double irradiance : infinite_irradiance_) total += weights[entry++] = irradiance;
    return total;
}

std::optional<LightChoice> LightTree::select(const Receiver& at, double u) const {
    Weights weights;
    const double total = entry_weights(at, weights);
    if (!(total > 0.0) || !std::isfinite(total)) return std::nullopt;

    // Choose an entry; what rounding leaves over goes to the last one that counts
    double rest = u * total;
    size_t entry = entry_count_;
    for (size_t i = 0; i < entry_count_; ++i) {
        if (!(weights[i] > 0.0)) continue;
        entry = i;
        if (rest < weights[i]) break;
        if (i + 1 < entry_count_) rest -= weights[i];
    }
    double pmf = weights[entry] / total;
    rest = std::clamp(rest / weights[entry], 0.0, 1.0 - 0x1p-53);

    // Lights at infinity
    if (entry >= cut_.size()) {
        const size_t i = entry - cut_.size();
        if (i < infinite_.size()) return LightChoice{infinite_[i], float(pmf)};
        const auto at_cdf =
            std::upper_bound(rest_cdf_.begin(), rest_cdf_.end(), rest * rest_cdf_.back());
        const size_t which = std::min(size_t(at_cdf - rest_cdf_.begin()), rest_.size() - 1);
        return LightChoice{rest_[which], float(pmf * double(places_[rest_[which]].share))};
    }

    // Go down by importance
    uint32_t node = cut_[entry];
    while (!nodes_[node].is_leaf) {
        const uint32_t left = nodes_[node].left;
        const double a = importance(nodes_[left], at), b = importance(nodes_[left + 1], at);
        if (!(a + b > 0.0)) return std::nullopt;
        const double p = a / (a + b);
        const bool is_left = rest < p;
        rest = std::clamp(is_left ? rest / p : (rest - p) / (1.0 - p), 0.0, 1.0 - 0x1p-53);
        pmf *= is_left ? p : 1.0 - p;
        node = is_left ? left : left + 1;
    }
    return LightChoice{nodes_[node].left, float(pmf)};
}

float LightTree::pmf(const Receiver& at, uint32_t light) const {
    const Place& place = places_[light];
    if (place.entry == no_entry) return 0.0f;
    Weights weights;
    const double total = entry_weights(at, weights);
    if (!(total > 0.0) || !std::isfinite(total)) return 0.0f;
    double pmf = weights[place.entry] / total;
    if (place.entry >= cut_.size()) {
        const bool shares = place.entry - cut_.size() >= infinite_.size();
        return float(shares ? pmf * double(place.share) : pmf);
    }
    uint32_t node = cut_[place.entry];
    for (uint64_t trail = place.trail; !nodes_[node].is_leaf; trail >>= 1) {
        const uint32_t left = nodes_[node].left;
        const double a = importance(nodes_[left], at), b = importance(nodes_[left + 1], at);
        if (!(a + b > 0.0)) return 0.0f;
        const double p = a / (a + b);
        const bool is_right = (trail & 1) != 0;
        pmf *= is_right ? 1.0 - p : p;
        node = is_right ? left + 1 : left;
    }
    return float(pmf);
}

}  // namespace velatura::lights
