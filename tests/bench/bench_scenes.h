// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accel/bvh.h"
#include "base/math.h"

#include <array>
#include <string>
#include <vector>

namespace velatura::bench {

struct BenchMesh {
    std::vector<Vec3> positions;
    std::vector<std::array<uint32_t, 3>> triangles;

    void add(const Vec3& a, const Vec3& b, const Vec3& c);
    void add_quad(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);
    /// Six sides of the box with corner o and edges x, y, z.
    void add_box(const Vec3& o, const Vec3& x, const Vec3& y, const Vec3& z);
};

/// A scene with a camera and a light. Generated, the same everywhere.
struct BenchScene {
    std::string name;
    BenchMesh direct;
    std::vector<BenchMesh> prototypes;
    std::vector<accel::SoupInstance> instances;
    Vec3 eye, target;
    Vec3 light, light_x, light_y;  ///< corner and edges of a rectangle light
    float ambient_distance = 1;    ///< length of ambient occlusion rays

    accel::SoupScene soup() const;
    size_t triangle_count() const;  ///< stored ones
};

/// Displaced spheres of about a million triangles in a room.
BenchScene make_museum();

/// Trees of single leaf triangles and thin twigs, placed many times on a ground.
BenchScene make_forest();

/// Interior turned off the axes: large walls, columns, thin rods and curtains.
BenchScene make_interior();

}  // namespace velatura::bench
