// SPDX-License-Identifier: Apache-2.0
#include "accumulate/sample_sums.h"

#include "accumulate/matte_sums.h"
#include "accumulate/picked_values.h"
#include "accumulate/pixel_means.h"
#include "base/check.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

namespace velatura::accumulate {

namespace {

constexpr size_t tile_pixels = std::tuple_size_v<TileTotals>;
constexpr size_t max_nodes = 130;
constexpr EarlierMean unknown_mean = {std::numeric_limits<float>::quiet_NaN(), 0, 0};

/// One node of every pixel of a tile. Of many lights a tile sees most in few of its pixels.
class Slot {
  public:
    bool is_empty() const { return !all_ && few_.empty(); }

    Triple value(size_t pixel) const {
        if (all_) return (*all_)[pixel];
        const auto at = place_of(pixel);
        return at != few_.end() && at->pixel == pixel ? at->value : Triple{};
    }

    /// The value to be changed, zero if there was none.
    Triple& at(size_t pixel) {
        if (all_) return (*all_)[pixel];
        const auto at = few_.begin() + (place_of(pixel) - few_.cbegin());
        if (at != few_.end() && at->pixel == pixel) return at->value;
        if (few_.size() < max_few) return few_.insert(at, {Triple{}, uint32_t(pixel)})->value;
        all_ = std::make_unique<TileTotals>();
        for (const Entry& e : few_) (*all_)[e.pixel] = e.value;
        few_ = {};
        return (*all_)[pixel];
    }

    void add_to(TileTotals& sums) const {
        for (size_t i = 0; all_ && i < tile_pixels; ++i) sums[i] += (*all_)[i];
        for (const Entry& e : few_) sums[e.pixel] += e.value;
    }

    size_t heap_bytes() const {
        return few_.capacity() * sizeof(Entry) + (all_ ? sizeof(*all_) : 0);
    }

    /// What at() will look at first; for prefetching.
    const void* data() const { return all_ ? static_cast<const void*>(all_.get()) : few_.data(); }

  private:
    struct Entry {
        Triple value;
        uint32_t pixel;
    };

    static constexpr size_t max_few = tile_pixels / 4;

    std::vector<Entry>::const_iterator place_of(size_t pixel) const {
        if (few_.empty() || few_.back().pixel < pixel) return few_.end();
        return std::lower_bound(few_.begin(), few_.end(), pixel,
                                [](const Entry& e, size_t p) { return e.pixel < p; });
    }

    std::unique_ptr<TileTotals> all_;
    std::vector<Entry> few_;  // ascending by pixel; empty once there are all
};

}  // namespace

/// The sums of one accumulator: slot i holds node i of every pixel; a missing slot is all zero.
struct SampleSums::Plane {
    uint32_t accumulator = 0;
    Slot first;               ///< at hand: most pixels have one node most of the time
    std::vector<Slot> later;  ///< from slot 1 on

    size_t slot_count() const { return 1 + later.size(); }

    const Slot& slot(size_t i) const { return i == 0 ? first : later[i - 1]; }

    Triple value(size_t i, size_t pixel) const {
        return i < slot_count() ? slot(i).value(pixel) : Triple{};
    }

    void set(size_t i, size_t pixel, const Triple& value) {
        if (i >= slot_count() || slot(i).is_empty()) {
            if (value.is_zero()) return;
            if (i >= slot_count()) later.resize(i);
        }
        (i == 0 ? first : later[i - 1]).at(pixel) = value;
    }

    void keep_slots(size_t count) {
        if (count == 0) first = {};
        if (later.size() >= std::max(count, size_t(1)))
            later.resize(std::max(count, size_t(1)) - 1);
    }

    bool is_used() const {
        return !first.is_empty() ||
               std::any_of(later.begin(), later.end(), [](const Slot& s) { return !s.is_empty(); });
    }
};

struct SampleSums::Tile {
    std::vector<Plane> planes;  ///< in the order of their first values
    std::array<PixelRecord, tile_pixels> records;
    std::array<EarlierMean, tile_pixels> earlier;         ///< NaN where not known
    std::array<uint16_t, max_nodes> pixels_with_nodes{};  ///< how many pixels have n nodes

    Tile() { earlier.fill(unknown_mean); }

    const Plane* find(uint32_t accumulator) const {
        const uint32_t plane = buckets_.empty() ? 0 : buckets_[bucket_of(accumulator)];
        return plane == 0 ? nullptr : &planes[plane - 1];
    }

    /// Makes the plane if there is none.
    size_t index_of(uint32_t accumulator) {
        if (2 * (planes.size() + 1) > buckets_.size()) grow();
        uint32_t& plane = buckets_[bucket_of(accumulator)];
        if (plane == 0) {
            planes.push_back(Plane{accumulator, {}, {}});
            plane = uint32_t(planes.size());
        }
        return plane - 1;
    }

    /// Finds the sums of every plane, null where there are none; makes the planes that are missing.
    void assign(std::span<const NodeSums> sums, std::vector<const NodeSums*>& of_plane) {
        for (const NodeSums& s : sums) index_of(s.accumulator);
        of_plane.assign(planes.size(), nullptr);
        for (const NodeSums& s : sums) of_plane[index_of(s.accumulator)] = &s;
    }

    size_t bytes() const {
        size_t bytes = sizeof(Tile) + planes.capacity() * sizeof(Plane) +
                       buckets_.capacity() * sizeof(uint32_t);
        for (const Plane& plane : planes) {
            bytes += plane.later.capacity() * sizeof(Slot) + plane.first.heap_bytes();
            for (const Slot& slot : plane.later) bytes += slot.heap_bytes();
        }
        return bytes;
    }

  private:
    /// The accumulator's, or the empty one where it would go. Neighbors are filled together: no
    /// need to scatter them.
    size_t bucket_of(uint32_t accumulator) const {
        const size_t mask = buckets_.size() - 1;
        size_t at = accumulator & mask;
        while (buckets_[at] != 0 && planes[buckets_[at] - 1].accumulator != accumulator)
            at = (at + 1) & mask;
        return at;
    }

    void grow() {
        buckets_.assign(std::max(size_t(64), 2 * buckets_.size()), 0);
        for (size_t i = 0; i < planes.size(); ++i)
            buckets_[bucket_of(planes[i].accumulator)] = uint32_t(i + 1);
    }

    std::vector<uint32_t> buckets_;  // index into planes + 1, 0 = empty; a power of two of them
};

/// How new nodes of a pixel join with those that it has: the same for all its accumulators.
struct SampleSums::Joining {
    std::vector<DyadicNode> nodes;  ///< after joining
    std::vector<DyadicNode> added;
    size_t old_count = 0;
    std::vector<uint32_t> joins_after;  ///< of each added node
    bool is_at_end = false;  ///< no two old nodes join: what is added reaches the last one at most
    bool is_single = false;  ///< one added node, and it is or joins the only one
    std::vector<Triple> values;  ///< of apply(), which must not begin with zeros

    void plan(const DyadicRule& rule, const PixelRecord& old, const PixelRecord& later) {
        rule.set_nodes(old.first, old.end, nodes);
        old_count = nodes.size();
        DyadicRule(later.first).set_nodes(later.first, later.end, added);
        joins_after.assign(added.size(), 0);
        is_at_end = true;
        for (size_t i = 0; i < added.size(); ++i) {
            rule.push(nodes, added[i], [this, i](size_t) { ++joins_after[i]; });
            is_at_end = is_at_end && nodes.size() >= old_count;
        }
        is_single = added.size() == 1 && old_count <= 1 && nodes.size() == 1;
        values.resize(old_count + added.size());
    }

    void apply(Plane& plane, size_t pixel, const NodeSums* sums) {
        if (is_single && sums && !plane.first.is_empty()) {
            Triple& value = plane.first.at(pixel);
            value = old_count == 0 ? sums->nodes[0] : value + sums->nodes[0];
            return;
        }
        size_t count = 0;
        for (; count < old_count; ++count) values[count] = plane.value(count, pixel);
        for (size_t i = 0; i < added.size(); ++i) {
            values[count++] = sums ? sums->nodes[i] : Triple{};
            for (uint32_t join = joins_after[i]; join > 0; --join) {
                values[count - 2] += values[count - 1];
                --count;
            }
        }
        for (size_t i = 0; i < count; ++i) plane.set(i, pixel, values[i]);
        for (size_t i = count; i < old_count; ++i) plane.set(i, pixel, Triple{});
    }
};

SampleSums::SampleSums(const image::Window& window, const LayerSet& set, uint64_t final_end)
    : grid_(window), set_(set), table_(set), final_end_(final_end) {
    VELATURA_CHECK(!window.is_empty(), "a film needs pixels");
    VELATURA_CHECK(!set.groups.empty(), "a film needs a light group");
    tiles_.resize(grid_.count());
    if (set.has_mattes()) mattes_ = std::make_unique<MatteSums>(window);
    if (std::vector<DataFilter> filters = set.picking_filters(); !filters.empty())
        picks_ = std::make_unique<PickedValues>(window, std::move(filters));
}

SampleSums::~SampleSums() = default;
SampleSums::SampleSums(SampleSums&&) noexcept = default;
SampleSums& SampleSums::operator=(SampleSums&&) noexcept = default;

const SampleSums::Tile* SampleSums::tile_at(int x, int y, size_t& pixel) const {
    VELATURA_DCHECK(grid_.window.contains(x, y), "pixel outside the data window");
    pixel = grid_.pixel_of(x, y);
    return tiles_[grid_.tile_of(x, y)].get();
}

SampleSums::Tile& SampleSums::make_tile_at(int x, int y) {
    auto& tile = tiles_[grid_.tile_of(x, y)];
    if (!tile) tile = std::make_unique<Tile>();
    return *tile;
}

const PixelRecord& SampleSums::record(int x, int y) const {
    static const PixelRecord empty;
    size_t pixel = 0;
    const Tile* tile = tile_at(x, y, pixel);
    return tile ? tile->records[pixel] : empty;
}

std::vector<DyadicNode> SampleSums::nodes_of(int x, int y) const {
    const PixelRecord& r = record(x, y);
    return DyadicRule(r.first, final_end_).nodes(r.first, r.end);
}

Triple SampleSums::sum_at(int x,
                          int y,
                          uint32_t accumulator,
                          const PixelRecord& added,
                          std::span<const NodeSums> sums,
                          uint64_t end) const {
    const auto incoming = std::find_if(
        sums.begin(), sums.end(), [&](const NodeSums& s) { return s.accumulator == accumulator; });
    std::vector<DyadicNode> nodes = nodes_of(x, y);
    std::vector<Triple> values;
    for (size_t i = 0; i < nodes.size(); ++i) values.push_back(node_sum(x, y, accumulator, i));
    const DyadicRule rule(record(x, y).first, final_end_);
    const std::vector<DyadicNode> more = DyadicRule(added.first).nodes(added.first, added.end);
    for (size_t i = 0; i < more.size() && more[i].end <= end; ++i) {
        values.push_back(incoming == sums.end() ? Triple{} : incoming->nodes[i]);
        rule.push(nodes, more[i], [&](size_t at) {
            values[at] += values[at + 1];
            values.pop_back();
        });
    }
    Triple sum;
    for (const Triple& value : values) sum += value;
    return sum;
}

void SampleSums::keep_mean(int x, int y, const PixelRecord& added, std::span<const NodeSums> sums) {
    const PixelRecord& record = this->record(x, y);
    // What a pixel's first samples bring tells their giver: film::PixelAccumulator
    if (record.first != 0 || record.end == 0) return;
    const uint64_t power = std::bit_floor(added.end - 1);
    if (power < record.end) return;
    const auto sum = [&](uint32_t accumulator) {
        return power == record.end ? total(x, y, accumulator)
                                   : sum_at(x, y, accumulator, added, sums, power);
    };
    set_earlier_mean(x, y, mean_of(sum(AccumulatorTable::beauty), sum(AccumulatorTable::coverage)));
}

const EarlierMean* SampleSums::earlier_mean(int x, int y) const {
    size_t pixel = 0;
    const Tile* tile = tile_at(x, y, pixel);
    return tile && !std::isnan(tile->earlier[pixel][0]) ? &tile->earlier[pixel] : nullptr;
}

void SampleSums::set_earlier_mean(int x, int y, const EarlierMean& mean) {
    Tile& tile = make_tile_at(x, y);
    size_t pixel = 0;
    tile_at(x, y, pixel);
    tile.earlier[pixel] = mean;
}

void SampleSums::append(int x, int y, const PixelRecord& added, std::span<const NodeSums> sums) {
    Tile& tile = make_tile_at(x, y);
    size_t pixel = 0;
    tile_at(x, y, pixel);
    PixelRecord& record = tile.records[pixel];
    const bool is_first = record.first == record.end;
    if (added.rate != 0) record.rate = added.rate;
    if (added.first == added.end) {
        // Where the samples would begin is worth knowing: what follows must begin there
        if (is_first) record.first = record.end = added.first;
        return;
    }
    VELATURA_CHECK(is_first || added.first == record.end, "samples must follow what the pixel has");
    if (is_first) record.first = record.end = added.first;
    keep_mean(x, y, added, sums);

    const DyadicRule rule(record.first, final_end_);
    thread_local Joining joining;
    joining.plan(rule, record, added);
    if (joining.is_at_end) {
        // Where nothing comes nothing changes: of many lights a pixel sees few
        // Of many lights planes lie far apart: ask for all of them before the first is needed
        thread_local std::vector<size_t> planes;
        planes.clear();
        for (const NodeSums& s : sums) planes.push_back(tile.index_of(s.accumulator));
        for (const size_t p : planes) __builtin_prefetch(tile.planes[p].first.data());
        for (size_t i = 0; i < sums.size(); ++i)
            joining.apply(tile.planes[planes[i]], pixel, &sums[i]);
    } else {
        thread_local std::vector<const NodeSums*> incoming;
        tile.assign(sums, incoming);
        for (size_t p = 0; p < tile.planes.size(); ++p)
            joining.apply(tile.planes[p], pixel, incoming[p]);
    }

    record.end = added.end;
    record.invalid += added.invalid;
    if (!record.has_ids && added.has_ids) {
        record.prim_id = added.prim_id;
        record.instance_id = added.instance_id;
        record.has_ids = true;
    }

    // Free the slots that no pixel of the tile has a node for any more
    const size_t node_count = joining.nodes.size(), old_count = joining.old_count;
    if (!is_first) --tile.pixels_with_nodes[old_count];
    ++tile.pixels_with_nodes[node_count];
    if (node_count >= old_count) return;
    size_t needed = max_nodes - 1;
    while (tile.pixels_with_nodes[needed] == 0) --needed;
    for (Plane& plane : tile.planes) plane.keep_slots(needed);
}

void SampleSums::set_rate(int x, int y, uint8_t rate) {
    Tile& tile = make_tile_at(x, y);
    size_t pixel = 0;
    tile_at(x, y, pixel);
    tile.records[pixel].rate = rate;
}

void SampleSums::append(const SampleSums& later) {
    VELATURA_CHECK(later.final_end_ == 0 && later.grid_.window == grid_.window,
                   "sums that do not fit together");
    const std::vector<uint32_t> used = later.used_accumulators();
    std::vector<NodeSums> sums;
    for (int y = grid_.window.y0; y < grid_.window.y1; ++y) {
        for (int x = grid_.window.x0; x < grid_.window.x1; ++x) {
            const size_t nodes = later.nodes_of(x, y).size();
            sums.clear();
            for (const uint32_t accumulator : used) {
                NodeSums s;
                s.accumulator = accumulator;
                bool is_zero = true;
                for (size_t i = 0; i < nodes; ++i) {
                    s.nodes.push_back(later.node_sum(x, y, accumulator, i));
                    is_zero = is_zero && s.nodes.back().is_zero();
                }
                if (!is_zero) sums.push_back(std::move(s));
            }
            const bool had_none = record(x, y).end == record(x, y).first;
            append(x, y, later.record(x, y), sums);
            if (const EarlierMean* mean = later.earlier_mean(x, y); mean && had_none)
                set_earlier_mean(x, y, *mean);
        }
    }
    if (mattes_ && later.mattes_) mattes_->add(*later.mattes_);
    if (picks_ && later.picks_) picks_->add(*later.picks_);
}

Triple SampleSums::node_sum(int x, int y, uint32_t accumulator, size_t slot) const {
    size_t pixel = 0;
    const Tile* tile = tile_at(x, y, pixel);
    const Plane* plane = tile ? tile->find(accumulator) : nullptr;
    return plane ? plane->value(slot, pixel) : Triple{};
}

Triple SampleSums::total(int x, int y, uint32_t accumulator) const {
    size_t pixel = 0;
    const Tile* tile = tile_at(x, y, pixel);
    const Plane* plane = tile ? tile->find(accumulator) : nullptr;
    if (!plane) return {};
    Triple sum;
    for (size_t slot = 0; slot < plane->slot_count(); ++slot) sum += plane->value(slot, pixel);
    return sum;
}

bool SampleSums::tile_totals(size_t tile_index, uint32_t accumulator, TileTotals& sums) const {
    const Tile* tile = tiles_[tile_index].get();
    const Plane* plane = tile ? tile->find(accumulator) : nullptr;
    if (!plane) return false;
    sums.fill({});
    for (size_t slot = 0; slot < plane->slot_count(); ++slot) plane->slot(slot).add_to(sums);
    return true;
}

image::Window SampleSums::tile_window(size_t tile_index) const {
    return grid_.window_of(tile_index);
}

bool SampleSums::is_used(uint32_t accumulator) const {
    return std::any_of(tiles_.begin(), tiles_.end(), [accumulator](const auto& tile) {
        const Plane* plane = tile ? tile->find(accumulator) : nullptr;
        return plane && plane->is_used();
    });
}

std::vector<uint32_t> SampleSums::used_accumulators() const {
    std::vector<uint8_t> is_used(table_.total_count(), 0);
    for (const auto& tile : tiles_) {
        if (!tile) continue;
        for (const Plane& plane : tile->planes)
            is_used[plane.accumulator] |= uint8_t(plane.is_used());
    }
    std::vector<uint32_t> list;
    for (uint32_t a = 0; a < is_used.size(); ++a) {
        if (is_used[a]) list.push_back(a);
    }
    return list;
}

size_t SampleSums::expected_bytes(const image::Window& window, const LayerSet& set) {
    const AccumulatorTable table(set);
    const bool has_half = set.halves;
    // Beauty and coverage always come in halves
    const size_t planes = has_half ? 2 * size_t(table.count())
                                   : size_t(table.count()) + AccumulatorTable::coverage + 1;
    const size_t per_plane = sizeof(Plane) + sizeof(TileTotals);
    const auto mattes = size_t(std::count(set.mattes.begin(), set.mattes.end(), true));
    return TileGrid(window).count() * (sizeof(Tile) + planes * per_plane) +
           mattes * MatteSums::expected_bytes(window) +
           PickedValues::expected_bytes(window, set.picking_filters().size());
}

size_t SampleSums::memory_bytes() const {
    size_t bytes = tiles_.size() * sizeof(tiles_[0]) + (mattes_ ? mattes_->memory_bytes() : 0) +
                   (picks_ ? picks_->memory_bytes() : 0);
    for (const auto& tile : tiles_) {
        if (tile) bytes += tile->bytes();
    }
    return bytes;
}

}  // namespace velatura::accumulate
