// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "lights/cluster_tree.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace velatura::lights {

/// Clusters of a tree side by side, to be weighed all at once: ClusterTree::importance in float,
/// where the tree's own size is about 1. Clusters are taken to be larger by what rounding may do to
/// the way to them, so that here, too, only those weigh nothing that bring nothing.
class ClusterWeights {
  public:
    static constexpr size_t capacity = 64;
    using Weights = std::array<double, capacity>;

    ClusterWeights() = default;

    /// Of the given nodes, at most `capacity` of them.
    ClusterWeights(const ClusterTree& tree, std::span<const uint32_t> nodes);

    /// Of every cluster in the order given, in the unit of ClusterTree::importance.
    void evaluate(const ClusterReceiver& at, Weights& weights) const;

    /// Rows of numbers, one column per cluster; zeros behind the last one.
    struct alignas(64) Lanes {
        using Row = std::array<float, capacity>;
        Row center[3] = {}, axis[3] = {};  // relative to the tree's center and size
        Row radius = {}, cos_normals = {}, sin_normals = {}, cos_spread = {}, min_falloff = {};
        Row intensity = {};
        Row two_sided = {};  // 1 or 0
    };

  private:
    Lanes lanes_;
    size_t size_ = 0;
    Vec3d center_ = Vec3d(0.0);
    double scale_ = 1;  // a power of two
};

}  // namespace velatura::lights
