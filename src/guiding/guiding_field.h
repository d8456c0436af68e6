// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "guiding/direction_tree.h"
#include "guiding/training_sample.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace velatura::guiding {

/// What is known of a place.
struct Guide {
    DirectionTree directions;
    float mean = 0;  ///< of TrainingSample::weight, > 0
};

/// From where light comes, as learned from records of paths: a tree over place and normal, with a
/// density of directions in each of its cells. Immutable; a function of the records and their
/// order alone, whatever the threads. Scaling all places by 2^k changes no bit of any density.
/// Ref: Müller, Gross & Novák 2017, "Practical Path Guiding for Efficient Light-Transport
/// Simulation"; Müller 2019, "Path Guiding in Production", chapter 10, for spreading records over
/// neighboring cells.
class GuidingField {
  public:
    GuidingField() = default;

    /// Learns; records whose weight is negative or not finite do not count.
    explicit GuidingField(std::span<const TrainingSample> records);

    /// Nothing was learned.
    bool is_empty() const { return cells_.empty(); }

    /// What was learned of a place; nothing where nothing arrived.
    std::optional<Guide> at(const GuidingPoint& place) const;

    size_t cell_count() const { return cells_.size(); }

    size_t memory_bytes() const;

  private:
    friend class FieldBuilder;

    static constexpr uint32_t no_tree = ~uint32_t(0);
    static constexpr uint32_t leaf_axis = 6;

    /// Coordinates of the tree: the place relative to the records' box, then the normal.
    struct Coordinates {
        float c[6];
    };

    /// Below `split` along `axis` goes to `next`, the rest to `next` + 1; a leaf's `next` is its
    /// cell.
    struct SpatialNode {
        float split = 0;
        uint32_t axis = leaf_axis;
        uint32_t next = 0;
    };

    Coordinates coordinates(const GuidingPoint& place) const;
    uint32_t cell_of(const Coordinates& at) const;

    Vec3 origin_ = Vec3(0.0f);
    float inverse_extent_ = 0;
    std::vector<SpatialNode> nodes_;  // root first

    struct Cell {
        uint32_t root = no_tree;  // index in directions_
        float mean = 0;
    };

    std::vector<Cell> cells_;
    std::vector<DirectionNode> directions_;
};

}  // namespace velatura::guiding
