// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace velatura::sampling {

/// Piecewise constant density over the unit cube [0, 1)⁸, learned from samples: which random
/// numbers of an estimate are worth more samples than others.
///
/// Cells of a kd-tree, each with a density in proportion to the root of the mean square of its
/// samples, which is the best one; a share stays uniform, so that every density is positive and the
/// estimate stays unbiased. A cut must pay in both halves of the samples, the one that chose it and
/// the other one: noise alone cuts nothing.
/// Numbers are warped cut by cut along one axis each, which keeps strata together.
/// Ref: Guo, Bauszat, Bikker, Eisemann 2018, "Primary Sample Space Path Guiding".
/// Threads: immutable, safe to share.
class KdWarp {
  public:
    static constexpr size_t dimension_count = 8;
    using Point = std::array<double, dimension_count>;

    struct Sample {
        Point u{};           ///< as it was used: warped
        double density = 1;  ///< with which u was drawn, > 0
        double square = 0;   ///< of the value of the estimate, were u uniform
    };

    /// Uniform.
    KdWarp() = default;

    /// The halves are the samples of even and of odd index.
    explicit KdWarp(std::span<const Sample> samples);

    size_t cell_count() const { return (nodes_.size() + 1) / 2; }

    /// Warps uniform numbers in place. Returns: density of the result, > 0.
    double warp(Point& u) const;

    /// Density at u, in [0, 1)⁸.
    double density(const Point& u) const;

  private:
    struct Node {
        uint32_t children = 0;  ///< index of the two; 0: a cell
        uint8_t axis = 0;
        double cut = 0;    ///< where along the axis of the cube
        double below = 0;  ///< chance of the child below the cut
    };

    class Builder;

    std::vector<Node> nodes_ = {{}};
};

}  // namespace velatura::sampling
