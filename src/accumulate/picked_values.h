// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accumulate/data_layer.h"
#include "accumulate/tile_grid.h"
#include "image/window.h"

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

namespace velatura::accumulate {

/// The values of a data layer at one sample, or what a filter other than the mean keeps of many.
struct PickedValue {
    float depth = std::numeric_limits<float>::infinity();  ///< of the sample, along the view
    std::array<float, 4> values = {0, 0, 0, 0};
    bool is_there = false;

    bool operator==(const PickedValue&) const = default;
};

/// Adds another one: the nearer (at equal depths the one with the smaller numbers), the minimum or
/// the maximum. The result does not depend on the order, nor on how often a value comes.
void pick(DataFilter filter, PickedValue& kept, const PickedValue& other);

/// Per pixel and data layer what its filter keeps. Threads: as SampleSums.
class PickedValues {
  public:
    /// filters: of each layer that is not summed.
    PickedValues(const image::Window& window, std::vector<DataFilter> filters);

    const std::vector<DataFilter>& filters() const { return filters_; }

    void add(int x, int y, size_t layer, const PickedValue& value);

    /// Adds all of the other, which has the same window and filters.
    void add(const PickedValues& other);

    PickedValue at(int x, int y, size_t layer) const;

    size_t memory_bytes() const;

    static size_t expected_bytes(const image::Window& window, size_t layers) {
        return window.pixel_count() * layers * sizeof(PickedValue);
    }

  private:
    TileGrid grid_;
    std::vector<DataFilter> filters_;
    std::vector<std::vector<PickedValue>> tiles_;  ///< [tile][pixel][layer]; empty: nothing yet
};

}  // namespace velatura::accumulate
