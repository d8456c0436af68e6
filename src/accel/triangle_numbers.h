// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accel/build_prim.h"
#include "accel/bvh.h"
#include "accel/bvh_layout.h"
#include "base/check.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace velatura::accel {

/// Numbers the triangles and primitives of some shapes in (shape, triangle) order.
class TriangleNumbers {
  public:
    TriangleNumbers() = default;

    explicit TriangleNumbers(std::span<const TriangleSoupView> shapes) {
        size_t count = 0;
        for (const TriangleSoupView& shape : shapes) {
            first_.push_back(uint32_t(count));
            is_flipped_.push_back(shape.is_flipped && !shape.primitives);
            VELATURA_CHECK(!shape.primitives || shape.triangles.empty(),
                           "a shape of triangles and primitives");
            count += shape.count();
            VELATURA_CHECK(count < leaf_bit, "more triangles in one tree than ids");
        }
        count_ = count;
    }

    size_t count() const { return count_; }

    uint32_t first(size_t shape) const { return first_[shape]; }

    uint32_t shape(uint32_t id) const {
        return uint32_t(std::upper_bound(first_.begin(), first_.end(), id) - first_.begin()) - 1;
    }

    /// Whether a tree has the second and the third corner of its triangles exchanged.
    bool is_flipped(uint32_t shape) const { return is_flipped_[shape]; }

    size_t bytes() const { return first_.size() * sizeof(uint32_t) + is_flipped_.size() / 8; }

  private:
    std::vector<uint32_t> first_;
    std::vector<bool> is_flipped_;
    size_t count_ = 0;
};

/// Whether duplicates are told apart by their shapes: negative, 0 or positive.
inline int order_of_shapes(const TriangleNumbers& numbers,
                           const BvhOptions& options,
                           uint32_t a,
                           uint32_t b) {
    if (!options.keep_shapes_apart) return 0;
    const uint32_t shape_a = numbers.shape(a), shape_b = numbers.shape(b);
    return shape_a == shape_b ? 0 : shape_a < shape_b ? -1 : 1;
}

/// Keeps the smallest id of references that are equal, at the front of the range. order(a, b) is
/// negative, 0 or positive. Returns: how many are left.
template <class Order>
size_t merge_equal(std::span<BuildPrim> range, const Order& order) {
    std::sort(range.begin(), range.end(), [&](const BuildPrim& a, const BuildPrim& b) {
        const int relation = order(a, b);
        return relation != 0 ? relation < 0 : a.id < b.id;
    });
    const auto end =
        std::unique(range.begin(), range.end(),
                    [&](const BuildPrim& a, const BuildPrim& b) { return order(a, b) == 0; });
    return size_t(end - range.begin());
}

/// Counts what was collected for a tree and is not in it. seen: [id] whether it is;
/// is_collected(shape, triangle).
template <class IsCollected>
void count_duplicates(const TriangleNumbers& numbers,
                      std::span<const TriangleSoupView> shapes,
                      const std::vector<bool>& seen,
                      const IsCollected& is_collected,
                      Duplicates& duplicates) {
    for (size_t s = 0; s < shapes.size(); ++s) {
        for (size_t i = 0; i < shapes[s].triangles.size(); ++i) {
            if (seen[numbers.first(s) + i] || !is_collected(s, i)) continue;
            if (duplicates.count++ > 0) continue;
            duplicates.shape = uint32_t(s);
            duplicates.triangle = uint32_t(i);
        }
    }
}

/// Of points in the order of their coordinates: negative, 0 or positive.
inline int order_of(const Vec3& a, const Vec3& b) {
    for (int k = 0; k < 3; ++k) {
        if (a[k] != b[k]) return a[k] < b[k] ? -1 : 1;
    }
    return 0;
}

}  // namespace velatura::accel
