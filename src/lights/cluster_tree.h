// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "lights/light_bounds.h"

#include <cstdint>
#include <optional>
#include <vector>

namespace velatura::lights {

/// Where light is wanted, in the space of a tree.
struct ClusterReceiver {
    Vec3d p;
    Vec3d n = Vec3d(0.0);  ///< unit; zero = every direction counts
    bool both_sides = true;
};

/// Way down through a ClusterTree.
struct ClusterChoice {
    uint32_t item = 0;
    double pmf = 0;   ///< the one given times that of the way down
    double rest = 0;  ///< in [0, 1): what is left of the random number
};

/// Emitters at finite distance in a binary tree of clusters, each with bounds of position,
/// direction and strength, that says how much a cluster may bring to a receiver. 48 bytes a node;
/// cones and spheres in float are widened by their rounding. Scaling by a power of two changes no
/// choice. Ref: Conty Estevez & Kulla 2018, "Importance Sampling of Many Lights with Adaptive Tree
/// Splitting"; Pharr, Jakob & Humphreys, PBR 4th ed., 12.6.3.
class ClusterTree {
  public:
    struct Leaf {
        uint32_t item = 0;  ///< the caller's number
        LightBounds bounds;
    };

    struct Node {
        Vec3 center;
        float radius;
        Vec3 axis;
        float cos_normals, cos_spread;
        float intensity;  // in units of intensity_unit()
        uint32_t left;    // right child is left + 1; of a leaf, its item
        bool is_leaf, is_two_sided;
    };

    /// Cosines of axes and normals in float are this uncertain, several times over.
    static constexpr double cosine_slack = 1e-6;
    /// Where they are computed with in float: the sine of an angle near π is off by the root of the
    /// roundoff.
    static constexpr float cosine_slack_float = 6e-4f;

    /// Part of its intensity that a cluster is taken to send where its cone's cosine says less:
    /// some sideways and backwards, where the cone goes that far.
    static double min_falloff_of(const Node& node) {
        return node.cos_spread < 0.0f ? 0.1 : cosine_slack;
    }

    /// How deep a tree of any number of leaves can be.
    static constexpr int depth_limit = 64;

    ClusterTree() = default;
    explicit ClusterTree(std::vector<Leaf> leaves);

    bool is_empty() const { return nodes_.empty(); }

    const Node& node(uint32_t index) const { return nodes_[index]; }

    /// Bounds of everything.
    const LightBounds& bounds() const { return bounds_; }

    /// A power of two.
    double intensity_unit() const { return intensity_unit_; }

    /// Bound of what the cluster brings to the receiver, about; 0 only when it brings nothing.
    /// Times intensity_unit() it is an irradiance.
    double importance(const Node& node, const ClusterReceiver& at) const;

    /// Goes down from a node by u in [0, 1); nothing when no child brings anything.
    std::optional<ClusterChoice> descend(uint32_t node,
                                         const ClusterReceiver& at,
                                         double u,
                                         double pmf) const;

    /// `pmf` times the probability of the way that `trail` describes (lowest bit first: 1 = right):
    /// the number that descend() gives, bit for bit.
    double pmf_along(uint32_t node, uint64_t trail, const ClusterReceiver& at, double pmf) const;

    /// Calls visit(item, trail) for every leaf below a node.
    template <class Visitor>
    void for_each_leaf(uint32_t node, Visitor&& visit) const {
        walk(node, 0, 0, visit);
    }

    size_t bytes() const { return nodes_.capacity() * sizeof(Node); }

  private:
    template <class Visitor>
    void walk(uint32_t index, uint64_t trail, int depth, Visitor& visit) const {
        const Node& n = nodes_[index];
        if (n.is_leaf) {
            visit(n.left, trail);
            return;
        }
        walk(n.left, trail, depth + 1, visit);
        walk(n.left + 1, trail | uint64_t(1) << depth, depth + 1, visit);
    }

    /// Begins to load the children of a node, to be weighed once it is chosen.
    void prefetch_below(uint32_t index) const {
        const Node& node = nodes_[index];
        if (node.is_leaf) return;
        const char* children = reinterpret_cast<const char*>(&nodes_[node.left]);
        __builtin_prefetch(children);
        __builtin_prefetch(children + 64);
    }

    std::vector<Node> nodes_;
    LightBounds bounds_;
    double intensity_unit_ = 1;
};

}  // namespace velatura::lights
