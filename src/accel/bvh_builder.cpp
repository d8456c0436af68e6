// SPDX-License-Identifier: Apache-2.0
#include "accel/bvh_builder.h"

#include "accel/spatial_split.h"
#include "base/check.h"
#include "base/tasks.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <limits>

namespace velatura::accel {

namespace {

constexpr int max_bins = 32;
constexpr size_t parallel_split_count = 4096;  // smaller subtrees stay on one thread
constexpr size_t small_count = 8;              // nodes that know where their references are
constexpr size_t least_spatial_count = 16;     // fewer references than that are not worth dividing
constexpr size_t least_spare = 4096;           // so that small scenes can be divided, too

struct Split {
    int axis = -1;
    int bin = 0;  // first bin of the right side
    double cost = std::numeric_limits<double>::infinity();
    Bounds4 left, right;
};

// Maps a centroid to its bin, the same for counting and partitioning.
struct BinMap {
    alignas(16) float origin[4];
    alignas(16) float scale[4];
    int bins = 0;

    BinMap(const Bounds4& centroids, int n) : bins(n) {
        for (int k = 0; k < 4; ++k) {
            const float extent = k < 3 ? centroids.upper[k] - centroids.lower[k] : 0.0f;
            origin[k] = k < 3 ? centroids.lower[k] : 0.0f;
            const float s = float(n) * (1.0f - 0x1p-20f) / extent;
            scale[k] = extent > 0 && s <= std::numeric_limits<float>::max() ? s : 0.0f;
        }
    }

    int bin(const BuildPrim& p, int axis) const {
        return std::min(bins - 1, int((centroid(p, axis) - origin[axis]) * scale[axis]));
    }
};

// The bins of all axes; only those of the map are ever looked at.
class Bins {
  public:
    explicit Bins(const BinMap& map) : size_(size_t(map.bins)) {
        for (size_t axis = 0; axis < 3; ++axis) {
            for (size_t b = 0; b < size_; ++b) {
                lower_[axis][b] = Bounds4{}.lower;
                upper_[axis][b] = Bounds4{}.upper;
                count_[axis][b] = 0;
            }
        }
    }

    void fill(std::span<const BuildPrim> prims, const BinMap& map) {
        for (const BuildPrim& p : prims) {
            const Vec4 low = lower_of(p), high = upper_of(p);
            for (int axis = 0; axis < 3; ++axis) {
                const auto a = size_t(axis);
                const auto b = size_t(map.bin(p, axis));
                extend(a, b, low, high);
                ++count_[a][b];
            }
        }
    }

    void add(const Bins& other) {
        for (size_t axis = 0; axis < 3; ++axis) {
            for (size_t b = 0; b < size_; ++b) {
                extend(axis, b, other.lower_[axis][b], other.upper_[axis][b]);
                count_[axis][b] += other.count_[axis][b];
            }
        }
    }

    Split best_split(const BinMap& map) const {
        Split best;
        for (size_t axis = 0; axis < 3; ++axis) {
            if (map.scale[axis] != 0.0f) best_on_axis(axis, best);
        }
        return best;
    }

  private:
    void extend(size_t axis, size_t b, Vec4 low, Vec4 high) {
        Vec4 &lower = lower_[axis][b], &upper = upper_[axis][b];
        lower = lower < low ? lower : low;
        upper = upper > high ? upper : high;
    }

    void best_on_axis(size_t axis, Split& best) const {
        Bounds4 right[max_bins];
        double right_cost[max_bins];
        Bounds4 box;
        size_t count = 0;
        for (size_t i = size_ - 1; i > 0; --i) {
            box.extend(lower_[axis][i], upper_[axis][i]);
            count += count_[axis][i];
            right[i] = box;
            right_cost[i] = count > 0 ? box.half_area() * double(count) : -1.0;
        }
        box = {};
        count = 0;
        for (size_t i = 1; i < size_; ++i) {
            box.extend(lower_[axis][i - 1], upper_[axis][i - 1]);
            count += count_[axis][i - 1];
            if (count == 0 || right_cost[i] < 0) continue;
            const double cost = box.half_area() * double(count) + right_cost[i];
            if (cost < best.cost) best = {int(axis), int(i), cost, box, right[i]};
        }
    }

    size_t size_;
    // Not initialised beyond size_: small nodes use few of them
    Vec4 lower_[3][max_bins], upper_[3][max_bins];
    uint32_t count_[3][max_bins];
};

Bounds4 intersection(const Bounds4& a, const Bounds4& b) {
    Bounds4 both;
    both.lower = a.lower > b.lower ? a.lower : b.lower;
    both.upper = a.upper < b.upper ? a.upper : b.upper;
    return both;
}

RangeBounds measure(std::span<const BuildPrim> range) {
    return sum_up(
        range, RangeBounds{},
        [](std::span<const BuildPrim> some, RangeBounds& bounds) {
            for (const BuildPrim& p : some) bounds.extend(p);
        },
        [](RangeBounds& sum, const RangeBounds& part) { sum.extend(part); });
}

// References of one node.
struct Range {
    std::shared_ptr<std::vector<BuildPrim>> owner;
    std::span<BuildPrim> prims;
    RangeBounds bounds;
    size_t budget = 0;  // how many references spatial splits below may add

    static Range owning(std::vector<BuildPrim> references, const RangeBounds& bounds) {
        Range range;
        range.owner = std::make_shared<std::vector<BuildPrim>>(std::move(references));
        range.prims = *range.owner;
        range.bounds = bounds;
        return range;
    }

    // Only ranges that may be replaced by divided ones keep their memory alive themselves.
    Range part(size_t begin, size_t count, const RangeBounds& part_bounds) const {
        Range range;
        if (budget > 0) range.owner = owner;
        range.prims = prims.subspan(begin, count);
        range.bounds = part_bounds;
        return range;
    }

    size_t count() const { return prims.size(); }

    bool is_point() const {
        const Bounds4& c = bounds.centroids;
        return c.lower[0] == c.upper[0] && c.lower[1] == c.upper[1] && c.lower[2] == c.upper[2];
    }
};

struct Halves {
    Range left, right;
};

class Builder {
  public:
    Builder(std::vector<BuildPrim> prims, const BinaryBuildOptions& options) : options_(options) {
        if (prims.empty()) return;
        const size_t count = prims.size();
        size_t budget = 0;
        if (options.clipper) {
            budget = std::max(size_t(options.spare_references * double(count)),
                              std::min(least_spare, 8 * count));
        }
        VELATURA_CHECK(2 * (count + budget) < std::numeric_limits<uint32_t>::max(),
                       "more references in one tree than node numbers");
        // Most of this memory is never touched unless it is used
        tree_.nodes = std::make_unique_for_overwrite<BinaryNode[]>(2 * (count + budget));
        tree_.order = std::make_unique_for_overwrite<uint32_t[]>(count + budget);
        const RangeBounds bounds = measure(prims);
        root_area_ = bounds.box.half_area();
        Range range = Range::owning(std::move(prims), bounds);
        range.budget = budget;
        build(0, std::move(range), unknown, 0);
        tree_.references = next_reference_;
        tree_.node_count = next_node_;
    }

    BinaryTree take() { return std::move(tree_); }

  private:
    Halves object_split(const Range& range, const BinMap& map, const Split& split) const {
        RangeBounds left, right;
        size_t i = 0, j = range.count();
        while (true) {
            while (i < j && map.bin(range.prims[i], split.axis) < split.bin)
                left.extend(range.prims[i++]);
            while (i < j && map.bin(range.prims[j - 1], split.axis) >= split.bin)
                right.extend(range.prims[--j]);
            if (i >= j) break;
            std::swap(range.prims[i], range.prims[j - 1]);
        }
        return {range.part(0, i, left), range.part(i, range.count() - i, right)};
    }

    // By centroid, then by index: total order, so the outcome is unique.
    Halves halve(const Range& range, int axis) const {
        const size_t half = range.count() / 2;
        const auto middle = range.prims.begin() + std::ptrdiff_t(half);
        std::nth_element(range.prims.begin(), middle, range.prims.end(),
                         [&](const BuildPrim& a, const BuildPrim& b) {
                             const float ca = centroid(a, axis), cb = centroid(b, axis);
                             return ca != cb ? ca < cb : a.id < b.id;
                         });
        return {range.part(0, half, measure(range.prims.first(half))),
                range.part(half, range.count() - half, measure(range.prims.subspan(half)))};
    }

    // Whether the children of an object split overlap so much that dividing space may be better.
    bool overlaps(const Split& split, const Range& range) const {
        if (range.budget == 0 || range.count() < least_spatial_count) return false;
        const Bounds4 both = intersection(split.left, split.right);
        for (int k = 0; k < 3; ++k) {
            if (both.upper[k] < both.lower[k]) return false;
        }
        return both.half_area() > options_.smallest_overlap * root_area_ &&
               double(both.extent(split.axis)) >
                   options_.thinnest_overlap * double(range.bounds.box.extent(split.axis));
    }

    // What may be added below goes where references are large.
    static void share_budget(size_t budget, Halves& halves) {
        if (budget == 0) return;
        const auto weight = [](const Range& range) {
            double sum = 0;
            for (const BuildPrim& p : range.prims) {
                Bounds4 box;
                box.extend(lower_of(p), upper_of(p));
                sum += box.half_area();
            }
            return sum;
        };
        const double left = weight(halves.left), both = left + weight(halves.right);
        halves.left.budget =
            both > 0 ? std::min(budget, size_t(double(budget) * (left / both))) : 0;
        halves.right.budget = budget - halves.left.budget;
    }

    // Moves to `halves`; false when no plane of space is better than the object split.
    bool spatial_split(const Range& range, const Split& object, Halves& halves) const {
        const SpatialSplit split =
            find_spatial_split(range.prims, range.bounds.box, *options_.clipper);
        if (split.axis < 0 || split.cost >= 0.97 * object.cost) return false;
        SpatialSides sides = divide(range.prims, split, range.budget, *options_.clipper);
        const size_t count = range.count();
        if (sides.lower.empty() || sides.upper.empty()) return false;
        if (sides.lower.size() >= count || sides.upper.size() >= count) return false;
        const size_t added = sides.lower.size() + sides.upper.size() - count;
        halves.left = Range::owning(std::move(sides.lower), sides.lower_bounds);
        halves.right = Range::owning(std::move(sides.upper), sides.upper_bounds);
        share_budget(range.budget - added, halves);
        return true;
    }

    Halves split(const Range& range, int depth) const {
        const Bounds4& c = range.bounds.centroids;
        int widest = 0;
        for (int k = 1; k < 3; ++k) {
            if (c.extent(k) > c.extent(widest)) widest = k;
        }
        Halves halves;
        if (depth >= options_.max_depth || !(c.upper[widest] > c.lower[widest])) {
            halves = halve(range, widest);
            share_budget(range.budget, halves);
            return halves;
        }
        // Few primitives need few candidate planes
        const int bins_here =
            std::min(options_.bins, int(std::min<size_t>(range.count(), 28)) + 4);
        const BinMap map(c, std::clamp(bins_here, 2, max_bins));
        const Bins bins = sum_up(
            range.prims, Bins(map),
            [&](std::span<const BuildPrim> some, Bins& part) { part.fill(some, map); },
            [](Bins& sum, const Bins& part) { sum.add(part); });
        const Split best = bins.best_split(map);
        if (best.axis < 0) {
            halves = halve(range, widest);
        } else {
            if (overlaps(best, range) && spatial_split(range, best, halves)) return halves;
            halves = object_split(range, map, best);
        }
        share_budget(range.budget, halves);
        return halves;
    }

    // `first`: where the references go; known below small nodes.
    void build(uint32_t at, Range range, uint32_t first, int depth) {
        if (range.is_point() && range.count() > small_count && options_.merge_duplicates)
            range.prims = range.prims.first(options_.merge_duplicates(range.prims));
        const auto count = uint32_t(range.count());
        if (first == unknown && count <= small_count)
            first = next_reference_.fetch_add(count, std::memory_order_relaxed);
        BinaryNode& node = tree_.nodes[at];
        for (int k = 0; k < 3; ++k) {
            node.lower[k] = range.bounds.box.lower[k];
            node.upper[k] = range.bounds.box.upper[k];
        }
        node.first = first;
        node.count = count;
        node.child = 0;
        if (count <= options_.leaf_size) {
            for (uint32_t i = 0; i < count; ++i) tree_.order[first + i] = range.prims[i].id;
            return;
        }
        node.child = next_node_.fetch_add(2, std::memory_order_relaxed);
        Halves halves = split(range, depth);
        if (range.budget > 0) range.owner.reset();
        const auto go_down = [&](size_t side) {
            Range& half = side == 0 ? halves.left : halves.right;
            const uint32_t before = side == 0 ? 0 : uint32_t(halves.left.count());
            const uint32_t half_first = first == unknown ? unknown : first + before;
            build(node.child + uint32_t(side), std::move(half), half_first, depth + 1);
        };
        if (count >= parallel_split_count) {
            parallel_for(2, go_down);
        } else {
            go_down(0);
            go_down(1);
        }
    }

    static constexpr uint32_t unknown = std::numeric_limits<uint32_t>::max();

    const BinaryBuildOptions& options_;
    BinaryTree tree_;
    double root_area_ = 0;
    std::atomic<uint32_t> next_node_ = 1, next_reference_ = 0;
};

}  // namespace

BinaryTree build_binary_tree(std::vector<BuildPrim> prims, const BinaryBuildOptions& options) {
    return Builder(std::move(prims), options).take();
}

}  // namespace velatura::accel
