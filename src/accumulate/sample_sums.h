// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accumulate/dyadic_sum.h"
#include "accumulate/layer_set.h"
#include "accumulate/tile_grid.h"
#include "image/window.h"

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace velatura::accumulate {

class MatteSums;
class PickedValues;

/// What a pixel knows beside its sums.
struct PixelRecord {
    uint64_t first = 0, end = 0;  ///< samples [first, end) are in the sums; first == end: none
    uint32_t invalid = 0;         ///< bad samples among them, left out of every sum
    uint32_t prim_id = 0xffffffffu;
    uint32_t instance_id = 0xffffffffu;
    bool has_ids = false;  ///< ids come from the first valid sample that hit something
    uint8_t rate = 0;  ///< how the schedule places further samples, in its own code; 0: not decided
};

/// A pixel's mean before its last samples, RGB.
using EarlierMean = std::array<float, 3>;

/// Values of the pixels of a tile, [16][16], row 0 = top, whatever of it lies in the window.
using TileTotals = std::array<Triple, 256>;

/// The sums of one accumulator over the canonical nodes of a pixel's new sample range.
struct NodeSums {
    uint32_t accumulator = 0;
    std::vector<Triple> nodes;  ///< one per canonical node, ascending
};

/// Sums per pixel and accumulator over the canonical dyadic tree of sample indices, in double.
/// Storage comes in tiles of 16×16 pixels and only for accumulators that got a value there other
/// than zero; where few of the pixels did, for those alone. Different tiles may be used by
/// different threads at the same time.
class SampleSums {
  public:
    static constexpr int tile_size = TileGrid::size;
    static_assert(TileGrid::pixels == std::tuple_size_v<TileTotals>);

    /// `final_end`: no sample of this index or above will ever come; lets finished nodes be folded
    /// early, which saves memory and changes no bit of the result. 0 = unknown (needed when the
    /// nodes are to be stored or resumed).
    SampleSums(const image::Window& window, const LayerSet& set, uint64_t final_end = 0);
    ~SampleSums();
    SampleSums(SampleSums&&) noexcept;
    SampleSums& operator=(SampleSums&&) noexcept;

    const image::Window& window() const { return grid_.window; }

    const LayerSet& layer_set() const { return set_; }

    const AccumulatorTable& table() const { return table_; }

    uint64_t final_end() const { return final_end_; }

    /// Whose samples they are; null where the layer set has no Cryptomatte.
    MatteSums* mattes() { return mattes_.get(); }

    const MatteSums* mattes() const { return mattes_.get(); }

    /// What filters other than the mean keep; null where no data layer has such a filter.
    PickedValues* picks() { return picks_.get(); }

    const PickedValues* picks() const { return picks_.get(); }

    const PixelRecord& record(int x, int y) const;

    /// Adds samples [added.first, added.end) to a pixel; they must start where the pixel's samples
    /// end. An empty range says where the first samples of a pixel without any will begin. A rate
    /// other than 0 takes the place of the pixel's.
    void append(int x, int y, const PixelRecord& added, std::span<const NodeSums> sums);

    /// Sets the pixel's rate, which is kept beside its samples. Not while others use its tile.
    void set_rate(int x, int y, uint8_t rate);

    /// The beauty of the pixel when it had the largest power of two of samples that is less than
    /// what it has now. Null where that is not known: its samples do not begin with the first, or
    /// nobody said so.
    const EarlierMean* earlier_mean(int x, int y) const;

    /// For who adds its first samples, and what was stored. Not while others use its tile.
    void set_earlier_mean(int x, int y, const EarlierMean& mean);

    /// Adds all samples of `later`, which must follow pixel by pixel, have the same window and
    /// layer set, and no `final_end`.
    void append(const SampleSums& later);

    /// The fold of all nodes of one accumulator in ascending order; zero where nothing came.
    Triple total(int x, int y, uint32_t accumulator) const;

    size_t tile_count() const { return tiles_.size(); }

    /// The pixels of a tile, the same whatever it holds.
    image::Window tile_window(size_t tile) const;
    /// total() of all its pixels. False: nothing came, and `sums` stays as it is.
    bool tile_totals(size_t tile, uint32_t accumulator, TileTotals& sums) const;
    /// The sum of one node; `slot` indexes `nodes_of(x, y)`.
    Triple node_sum(int x, int y, uint32_t accumulator, size_t slot) const;
    std::vector<DyadicNode> nodes_of(int x, int y) const;

    /// True if any pixel has a value other than zero.
    bool is_used(uint32_t accumulator) const;
    /// All accumulators with a value other than zero somewhere, ascending.
    std::vector<uint32_t> used_accumulators() const;
    size_t memory_bytes() const;
    /// The same of a film whose accumulators all have got one value other than zero somewhere in
    /// every tile, and whose pixels each see one thing for every Cryptomatte. Black ones need less;
    /// counts of samples that are no power of two need more.
    static size_t expected_bytes(const image::Window& window, const LayerSet& set);

  private:
    struct Plane;
    struct Tile;
    struct Joining;

    /// The sum over the samples below `end`, which lies among those to be added.
    Triple sum_at(int x,
                  int y,
                  uint32_t accumulator,
                  const PixelRecord& added,
                  std::span<const NodeSums> sums,
                  uint64_t end) const;
    /// Before they are added: what the mean will have been.
    void keep_mean(int x, int y, const PixelRecord& added, std::span<const NodeSums> sums);

    const Tile* tile_at(int x, int y, size_t& pixel) const;
    Tile& make_tile_at(int x, int y);

    TileGrid grid_;
    LayerSet set_;
    AccumulatorTable table_;
    uint64_t final_end_ = 0;
    std::vector<std::unique_ptr<Tile>> tiles_;
    std::unique_ptr<MatteSums> mattes_;
    std::unique_ptr<PickedValues> picks_;
};

}  // namespace velatura::accumulate
