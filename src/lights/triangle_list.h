// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace velatura::lights {

/// Some triangles of some shapes, numbered in the order of shapes and triangles. Shapes that are
/// listed whole cost a few bytes.
class TriangleList {
  public:
    static constexpr uint32_t not_listed = ~0u;

    struct Entry {
        uint32_t shape = 0, triangle = 0;
    };

    /// Appends triangles of a shape after those of shapes with a lower number.
    /// Args: triangles: ascending; of a shape with `triangle_count` of them.
    void add(uint32_t shape, std::vector<uint32_t> triangles, size_t triangle_count);

    uint32_t size() const { return size_; }

    /// Triangle number `index` of the list.
    Entry operator[](uint32_t index) const;

    /// Number of a triangle in the list, or not_listed.
    uint32_t find(uint32_t shape, uint32_t triangle) const;

  private:
    struct Run {
        uint32_t shape;
        uint32_t first;  // number of its first triangle
        uint32_t count;
        std::vector<uint32_t> triangles;  // empty = all
    };

    std::vector<Run> runs_;
    uint32_t size_ = 0;
};

}  // namespace velatura::lights
