// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "lights/light_bounds.h"
#include "lights/light_selector.h"

#include <array>
#include <cstdint>
#include <vector>

namespace velatura::lights {

/// Chooses lights by what they may bring to the receiver: bounds of position, direction and
/// strength in a binary tree. The uppermost clusters, up to `cut_size` of them, and the lights at
/// infinity are weighed one by one, so that a handful of lights is chosen among exactly; below the
/// cut the way down takes a logarithmic number of steps. All in double; scaling a scene by a power
/// of two changes no choice. Ref: Conty Estevez & Kulla 2018, "Importance Sampling of Many Lights
/// with Adaptive Tree Splitting"; Pharr, Jakob & Humphreys, PBR 4th ed., 12.6.3.
class LightTree final : public LightSelector {
  public:
    /// Args: on: the lights that are on.
    LightTree(const LightSet& lights, const std::vector<uint32_t>& on);

    bool is_empty() const override { return entry_count_ == 0; }

    std::optional<LightChoice> select(const Receiver& at, double u) const override;
    float pmf(const Receiver& at, uint32_t light) const override;

  private:
    static constexpr size_t cut_size = 8;
    static constexpr size_t infinite_size = 8;  // lights at infinity beyond share one entry
    static constexpr size_t most_entries = cut_size + infinite_size;

    struct Node {
        Vec3d center;
        double radius_squared;  // of the sphere around the box
        Vec3d axis;
        double cos_normals, sin_normals, cos_spread;
        double intensity;
        uint32_t left;  // right child is left + 1; of a leaf, its light
        bool is_leaf;
    };

    /// Where a light is found.
    struct Place {
        uint32_t entry = no_entry;
        uint64_t trail = 0;  // below the entry's node, lowest bit first: 1 = right
        float share = 0;     // of the last entry of lights at infinity
    };

    static constexpr uint32_t no_entry = ~0u;

    struct Leaf {
        uint32_t light;
        LightBounds bounds;
        Vec3d center;
    };

    using Weights = std::array<double, most_entries>;

    static Node make_node(const LightBounds& bounds);
    LightBounds build(
        uint32_t node, std::vector<Leaf>& leaves, size_t first, size_t end, int depth);
    void choose_cut();
    void note_places(uint32_t node, uint32_t entry, uint64_t trail, int depth);
    void add_infinite(const LightSet& lights, const std::vector<uint32_t>& infinite);
    double importance(const Node& node, const Receiver& at) const;
    double entry_weights(const Receiver& at, Weights& weights) const;

    std::vector<Node> nodes_;
    std::vector<uint32_t> cut_;                // nodes
    std::vector<uint32_t> infinite_;           // lights, each an entry after those of the cut
    std::vector<double> infinite_irradiance_;  // of each such entry
    std::vector<uint32_t> rest_;               // lights at infinity that share the last entry
    std::vector<double> rest_cdf_;
    std::vector<Place> places_;  // of every light
    size_t entry_count_ = 0;
};

}  // namespace velatura::lights
