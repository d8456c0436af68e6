// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/layer/path.h"

#include <cstddef>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

namespace velatura::translate::linking {

/// Prims that hold geometry, of which some become the casters of what is below them.
class CasterTree {
  public:
    /// A prim on the way from the root to a thing.
    struct Step {
        usd::layer::Path prim;
        /// An object: not divided where there are others (an instance, a point instancer, a
        /// subcomponent).
        bool is_object = false;
    };

    CasterTree() : nodes_(1) {}

    /// A thing to be told apart from others: the prims that hold it, the outermost first, and
    /// itself.
    void add(const std::vector<Step>& way);

    /// A thing with a caster of its own, chosen elsewhere; after all of add().
    void add_other(const std::vector<Step>& way);

    /// Chooses the casters, beside `others`. The root is divided into its children, then, level by
    /// level, prims that hold several things into these: as long as there are fewer than
    /// `few_casters`, or where a prim also holds others' things; never to more than `many_casters`,
    /// but for the first division of all there is.
    void divide(size_t others);

    /// After divide(): the caster of a thing of add().
    usd::layer::Path caster_of(const std::vector<Step>& way) const;

    static constexpr size_t few_casters = 8, many_casters = 64;

  private:
    /// Of a prim; below it a leaf without a path of its own stands for what the prim itself is.
    struct Node {
        usd::layer::Path prim;
        uint32_t parent = 0;
        bool is_object = false, holds_others = false, is_caster = false;
        std::vector<uint32_t> children;
    };

    uint32_t add_node(uint32_t parent, usd::layer::Path key, usd::layer::Path prim);

    /// What a node is divided into; empty: there is nothing to tell apart.
    std::vector<uint32_t> parts_of(uint32_t node, bool opens_objects) const;

    std::vector<Node> nodes_;  ///< the first is the pseudo-root
    std::map<std::pair<uint32_t, usd::layer::Path>, uint32_t> child_;
};

}  // namespace velatura::translate::linking
