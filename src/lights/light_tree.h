// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "lights/cluster_tree.h"
#include "lights/cluster_weights.h"
#include "lights/light_selector.h"

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace velatura::lights {

/// Chooses lights by what they may bring to the receiver, along trees of clusters: one over the
/// lights, the emissive triangles and the instances with emissive triangles, and below each
/// instance one over its triangles, which instances share. The uppermost clusters, up to `cut_size`
/// of them, and the lights at infinity are weighed one by one, so that some dozens of lights are
/// chosen among exactly; below the cut the way down takes a logarithmic number of steps. Scaling a
/// scene by a power of two changes no choice.
class LightTree final : public LightSelector {
  public:
    /// among: which items there are to choose from; null = all.
    explicit LightTree(const LightSet& lights, const std::vector<bool>* among = nullptr);

    bool is_empty() const override { return entry_count_ == 0; }

    bool is_single() const override { return single_ != no_entry; }

    std::optional<LightChoice> select(const Receiver& at, double u) const override;
    float pmf(const Receiver& at, LightId light) const override;

    /// Clusters that pmf() of this light looks at, with the entries; 0 for lights that are off.
    size_t visited_clusters(LightId light) const;

    size_t bytes() const;

  private:
    static constexpr size_t cut_size = ClusterWeights::capacity;
    static constexpr size_t infinite_size = 8;  // lights at infinity beyond share one entry
    static constexpr size_t max_entries = cut_size + infinite_size;

    /// Where a light is found.
    struct Place {
        uint64_t trail = 0;  // below the entry's node, lowest bit first: 1 = right
        uint32_t entry = no_entry;
        float share = 0;  // of the last entry of lights at infinity
    };

    static constexpr uint32_t no_entry = ~0u;

    /// The triangles that instances share.
    struct Group {
        ClusterTree tree;
        std::vector<uint64_t> trails;  // of every part
        std::vector<bool> is_on;
    };

    using Weights = std::array<double, max_entries>;

    void build_groups(const LightSet& lights);
    void choose_cut();
    void find_single();
    void add_infinite(const LightSet& lights, const std::vector<uint32_t>& infinite);
    double entry_weights(const ClusterReceiver& at, Weights& weights) const;
    ClusterReceiver in_prototype(uint32_t light, const ClusterReceiver& at, float time) const;

    const LightSet& lights_;
    ClusterTree tree_;
    std::vector<Group> groups_;                // of EmissiveSurfaces
    std::vector<uint32_t> cut_;                // nodes
    ClusterWeights cut_weights_;               // of the same
    std::vector<uint32_t> infinite_;           // lights, each an entry after those of the cut
    std::vector<double> infinite_irradiance_;  // of each such entry, in intensity units
    std::vector<uint32_t> rest_;               // lights at infinity that share the last entry
    std::vector<double> rest_cdf_;
    std::vector<Place> places_;  // of every light
    size_t entry_count_ = 0;
    uint32_t single_ = no_entry;  // the only light there is: chosen without looking
};

}  // namespace velatura::lights
