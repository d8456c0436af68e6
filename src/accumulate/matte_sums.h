// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accumulate/tile_grid.h"
#include "image/window.h"

#include <cstdint>
#include <span>
#include <vector>

namespace velatura::accumulate {

/// A thing that samples of a pixel met: its id in the Cryptomatte of a MatteKind, and the sum of
/// their filter weights.
struct MatteWeight {
    /// Weights are whole numbers of this: 1, the weight of filters without negative lobes, exactly;
    /// others within 2^-27. Sums of whole numbers do not depend on their order, and have room for
    /// 2^37 samples.
    static constexpr double unit = 0x1p-26;

    uint8_t kind = 0;
    uint32_t id = 0;  ///< see matte_id()
    int64_t weight = 0;

    bool operator==(const MatteWeight&) const = default;
};

/// `weight` as a whole number of units.
int64_t matte_weight(double weight);

/// Sorts by kind and id, adds what has both in common, and drops sums of 0.
void join_matte_weights(std::vector<MatteWeight>& list);

/// Whose samples they are, per pixel. Exact: what was met by one sample in a thousand is kept until
/// the file ranks it. 16 bytes for each thing that a pixel sees. Threads: as SampleSums.
class MatteSums {
  public:
    explicit MatteSums(const image::Window& window);

    /// Adds to a pixel; `list` as join_matte_weights() leaves it.
    void add(int x, int y, std::span<const MatteWeight> list);

    /// Adds all of the other, which has the same window.
    void add(const MatteSums& other);

    /// Of a pixel, by kind and id.
    std::vector<MatteWeight> at(int x, int y) const;

    /// All ids of a kind that some pixel has, ascending.
    std::vector<uint32_t> used_ids(uint8_t kind) const;

    size_t memory_bytes() const;

    /// The same of pixels that see one thing of one kind each.
    static size_t expected_bytes(const image::Window& window) {
        return window.pixel_count() * sizeof(Entry);
    }

  private:
    /// Of one pixel of a tile.
    struct Entry {
        int64_t weight;
        uint32_t id;
        uint16_t pixel;
        uint8_t kind;
    };

    static_assert(sizeof(Entry) == 16);

    TileGrid grid_;
    std::vector<std::vector<Entry>> tiles_;  ///< each by pixel, kind and id
};

}  // namespace velatura::accumulate
