// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"

#include <array>
#include <cstdint>
#include <vector>

namespace velatura::bench {

/// Deterministic numbers in [0, 1) (SplitMix64).
class Random {
  public:
    explicit Random(uint64_t seed) : state_(seed) {}

    float operator()() { return float(bits() >> 40) * 0x1p-24f; }

    float operator()(float a, float b) { return a + (b - a) * (*this)(); }

    uint64_t below(uint64_t n) { return (bits() >> 32) * n >> 32; }

    Vec3 in_cube(float half) {
        const float x = (*this)(-half, half), y = (*this)(-half, half), z = (*this)(-half, half);
        return {x, y, z};
    }

  private:
    uint64_t bits();

    uint64_t state_;
};

/// Triangles that own their memory.
struct BenchMesh {
    std::vector<Vec3> positions;
    std::vector<std::array<uint32_t, 3>> triangles;
    std::vector<std::vector<Vec3>> later_positions;  ///< empty: does not move

    void add(const Vec3& a, const Vec3& b, const Vec3& c);
    void add_quad(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);
    /// Six sides of the box with corner o and edges x, y, z.
    void add_box(const Vec3& o, const Vec3& x, const Vec3& y, const Vec3& z);
    /// Open tube of `sides` quads from foot to foot + axis.
    void add_column(const Vec3& foot, const Vec3& axis, float radius, int sides);
    /// The other mesh, each point carried by m.
    void add(const BenchMesh& other, const Mat4& m);
};

/// What add_blob displaces its sphere by.
struct BlobShape {
    Vec3 center = Vec3(0);
    Vec3 radius = Vec3(1);  ///< along each axis
    float phase = 0;        ///< another one, another relief
    int octaves = 5;        ///< of the relief; each has 2.3 times the frequency of the last
    float twist = 0;        ///< radians from pole to pole
};

/// Adds a closed displaced sphere of 4·rings² − 4·rings triangles, as a scanner would give it:
/// even, small triangles that share their vertices.
void add_blob(BenchMesh& mesh, const BlobShape& shape, int rings);

}  // namespace velatura::bench
