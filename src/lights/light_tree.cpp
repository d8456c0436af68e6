// SPDX-License-Identifier: Apache-2.0
#include "lights/light_tree.h"

#include "lights/emissive_surfaces.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace velatura::lights {
namespace {

ClusterReceiver to_cluster_receiver(const Receiver& at) {
    return {Vec3d(at.p), Vec3d(at.n), at.both_sides};
}

}  // namespace

LightTree::LightTree(const LightSet& lights, const std::vector<bool>* among)
    : lights_(lights), places_(lights.item_count()) {
    build_groups(lights);
    std::vector<ClusterTree::Leaf> leaves;
    std::vector<uint32_t> infinite;
    for (uint32_t light = 0; light < lights.item_count(); ++light) {
        if (among && !(*among)[light]) continue;
        if (lights.is_instance(light)) {
            const Group& group = groups_[lights.group_of_instance(light)];
            if (group.tree.is_empty()) continue;
            leaves.push_back({light, lights.place(light, group.tree.bounds())});
        } else if (lights.is_infinite(light)) {
            infinite.push_back(light);
        } else if (lights.is_on(light)) {
            leaves.push_back({light, lights.bounds(light)});
        }
    }
    tree_ = ClusterTree(std::move(leaves));
    if (!tree_.is_empty()) choose_cut();
    cut_weights_ = ClusterWeights(tree_, cut_);
    entry_count_ = cut_.size();
    for (uint32_t entry = 0; entry < cut_.size(); ++entry) {
        tree_.for_each_leaf(cut_[entry], [&](uint32_t light, uint64_t trail) {
            places_[light] = {trail, entry, 0.0f};
        });
    }
    add_infinite(lights, infinite);
    find_single();
}

void LightTree::build_groups(const LightSet& lights) {
    const EmissiveSurfaces* surfaces = lights.surfaces();
    if (surfaces == nullptr) return;
    groups_.resize(surfaces->group_count());
    for (uint32_t g = 0; g < groups_.size(); ++g) {
        Group& group = groups_[g];
        const uint32_t count = surfaces->group_size(g);
        group.trails.assign(count, 0);
        group.is_on.assign(count, false);
        std::vector<ClusterTree::Leaf> leaves;
        for (uint32_t part = 0; part < count; ++part) {
            const LightBounds bounds = surfaces->part_bounds(g, part);
            group.is_on[part] = bounds.cone.intensity > 0.0;
            if (group.is_on[part]) leaves.push_back({part, bounds});
        }
        group.tree = ClusterTree(std::move(leaves));
        if (group.tree.is_empty()) continue;
        group.tree.for_each_leaf(
            0, [&](uint32_t part, uint64_t trail) { group.trails[part] = trail; });
    }
}

void LightTree::choose_cut() {
    // Open the largest and strongest clusters first: their own estimate is the worst
    cut_ = {0};
    while (cut_.size() < cut_size) {
        auto widest = cut_.end();
        double worst = -1.0;
        for (auto it = cut_.begin(); it != cut_.end(); ++it) {
            const ClusterTree::Node& n = tree_.node(*it);
            const double badness = double(n.intensity) * sqr(double(n.radius));
            if (!n.is_leaf && badness > worst) {
                worst = badness;
                widest = it;
            }
        }
        if (widest == cut_.end()) break;
        const uint32_t left = tree_.node(*widest).left;
        *widest = left;
        cut_.push_back(left + 1);
    }
}

void LightTree::add_infinite(const LightSet& lights, const std::vector<uint32_t>& infinite) {
    std::vector<std::pair<double, uint32_t>> ranked;
    for (const uint32_t light : infinite) {
        // What BSDF sampling finds by itself needs no choice
        const double irradiance = lights.mean_irradiance(light) * lights.sampled_share(light);
        if (irradiance > 0.0) ranked.push_back({irradiance / tree_.intensity_unit(), light});
    }
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

ClusterReceiver LightTree::in_prototype(uint32_t light,
                                        const ClusterReceiver& at,
                                        float time) const {
    const EmissiveSurfaces& surfaces = *lights_.surfaces();
    const uint32_t item = light - lights_.size();
    return {surfaces.to_prototype(item, at.p, time), surfaces.normal_to_prototype(item, at.n, time),
            at.both_sides};
}

void LightTree::find_single() {
    const bool is_finite = cut_.size() == 1 && tree_.node(cut_[0]).is_leaf && infinite_.empty();
    const bool is_infinite = cut_.empty() && infinite_.size() == 1 && rest_.empty();
    if (entry_count_ != 1 || !(is_finite || is_infinite)) return;
    const uint32_t light = is_finite ? tree_.node(cut_[0]).left : infinite_[0];
    if (!lights_.is_instance(light)) single_ = light;
}

double LightTree::entry_weights(const ClusterReceiver& at, Weights& weights) const {
    ClusterWeights::Weights of_cut;
    cut_weights_.evaluate(at, of_cut);
    double total = 0.0;
    size_t entry = 0;
    for (; entry < cut_.size(); ++entry) total += weights[entry] = of_cut[entry];
    for (const double irradiance : infinite_irradiance_) total += weights[entry++] = irradiance;
    return total;
}

std::optional<LightChoice> LightTree::select(const Receiver& receiver, double u) const {
    if (single_ != no_entry) return LightChoice{single_, 1.0f};
    const ClusterReceiver at = to_cluster_receiver(receiver);
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
    const double pmf = weights[entry] / total;
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

    // Go down by importance, for instances on into their triangles
    auto choice = tree_.descend(cut_[entry], at, rest, pmf);
    if (!choice) return std::nullopt;
    const uint32_t light = choice->item;
    if (!lights_.is_instance(light)) return LightChoice{light, float(choice->pmf)};
    const Group& group = groups_[lights_.group_of_instance(light)];
    choice =
        group.tree.descend(0, in_prototype(light, at, receiver.time), choice->rest, choice->pmf);
    if (!choice) return std::nullopt;
    return LightChoice{LightId(light, choice->item), float(choice->pmf)};
}

float LightTree::pmf(const Receiver& receiver, LightId light) const {
    const Place& place = places_[light.index];
    if (place.entry == no_entry) return 0.0f;
    if (single_ != no_entry) return 1.0f;
    const ClusterReceiver at = to_cluster_receiver(receiver);
    Weights weights;
    const double total = entry_weights(at, weights);
    if (!(total > 0.0) || !std::isfinite(total)) return 0.0f;
    double pmf = weights[place.entry] / total;
    if (place.entry >= cut_.size()) {
        const bool shares = place.entry - cut_.size() >= infinite_.size();
        return float(shares ? pmf * double(place.share) : pmf);
    }
    pmf = tree_.pmf_along(cut_[place.entry], place.trail, at, pmf);
    if (!(pmf > 0.0) || !lights_.is_instance(light.index)) return float(pmf);
    const Group& group = groups_[lights_.group_of_instance(light.index)];
    if (!group.is_on[light.part]) return 0.0f;
    return float(group.tree.pmf_along(0, group.trails[light.part],
                                      in_prototype(light.index, at, receiver.time), pmf));
}

size_t LightTree::visited_clusters(LightId light) const {
    const auto along = [](const ClusterTree& tree, uint32_t node, uint64_t trail) {
        size_t count = 0;
        for (; !tree.node(node).is_leaf; trail >>= 1, count += 2)
            node = tree.node(node).left + uint32_t(trail & 1);
        return count;
    };
    const Place& place = places_[light.index];
    if (place.entry == no_entry) return 0;
    size_t count = entry_count_;
    if (place.entry >= cut_.size()) return count;
    count += along(tree_, cut_[place.entry], place.trail);
    if (!lights_.is_instance(light.index)) return count;
    const Group& group = groups_[lights_.group_of_instance(light.index)];
    return count + along(group.tree, 0, group.trails[light.part]);
}

size_t LightTree::bytes() const {
    size_t total = tree_.bytes() + places_.capacity() * sizeof(Place);
    for (const Group& group : groups_)
        total += group.tree.bytes() + group.trails.capacity() * sizeof(uint64_t);
    return total;
}

}  // namespace velatura::lights
