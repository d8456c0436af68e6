// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"

#include <cstdint>
#include <span>
#include <vector>

namespace velatura::guiding {

struct DirectionSample {
    Vec3 wi;        ///< unit, render space
    float pdf = 0;  ///< [1/sr], > 0
};

/// A point of the equal-area square, with what arrived from there.
struct WeightedDirection {
    Vec2 q;
    float weight = 0;  ///< >= 0, finite
};

/// A quarter of the equal-area square divided by four, again and again: the directional quadtree of
/// Müller, Gross & Novák 2017, "Practical Path Guiding for Efficient Light-Transport Simulation",
/// section 3.1. Quarters count 0 lower left, 1 lower right, 2 upper left, 3 upper right.
struct DirectionNode {
    float share[4];     ///< of the node's probability, > 0, sum 1 within rounding
    uint32_t child[4];  ///< index from the root of the tree; 0 = uniform from here on
};

/// Piecewise constant density over the sphere. A view: the nodes belong to the field.
class DirectionTree {
  public:
    explicit DirectionTree(const DirectionNode* root) : root_(root) {}

    /// u in [0, 1)².
    DirectionSample sample(Vec2 u) const;

    /// [1/sr]; wi unit. Positive everywhere.
    float pdf(const Vec3& wi) const;

  private:
    const DirectionNode* root_;
};

/// Fits a tree to what arrived; the items are reordered. The shares of every node are those of the
/// weights, drawn towards equality by as much as few items, or few that dominate, leave in doubt:
/// one lucky path must not make a spike.
/// Returns: the nodes, the root first. Empty when nothing arrived.
std::vector<DirectionNode> fit_direction_tree(std::span<WeightedDirection> items);

}  // namespace velatura::guiding
