// SPDX-License-Identifier: Apache-2.0
#include "accel/bvh_builder.h"

#include "accel/object_split.h"
#include "accel/spatial_split.h"
#include "base/check.h"
#include "base/tasks.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <limits>
#include <utility>

namespace velatura::accel {

namespace {

constexpr size_t parallel_split_count = 4096;  // smaller subtrees stay on one thread
constexpr size_t small_count = 8;              // nodes whose references lie side by side
constexpr size_t min_spatial_count = 128;      // fewer references are not divided
constexpr double min_gain = 0.99;              // costs of a spatial and of an object split
constexpr double min_promise = 0.95;           // costs that make such a try worthwhile
constexpr size_t sample_count = 64;            // references that say whether to try it on all
constexpr int last_backoff = 16;               // see BvhOptions::backoff
constexpr uint32_t node_block = 64;            // nodes that a thread takes at a time

RangeBounds measure(std::span<const BuildPrim> range) {
    return sum_up(
        range, RangeBounds{},
        [](std::span<const BuildPrim> some, RangeBounds& bounds) {
            for (const BuildPrim& p : some) bounds.extend(p);
        },
        [](RangeBounds& sum, const RangeBounds& part) { sum.extend(part); });
}

// References of one node, and free places behind them for parts of divided ones.
struct Range {
    size_t begin = 0, end = 0, room_end = 0;
    RangeBounds bounds;
    size_t worth_dividing = std::numeric_limits<size_t>::max();  // at most so many references
    int backoff = 0;

    size_t count() const { return end - begin; }

    bool is_point() const {
        const Bounds4& c = bounds.centroids;
        return c.lower[0] == c.upper[0] && c.lower[1] == c.upper[1] && c.lower[2] == c.upper[2];
    }
};

struct Halves {
    Range left, right;

    void pass_on(size_t worth_dividing, int backoff) {
        for (Range* half : {&left, &right}) {
            half->worth_dividing = worth_dividing;
            half->backoff = backoff;
        }
    }
};

// Numbers of nodes that one thread has taken.
struct NodeNumbers {
    uint32_t next = 0, end = 0;
};

class Builder {
  public:
    Builder(BuildPrims& prims, const BinaryBuildOptions& options)
        : options_(options), prims_(prims.memory.data()) {
        if (prims.count == 0) return;
        // Each parallel node leaves less than a block; halving adds at most 32 levels
        const size_t max_parallel = prims.memory.capacity() / parallel_split_count *
                                    (size_t(std::max(options.max_depth, 0)) + 32);
        const size_t max_nodes = 2 * prims.memory.capacity() + (max_parallel + 2) * node_block;
        VELATURA_CHECK(max_nodes < leaf_bit, "more references in one tree than node numbers");
        // Most of this memory is never touched unless it is used
        tree_.nodes = Buffer<BinaryNode>(max_nodes);
        tree_.order = Buffer<uint32_t>(prims.memory.capacity());
        Range range;
        range.end = prims.count;
        range.room_end = options.source ? prims.memory.capacity() : prims.count;
        range.backoff = options.backoff;
        range.bounds = measure({prims_, prims.count});
        root_area_ = range.bounds.box.half_area();
        NodeNumbers numbers;
        build(0, range, 0, numbers);
        tree_.node_count = next_node_;
    }

    BinaryTree take() { return std::move(tree_); }

  private:
    std::span<BuildPrim> references(const Range& range) const {
        return {prims_ + range.begin, range.count()};
    }

    static Halves halves_at(const Range& range, size_t left_count) {
        Halves halves;
        halves.left.begin = range.begin;
        halves.left.end = halves.left.room_end = range.begin + left_count;
        halves.right.begin = halves.left.end;
        halves.right.end = range.end;
        halves.right.room_end = range.room_end;
        return halves;
    }

    // By centroid, then by index: total order, so the outcome is unique.
    Halves halve(const Range& range, int axis) const {
        const std::span<BuildPrim> all = references(range);
        const size_t half = range.count() / 2;
        std::nth_element(all.begin(), all.begin() + std::ptrdiff_t(half), all.end(),
                         [&](const BuildPrim& a, const BuildPrim& b) {
                             const float ca = centroid(a, axis), cb = centroid(b, axis);
                             return ca != cb ? ca < cb : a.id < b.id;
                         });
        Halves halves = halves_at(range, half);
        halves.left.bounds = measure(references(halves.left));
        halves.right.bounds = measure(references(halves.right));
        return halves;
    }

    Halves object_split(const Range& range, const ObjectSplit& split) const {
        const CentroidBounds centroids = partition(references(range), split);
        Halves halves = halves_at(range, split.left_count);
        halves.left.bounds = {split.left, centroids.left};
        halves.right.bounds = {split.right, centroids.right};
        return halves;
    }

    static double cost(const Bounds4& left,
                       size_t left_count,
                       const Bounds4& right,
                       size_t right_count) {
        return left.half_area() * double(left_count) + right.half_area() * double(right_count);
    }

    static bool can_divide(const Range& range) {
        return range.room_end > range.end && range.count() >= min_spatial_count &&
               range.count() <= range.worth_dividing;
    }

    // Whether the children of an object split overlap so much that dividing space may be better.
    bool overlaps(const ObjectSplit& split) const {
        const Bounds4 both = intersection(split.left, split.right);
        for (int k = 0; k < 3; ++k) {
            if (both.upper[k] < both.lower[k]) return false;
        }
        if (both.half_area() <= options_.smallest_overlap * root_area_) return false;
        // The most that a plane through the middle of the overlap could save, if it divided nothing
        Bounds4 left = split.left, right = split.right;
        const float middle = 0.5f * (both.lower[split.axis] + both.upper[split.axis]);
        left.upper[split.axis] = right.lower[split.axis] = middle;
        return cost(left, split.left_count, right, split.right_count) <
               min_promise * cost(split.left, split.left_count, split.right, split.right_count);
    }

    // What few of many references say about dividing space; they say it in a fraction of the time.
    bool is_promising(const Range& range, const ObjectSplit& object) const {
        if (range.count() < 2 * sample_count) return true;
        std::array<BuildPrim, sample_count> sample;
        Bounds4 left, right;
        size_t left_count = 0;
        const double step = double(range.count()) / double(sample_count);
        for (size_t i = 0; i < sample_count; ++i) {
            const BuildPrim& p = prims_[range.begin + size_t(step * double(i))];
            const bool is_left = object.is_left(p);
            left_count += is_left;
            (is_left ? left : right).extend(lower_of(p), upper_of(p));
            sample[i] = p;
        }
        if (left_count == 0 || left_count == sample_count) return true;
        const double object_cost = cost(left, left_count, right, sample_count - left_count);
        return find_spatial_split(sample, range.bounds.box, *options_.source).cost <
               min_gain * object_cost;
    }

    // Moves to `halves`; false when no plane of space is better than the object split.
    bool spatial_split(const Range& range, const ObjectSplit& object, Halves& halves) const {
        if (!is_promising(range, object)) return false;
        const SpatialSplit split =
            find_spatial_split(references(range), range.bounds.box, *options_.source);
        const double object_cost =
            cost(object.left, object.left_count, object.right, object.right_count);
        if (split.axis < 0 || split.cost >= min_gain * object_cost) return false;
        const SpatialSides sides = divide({prims_ + range.begin, range.room_end - range.begin},
                                          range.count(), split, *options_.source);
        Range divided = range;
        divided.end = range.begin + sides.lower_count + sides.upper_count;
        if (sides.lower_count == 0 || sides.upper_count == 0) {
            // All stayed whole on one side
            halves = halve(divided, split.axis);
            return true;
        }
        halves = halves_at(divided, sides.lower_count);
        halves.left.bounds = sides.lower;
        halves.right.bounds = sides.upper;
        return true;
    }

    // The room is behind the right half; where references are large and many, more of it is needed.
    void share_room(Halves& halves) const {
        Range &left = halves.left, &right = halves.right;
        const size_t room = right.room_end - right.end;
        if (room == 0) return;
        const auto weight = [](const Range& range) {
            return range.count() < min_spatial_count
                       ? 0.0
                       : range.bounds.box.half_area() * double(range.count());
        };
        const double of_left = weight(left), of_both = of_left + weight(right);
        if (of_both <= 0) {
            right.room_end = right.end;
            return;
        }
        const size_t left_room = std::min(room, size_t(double(room) * (of_left / of_both)));
        // Their order does not matter
        const size_t moved = std::min(left_room, right.count());
        std::copy_n(prims_ + right.begin, moved, prims_ + right.end + left_room - moved);
        left.room_end = left.end + left_room;
        right.begin += left_room;
        right.end += left_room;
    }

    Halves split(const Range& range, int depth) const {
        const Bounds4& c = range.bounds.centroids;
        int widest = 0;
        for (int k = 1; k < 3; ++k) {
            if (c.extent(k) > c.extent(widest)) widest = k;
        }
        if (depth >= options_.max_depth || !(c.upper[widest] > c.lower[widest]))
            return halve(range, widest);
        // Few primitives need few candidate planes
        const int few = int(std::min<size_t>(range.count() / 2, 28)) + 4;
        const int bins = std::clamp(std::min(options_.bins, few), 2, max_bins);
        const uint32_t block = range.count() > small_count ? options_.block : 1;
        const ObjectSplit best = find_object_split(references(range), range.bounds, bins, block);
        if (best.axis < 0) return halve(range, widest);
        if (!can_divide(range) || !overlaps(best)) {
            Halves halves = object_split(range, best);
            halves.pass_on(range.worth_dividing, range.backoff);
            return halves;
        }
        Halves halves;
        if (spatial_split(range, best, halves)) {
            halves.pass_on(std::numeric_limits<size_t>::max(), options_.backoff);
            return halves;
        }
        halves = object_split(range, best);
        halves.pass_on(range.count() >> range.backoff, std::min(2 * range.backoff, last_backoff));
        return halves;
    }

    uint32_t take_children(NodeNumbers& numbers) {
        if (numbers.next == numbers.end) {
            numbers.next = next_node_.fetch_add(node_block, std::memory_order_relaxed);
            numbers.end = numbers.next + node_block;
        }
        numbers.next += 2;
        return numbers.next - 2;
    }

    void build(uint32_t at, Range range, int depth, NodeNumbers& numbers) {
        if (range.is_point() && range.count() > small_count && options_.merge_duplicates)
            range.end = range.begin + options_.merge_duplicates(references(range));
        BinaryNode& node = tree_.nodes[at];
        for (int k = 0; k < 3; ++k) {
            node.lower[k] = range.bounds.box.lower[k];
            node.upper[k] = range.bounds.box.upper[k];
        }
        const size_t count = range.count();
        node.count = uint32_t(count);
        if (count <= options_.leaf_size) {
            node.link = leaf_bit | uint32_t(range.begin);
            for (size_t i = range.begin; i < range.end; ++i) tree_.order[i] = prims_[i].id;
            return;
        }
        Halves halves = split(range, depth);
        share_room(halves);
        const uint32_t child = take_children(numbers);
        node.link = child;
        if (count < parallel_split_count) {
            build(child, halves.left, depth + 1, numbers);
            build(child + 1, halves.right, depth + 1, numbers);
            return;
        }
        parallel_for(2, [&](size_t side) {
            NodeNumbers others;
            build(child + uint32_t(side), side == 0 ? halves.left : halves.right, depth + 1,
                  side == 0 ? numbers : others);
        });
    }

    const BinaryBuildOptions& options_;
    BuildPrim* prims_;
    BinaryTree tree_;
    double root_area_ = 0;
    std::atomic<uint32_t> next_node_ = 1;
};

}  // namespace

BinaryTree build_binary_tree(BuildPrims prims, const BinaryBuildOptions& options) {
    return Builder(prims, options).take();
}

}  // namespace velatura::accel
