// SPDX-License-Identifier: Apache-2.0
#include "base/hash.h"
#include "base/tasks.h"
#include "guiding/equal_area.h"
#include "guiding/guiding_field.h"
#include "sampling/owen.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

namespace velatura::guiding {

namespace {

/// Records that brought light, per cell: enough for a density of a few dozen steps.
constexpr size_t records_per_cell = 600;
/// The tree over places is built from this many records at most, evenly chosen: its cells need no
/// finer choice.
constexpr size_t places_limit = size_t(1) << 16;
/// A division that leaves less than this share on one side is no division by the median.
constexpr size_t min_part = 8;

}  // namespace

/// Builds a field; holds what only the building needs.
class FieldBuilder {
  public:
    FieldBuilder(GuidingField& field, std::span<const TrainingSample> records)
        : field_(field), records_(records) {}

    void build() {
        for (uint32_t i = 0; i < records_.size(); ++i) {
            const float w = records_[i].weight;
            if (w >= 0.0f && std::isfinite(w)) used_.push_back(i);
            if (w > 0.0f && std::isfinite(w)) bright_.push_back(i);
        }
        if (bright_.empty()) return;
        measure();
        divide_places();
        fit_directions();
    }

  private:
    using Coordinates = GuidingField::Coordinates;

    struct Extent {
        Coordinates low, high;

        Extent() {
            std::fill_n(low.c, 6, std::numeric_limits<float>::infinity());
            std::fill_n(high.c, 6, -std::numeric_limits<float>::infinity());
        }

        void add(const Coordinates& at) {
            for (size_t k = 0; k < 6; ++k) {
                low.c[k] = std::min(low.c[k], at.c[k]);
                high.c[k] = std::max(high.c[k], at.c[k]);
            }
        }

        float length(size_t axis) const { return high.c[axis] - low.c[axis]; }

        uint32_t longest() const {
            uint32_t best = 0;
            for (uint32_t k = 1; k < 6; ++k) {
                if (length(k) > length(best)) best = k;
            }
            return best;
        }
    };

    /// The box of the places, as a cube: one scale for all axes.
    void measure() {
        Box3 box;
        for (const uint32_t i : used_) box.extendBy(records_[i].at.p);
        field_.origin_ = box.min;
        const Vec3 size = box.size();
        const float longest = std::max(size.x, std::max(size.y, size.z));
        field_.inverse_extent_ = longest > 0.0f ? 1.0f / longest : 0.0f;
        if (!std::isfinite(field_.inverse_extent_)) field_.inverse_extent_ = 0.0f;
    }

    void divide_places() {
        const size_t stride = (bright_.size() + places_limit - 1) / places_limit;
        for (size_t i = 0; i < bright_.size(); i += stride) {
            places_.push_back(field_.coordinates(records_[bright_[i]].at));
        }
        cell_limit_ = std::max<size_t>(1, records_per_cell / stride);
        field_.nodes_.emplace_back();
        divide(0, places_);
    }

    void divide(size_t node, std::span<Coordinates> places) {
        Extent extent;
        for (const Coordinates& at : places) extent.add(at);
        const uint32_t axis = extent.longest();
        if (places.size() > cell_limit_ && extent.length(axis) > 0.0f) {
            const float split = split_position(places, axis, extent);
            const auto middle = std::partition(places.begin(), places.end(),
                                               [&](const auto& at) { return at.c[axis] < split; });
            const size_t below = size_t(middle - places.begin());
            const uint32_t next = uint32_t(field_.nodes_.size());
            field_.nodes_[node] = {split, axis, next};
            field_.nodes_.resize(field_.nodes_.size() + 2);
            divide(next, places.first(below));
            divide(next + 1, places.subspan(below));
            return;
        }
        field_.nodes_[node].next = uint32_t(extents_.size());
        extents_.push_back(extent);
    }

    /// The median, or the middle of the extent where many records lie at the median itself. Both
    /// sides get records.
    static float split_position(std::span<Coordinates> places,
                                uint32_t axis,
                                const Extent& extent) {
        const auto median = places.begin() + std::ptrdiff_t(places.size() / 2);
        std::nth_element(places.begin(), median, places.end(),
                         [&](const auto& a, const auto& b) { return a.c[axis] < b.c[axis]; });
        const float split = median->c[axis];
        const auto below = std::count_if(places.begin(), median,
                                         [&](const auto& at) { return at.c[axis] < split; });
        if (size_t(below) * min_part >= places.size()) return split;
        const float middle = extent.low.c[axis] + 0.5f * extent.length(axis);
        return middle > extent.low.c[axis] ? middle : extent.high.c[axis];
    }

    /// A fresh number in [−½, ½) for a record.
    static float offset(uint32_t record, uint64_t axis) {
        return sampling::unit_float(uint32_t(hash_combine(record, axis) >> 32)) - 0.5f;
    }

    /// The cell that a record informs: that of a place up to half a cell's extent away, so that
    /// neighboring cells go over into each other.
    uint32_t informed_cell(uint32_t record) const {
        Coordinates at = field_.coordinates(records_[record].at);
        const Extent& extent = extents_[field_.cell_of(at)];
        for (size_t k = 0; k < 3; ++k) at.c[k] += extent.length(k) * offset(record, k);
        return field_.cell_of(at);
    }

    void fit_directions() {
        // Sort the records by cell, in their own order within each
        std::vector<uint32_t> cell_of(used_.size());
        parallel_for(
            used_.size(), [&](size_t i) { cell_of[i] = informed_cell(used_[i]); }, 4096);
        std::vector<size_t> start(extents_.size() + 1, 0);
        for (const uint32_t cell : cell_of) ++start[cell + 1];
        std::partial_sum(start.begin(), start.end(), start.begin());
        std::vector<uint32_t> sorted(used_.size());
        std::vector<size_t> next = start;
        for (size_t i = 0; i < used_.size(); ++i) sorted[next[cell_of[i]]++] = used_[i];

        // Fit every cell on its own, then put the trees one after another
        std::vector<std::vector<DirectionNode>> trees(extents_.size());
        std::vector<double> means(extents_.size(), 0.0);
        parallel_for(trees.size(), [&](size_t cell) {
            std::vector<WeightedDirection> items;
            items.reserve(start[cell + 1] - start[cell]);
            for (size_t i = start[cell]; i < start[cell + 1]; ++i) {
                const TrainingSample& r = records_[sorted[i]];
                if (!(r.weight > 0.0f)) continue;
                items.push_back({square_from_direction(r.wi), r.weight});
                means[cell] += double(r.weight);
            }
            if (!items.empty()) means[cell] /= double(start[cell + 1] - start[cell]);
            trees[cell] = fit_direction_tree(items);
        });
        for (size_t cell = 0; cell < trees.size(); ++cell) {
            const std::vector<DirectionNode>& tree = trees[cell];
            const uint32_t root = uint32_t(field_.directions_.size());
            field_.cells_.push_back(
                {tree.empty() ? GuidingField::no_tree : root, float(means[cell])});
            field_.directions_.insert(field_.directions_.end(), tree.begin(), tree.end());
        }
    }

    GuidingField& field_;
    std::span<const TrainingSample> records_;
    std::vector<uint32_t> used_;    // records that count
    std::vector<uint32_t> bright_;  // those of them that brought light
    std::vector<Coordinates> places_;
    std::vector<Extent> extents_;  // [cell]
    size_t cell_limit_ = 1;
};

GuidingField::GuidingField(std::span<const TrainingSample> records) {
    FieldBuilder(*this, records).build();
}

}  // namespace velatura::guiding
