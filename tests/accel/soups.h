// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accel/bvh.h"
#include "base/math.h"
#include "geometry/surface_point.h"

#include <array>
#include <cstdint>
#include <vector>

namespace velatura::accel::test {

/// Deterministic numbers (SplitMix64).
class Random {
  public:
    explicit Random(uint64_t seed) : state_(seed) {}

    uint64_t bits() {
        uint64_t z = (state_ += 0x9e3779b97f4a7c15u);
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
        return z ^ (z >> 31);
    }

    float unit() { return float(bits() >> 40) * 0x1p-24f; }

    float between(float a, float b) { return a + (b - a) * unit(); }

    uint32_t below(uint32_t n) { return uint32_t((bits() >> 32) * n >> 32); }

    Vec3 in_cube(float half) {
        return {between(-half, half), between(-half, half), between(-half, half)};
    }

    Vec3 direction() {
        const float z = between(-1, 1), phi = between(0, 2 * pi), r = safe_sqrt(1 - z * z);
        return {r * std::cos(phi), r * std::sin(phi), z};
    }

  private:
    uint64_t state_;
};

/// Triangles that own their memory.
struct Soup {
    std::vector<Vec3> positions;
    std::vector<std::array<uint32_t, 3>> triangles;
    std::vector<std::vector<Vec3>> later_positions = {};  ///< empty: does not move
    bool is_flipped = false;

    TriangleSoupView view() const {
        return {positions, triangles, nullptr, later_positions, is_flipped};
    }

    void add(const Vec3& a, const Vec3& b, const Vec3& c);
};

/// A shape of each, which own the triangles.
SoupScene scene_of(const std::vector<Soup>& soups);

/// Loose triangles of about the given size in the cube of half edge 1.
Soup random_soup(size_t count, float size, uint64_t seed);

/// Needles: two long edges, the third `aspect` times shorter.
Soup needles(size_t count, float aspect, uint64_t seed);

/// Rods: pairs of triangles 3 long and `width` wide across the cube, in any direction.
Soup rods(size_t count, float width, uint64_t seed);

/// Triangles in coordinate planes at multiples of 1/8, whose boxes are flat.
Soup flat_triangles(size_t count, uint64_t seed);

/// Closed grid sphere whose radius varies between 1 and 1 + roughness; `squeeze` < 1 makes the
/// triangles of its rings slivers. Vertices are radius·(…) + center, rounded once.
Soup star_mesh(
    int rings, int sectors, double radius, double roughness, const Vec3d& center, uint64_t seed);

/// Box with two triangles a side.
Soup box(const Vec3& lower, const Vec3& upper);

/// Bodies of every kind of quadric, of about the given size, anywhere in the cube of half edge 1:
/// round, uneven, mirrored. A shape each.
std::vector<TriangleSoupView> quadrics(size_t count, double size, uint64_t seed);

/// Sets of curves of every basis and wrap, round ones and ribbons, and of balls, some of them under
/// an uneven map: each of about the given thickness, in the cube of half edge 1. A shape each.
std::vector<TriangleSoupView> strands(size_t count, double thickness, uint64_t seed);

/// Discs in one set, every fifth of them not there.
TriangleSoupView discs(size_t count, double size, uint64_t seed);

/// Rays from anywhere to anywhere in and around the cube of half edge 1, some along axes, some with
/// zero and negative zero components, some starting in planes at multiples of 1/8, some short.
std::vector<geometry::Ray> mixed_rays(size_t count, uint64_t seed);

}  // namespace velatura::accel::test
