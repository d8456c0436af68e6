// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accel/bvh_layout.h"

#include <cstdint>
#include <functional>

namespace velatura::accel {

/// A box at both keys of a segment; empty where nothing is there.
struct KeyBoxes {
    Box3 from, to;

    bool is_empty() const { return from.isEmpty(); }

    void extend(const KeyBoxes& other) {
        from.extendBy(other.from);
        to.extendBy(other.to);
    }
};

/// Gives a MovingTree, of which the number of segments is set, nodes in the shape of another tree:
/// with boxes that hold in each segment what moves straight on inside those of the leaves below,
/// up to roundings by 6·2^-24 of the largest coordinate. box_of_leaf(leaf, segment) is called from
/// several threads.
void fit_boxes(const WideTree& shape,
               const std::function<KeyBoxes(uint32_t leaf, uint32_t segment)>& box_of_leaf,
               MovingTree& tree);

}  // namespace velatura::accel
