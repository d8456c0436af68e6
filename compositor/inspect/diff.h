// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "image/image.h"

#include <string>
#include <vector>

namespace velatura::compositor::inspect {

/// How far one layer of two files is apart; B is the reference. The alpha of a layer with color is
/// an entry of its own, "rgba.A": errors are those of RGB, as a render states them.
struct LayerDifference {
    std::string layer;
    double largest = 0;  ///< max |a − b|
    double mean = 0;     ///< mean |a − b|
    /// mean((a − b)² / (b² + 0.01)) over pixels and channels, docs/engineering/numerics.md;
    /// infinite where a value is finite in one file only
    double rel_mse = 0;
    size_t different = 0;  ///< pixels with a different value
    int x = 0, y = 0;      ///< where `largest` is
    bool only_in_a = false, only_in_b = false;
};

struct Difference {
    std::vector<LayerDifference> layers;
    double worst_rel_mse = 0;
    bool is_equal = false;  ///< same layers, all bits the same
};

/// Errors: "diff-window" (different data windows).
Result<Difference> compare(const image::Image& a, const image::Image& b);

/// A − B of every color channel that both have, float.
image::Image difference_image(const image::Image& a, const image::Image& b);

}  // namespace velatura::compositor::inspect
