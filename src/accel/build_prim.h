// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/process/large_pages.h"
#include "base/tasks.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>
#include <span>
#include <vector>

namespace velatura::accel {

/// A reference to a primitive while a tree is built: its box, or the box of the part of it that the
/// reference stands for. `id` is the primitive's index.
struct alignas(32) BuildPrim {
    float lower[3];
    uint32_t id;
    float upper[3];
    uint16_t is_divisible;  ///< by spatial splits
    uint16_t is_above;      ///< scratch of theirs
};

/// Four floats in one register; a vector extension that both compilers know.
using Vec4 = float __attribute__((vector_size(16)));

/// Half the surface area of a box.
template <class Corner>
double half_area(const Corner& lower, const Corner& upper) {
    const double x = double(upper[0]) - double(lower[0]);
    const double y = double(upper[1]) - double(lower[1]);
    const double z = double(upper[2]) - double(lower[2]);
    return x * y + y * z + z * x;
}

/// Both corners of a box with one unused lane each; empty at first.
struct Bounds4 {
    static constexpr float inf = std::numeric_limits<float>::infinity();

    Vec4 lower = {inf, inf, inf, inf};
    Vec4 upper = {-inf, -inf, -inf, -inf};

    void extend(Vec4 low, Vec4 high) {
        lower = lower < low ? lower : low;
        upper = upper > high ? upper : high;
    }

    void extend(const Bounds4& b) { extend(b.lower, b.upper); }

    float extent(int axis) const { return upper[axis] - lower[axis]; }

    double half_area() const { return accel::half_area(lower, upper); }
};

inline Bounds4 intersection(const Bounds4& a, const Bounds4& b) {
    Bounds4 both;
    both.lower = a.lower > b.lower ? a.lower : b.lower;
    both.upper = a.upper < b.upper ? a.upper : b.upper;
    return both;
}

// The fourth lane holds the bits of id or nothing; no one reads what comes of it.
inline Vec4 lower_of(const BuildPrim& p) {
    Vec4 v;
    std::memcpy(&v, p.lower, sizeof(v));
    return v;
}

inline Vec4 upper_of(const BuildPrim& p) {
    Vec4 v;
    std::memcpy(&v, p.upper, sizeof(v));
    return v;
}

/// Twice the center of the box.
inline float centroid(const BuildPrim& p, int axis) {
    return p.lower[axis] + p.upper[axis];
}

/// Box of some references and that of their centroids.
struct RangeBounds {
    Bounds4 box, centroids;  ///< centroids: sums of both corners

    void extend(const BuildPrim& p) {
        const Vec4 low = lower_of(p), high = upper_of(p);
        const Vec4 middle = low + high;
        box.extend(low, high);
        centroids.extend(middle, middle);
    }

    void extend(const RangeBounds& b) {
        box.extend(b.box);
        centroids.extend(b.centroids);
    }
};

/// So many references are summed up by several threads.
inline constexpr size_t parallel_sum_count = 65536;

/// Sums up references: fill(some of them, part) into parts that begin as copies of `sum`, which
/// then take them in by join(sum, part). Large ranges in parallel; what does not depend on the
/// order of references, such as unions and counts, does not depend on threads either.
template <class Sum, class Fill, class Join>
Sum sum_up(std::span<const BuildPrim> references, Sum sum, const Fill& fill, const Join& join) {
    constexpr size_t chunk_size = 16384;
    if (references.size() < parallel_sum_count) {
        fill(references, sum);
        return sum;
    }
    std::vector<Sum> parts((references.size() + chunk_size - 1) / chunk_size, sum);
    parallel_for(parts.size(), [&](size_t i) {
        const size_t begin = i * chunk_size;
        fill(references.subspan(begin, std::min(chunk_size, references.size() - begin)), parts[i]);
    });
    for (const Sum& part : parts) join(sum, part);
    return sum;
}

/// Memory for `capacity` objects, in large pages where there is enough; not touched. For types that
/// need no constructor.
template <class T>
class Buffer {
  public:
    Buffer() = default;

    explicit Buffer(size_t capacity)
        : data_(LargePages<T>().allocate(capacity)), capacity_(capacity) {}

    T* data() const { return data_.get(); }

    size_t capacity() const { return capacity_; }

    T& operator[](size_t i) const { return data_.get()[i]; }

  private:
    struct Free {
        void operator()(T* p) const { LargePages<T>().deallocate(p, 0); }
    };

    std::unique_ptr<T[], Free> data_;
    size_t capacity_ = 0;
};

/// References, and room for more.
struct BuildPrims {
    Buffer<BuildPrim> memory;
    size_t count = 0;

    explicit BuildPrims(size_t capacity) : memory(capacity) {}

    void push_back(const BuildPrim& p) { memory[count++] = p; }
};

/// A primitive that planes may divide: the corners of a triangle.
struct TriangleCorners4 {
    Vec4 p[3];
};

/// The geometry behind references.
class TriangleSource {
  public:
    virtual ~TriangleSource() = default;

    virtual TriangleCorners4 corners(uint32_t id) const = 0;
};

}  // namespace velatura::accel
