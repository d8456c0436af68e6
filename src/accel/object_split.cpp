// SPDX-License-Identifier: Apache-2.0
// Compiled once per instruction set by Highway, as traverse.cpp is. Nothing but sums, products and
// comparisons of floats, so all instruction sets find the same splits.
#include "accel/object_split.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>

// clang-format off
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "accel/object_split.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
// clang-format on

HWY_BEFORE_NAMESPACE();

namespace velatura::accel {
namespace HWY_NAMESPACE {
namespace {

// Eight floats are one register or two, as the instruction set has them; bins keep them in memory.
using Vec8 = float __attribute__((vector_size(32)));
using Int4 = int32_t __attribute__((vector_size(16)));
using Int8 = int32_t __attribute__((vector_size(32)));

constexpr float inf = std::numeric_limits<float>::infinity();

// Lower corners are negated, so that one maximum extends a box: {−lower, 0, upper, 0}.
struct alignas(32) Box8 {
    Vec8 v = {-inf, -inf, -inf, -inf, -inf, -inf, -inf, -inf};
};

HWY_INLINE void extend(Vec8& a, const Vec8& b) {
    a = a > b ? a : b;
}

HWY_INLINE Vec8 load(const BuildPrim& p) {
    constexpr int32_t sign = std::numeric_limits<int32_t>::min();
    Int8 bits;
    std::memcpy(&bits, &p, sizeof(bits));
    bits = (bits ^ Int8{sign, sign, sign, 0, 0, 0, 0, 0}) & Int8{-1, -1, -1, 0, -1, -1, -1, 0};
    return Vec8(bits);
}

HWY_INLINE Vec4 low_half(const Vec8& v) {
    return __builtin_shufflevector(v, v, 0, 1, 2, 3);
}

HWY_INLINE Vec4 high_half(const Vec8& v) {
    return __builtin_shufflevector(v, v, 4, 5, 6, 7);
}

HWY_INLINE void unpack(const Vec8& v, Bounds4& box) {
    box.lower = -low_half(v);
    box.upper = high_half(v);
}

// Twice the center.
HWY_INLINE Vec4 centroids(const Vec8& v) {
    return high_half(v) - low_half(v);
}

// Maps centroids to bins.
struct BinMap {
    Vec4 origin, scale;
    int bins;

    BinMap(const Bounds4& c, int n) : origin(c.lower), bins(n) {
        for (int k = 0; k < 4; ++k) {
            const float extent = k < 3 ? c.upper[k] - c.lower[k] : 0.0f;
            const float s = float(n) * (1.0f - 0x1p-20f) / extent;
            scale[k] = extent > 0 && s <= std::numeric_limits<float>::max() ? s : 0.0f;
        }
        origin[3] = 0;
    }
};

// The bins of all axes; only those of the map are ever looked at.
struct alignas(64) Bins {
    Vec8 box[max_bins][3];
    Int4 count[max_bins];

    HWY_INLINE void clear(int bins) {
        for (int b = 0; b < bins; ++b) {
            for (int axis = 0; axis < 3; ++axis) box[b][axis] = Box8{}.v;
            count[b] = Int4{};
        }
    }

    HWY_INLINE void fill(std::span<const BuildPrim> references, const BinMap& map) {
        const Vec4 origin = map.origin, scale = map.scale;
        const Int4 last = Int4{} + (map.bins - 1);
        for (const BuildPrim& p : references) {
            const Vec8 v = load(p);
            Int4 b = __builtin_convertvector((centroids(v) - origin) * scale, Int4);
            // No bin of an extent that overflows is outside
            b = b < last ? b : last;
            b = b > 0 ? b : Int4{};
            const int x = b[0], y = b[1], z = b[2];
            extend(box[x][0], v);
            extend(box[y][1], v);
            extend(box[z][2], v);
            ++reinterpret_cast<int32_t*>(&count[x])[0];
            ++reinterpret_cast<int32_t*>(&count[y])[1];
            ++reinterpret_cast<int32_t*>(&count[z])[2];
        }
    }

    HWY_INLINE void add(const Bins& other, int bins) {
        for (int b = 0; b < bins; ++b) {
            for (int axis = 0; axis < 3; ++axis) extend(box[b][axis], other.box[b][axis]);
            count[b] += other.count[b];
        }
    }
};

// Half areas of three boxes, in units of 1/scale².
HWY_INLINE Vec4 half_areas(const Vec8* box, const Vec4& scale) {
    // Extents by box, then by axis
    const Vec4 a = high_half(box[0]) + low_half(box[0]);
    const Vec4 b = high_half(box[1]) + low_half(box[1]);
    const Vec4 c = high_half(box[2]) + low_half(box[2]);
    const Vec4 ab_xy = __builtin_shufflevector(a, b, 0, 4, 1, 5);
    const Vec4 ab_z = __builtin_shufflevector(a, b, 2, 6, 2, 6);
    const Vec4 x = scale * __builtin_shufflevector(ab_xy, c, 0, 1, 4, 4);
    const Vec4 y = scale * __builtin_shufflevector(ab_xy, c, 2, 3, 5, 5);
    const Vec4 z = scale * __builtin_shufflevector(ab_z, c, 0, 1, 6, 6);
    return x * y + (x + y) * z;
}

// Sweeps over all planes of the three axes at once. Sides without references give NaN or infinity.
struct Sweep {
    Vec4 scale;
    int block_shift;

    HWY_INLINE Vec4 cost(const Vec8* box, const Int4& count) const {
        const Int4 blocks = (count + ((1 << block_shift) - 1)) >> block_shift;
        return half_areas(box, scale) * __builtin_convertvector(blocks, Vec4);
    }

    HWY_INLINE void find(const Bins& bins, const BinMap& map, ObjectSplit& split) const {
        Vec4 right_cost[max_bins];
        Vec8 box[3] = {Box8{}.v, Box8{}.v, Box8{}.v};
        Int4 count = {};
        for (int i = map.bins - 1; i > 0; --i) {
            for (int axis = 0; axis < 3; ++axis) extend(box[axis], bins.box[i][axis]);
            count += bins.count[i];
            right_cost[i] = cost(box, count);
        }
        for (Vec8& b : box) b = Box8{}.v;
        count = Int4{};
        Vec4 best = Vec4{} + inf;
        Int4 best_bin = {};
        for (int i = 1; i < map.bins; ++i) {
            for (int axis = 0; axis < 3; ++axis) extend(box[axis], bins.box[i - 1][axis]);
            count += bins.count[i - 1];
            const Vec4 sum = cost(box, count) + right_cost[i];
            best_bin = sum < best ? Int4{} + i : best_bin;
            best = sum < best ? sum : best;
        }
        float min = inf;
        for (int axis = 0; axis < 3; ++axis) {
            if (map.scale[axis] == 0.0f || !(best[axis] < min)) continue;
            min = best[axis];
            split.axis = axis;
        }
        if (split.axis >= 0) describe(bins, map, best_bin[split.axis], split);
    }

    static HWY_INLINE void describe(const Bins& bins,
                                    const BinMap& map,
                                    int bin,
                                    ObjectSplit& split) {
        split.origin = map.origin[split.axis];
        split.scale = map.scale[split.axis];
        split.bin = float(bin);
        Box8 side[2];
        int32_t count[2] = {0, 0};
        for (int i = 0; i < map.bins; ++i) {
            const int s = i < bin ? 0 : 1;
            extend(side[s].v, bins.box[i][split.axis]);
            count[s] += bins.count[i][split.axis];
        }
        unpack(side[0].v, split.left);
        unpack(side[1].v, split.right);
        split.left_count = uint32_t(count[0]);
        split.right_count = uint32_t(count[1]);
    }
};

void find_split(std::span<const BuildPrim> references,
                const RangeBounds& bounds,
                int bin_count,
                uint32_t block,
                ObjectSplit& split) {
    const BinMap map(bounds.centroids, bin_count);
    Bins bins;
    bins.clear(bin_count);
    if (references.size() < parallel_sum_count) {
        bins.fill(references, map);
    } else {
        bins = sum_up(
            references, bins,
            [&](std::span<const BuildPrim> some, Bins& part) HWY_ATTR { part.fill(some, map); },
            [&](Bins& sum, const Bins& part) HWY_ATTR { sum.add(part, bin_count); });
    }
    // Products of extents neither overflow nor vanish
    const Bounds4& box = bounds.box;
    const float largest = std::max(box.extent(0), std::max(box.extent(1), box.extent(2)));
    const float scale = 1.0f / largest;
    const bool is_normal = scale > 0 && scale <= std::numeric_limits<float>::max();
    Sweep{Vec4{} + (is_normal ? scale : 1.0f), std::countr_zero(block)}.find(bins, map, split);
}

// Branch-free: which side is next cannot be predicted.
size_t partition_references(std::span<BuildPrim> references,
                            const ObjectSplit& split,
                            CentroidBounds& bounds) {
    Vec8 left = Box8{}.v, right = left;
    const Vec8 nothing = left;
    BuildPrim* const prims = references.data();
    size_t left_count = 0;
    for (size_t i = 0; i < references.size(); ++i) {
        Int8 moved, other;
        std::memcpy(&moved, &prims[i], sizeof(moved));
        std::memcpy(&other, &prims[left_count], sizeof(other));
        const bool is_left = split.is_left(prims[i]);
        const Vec8 v = load(prims[i]);
        const Vec4 middle = centroids(v);
        const Vec8 both = __builtin_shufflevector(-middle, middle, 0, 1, 2, 3, 4, 5, 6, 7);
        const Int8 mask = Int8{} - int32_t(is_left);
        extend(left, mask ? both : nothing);
        extend(right, mask ? nothing : both);
        std::memcpy(&prims[i], &other, sizeof(other));
        std::memcpy(&prims[left_count], &moved, sizeof(moved));
        left_count += is_left;
    }
    unpack(left, bounds.left);
    unpack(right, bounds.right);
    return left_count;
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace velatura::accel

HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#include "base/check.h"

namespace velatura::accel {

HWY_EXPORT(find_split);
HWY_EXPORT(partition_references);

ObjectSplit find_object_split(std::span<const BuildPrim> references,
                              const RangeBounds& bounds,
                              int bins,
                              uint32_t block) {
    ObjectSplit split;
    HWY_DYNAMIC_DISPATCH(find_split)(references, bounds, bins, block, split);
    return split;
}

CentroidBounds partition(std::span<BuildPrim> references, const ObjectSplit& split) {
    CentroidBounds bounds;
    const size_t left_count = HWY_DYNAMIC_DISPATCH(partition_references)(references, split, bounds);
    VELATURA_CHECK(left_count == split.left_count, "bins and partition disagree");
    return bounds;
}

}  // namespace velatura::accel

#endif  // HWY_ONCE
