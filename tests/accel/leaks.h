// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accel/accelerator.h"
#include "soups.h"

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace velatura::accel::test {

/// What rays from within a closed mesh did.
struct LeakCount {
    size_t rays = 0;
    size_t misses = 0;  ///< met nothing
    size_t passed = 0;  ///< met only something well behind the point that they were aimed at
    size_t unseen = 0;  ///< were not occluded

    void operator+=(const LeakCount& other);
};

/// A closed mesh and a point in it.
struct ClosedMesh {
    std::string name;
    Soup soup;
    Vec3 eye;
    /// Where the mesh is placed, as the only instance; an identity places it directly.
    Mat4 render_from_mesh;
    /// Whether the eye sees every point of the mesh, and rays end where they are aimed at but for
    /// rounding far below 1/1000: only then does `passed` mean a leak.
    bool is_star_shaped = false;

    /// Refers to this.
    SoupScene scene() const;
};

/// Those of docs/engineering/hard_cases.md H01: smooth and rough spheres, eyes off the center, far
/// from the origin, slivers, placed by an uneven instance.
std::vector<ClosedMesh> closed_meshes();

/// Shoots at random vertices and at random points of random edges.
LeakCount count_leaks(const Accelerator& accelerator,
                      const ClosedMesh& mesh,
                      size_t rays,
                      uint64_t seed);

/// The same of a tree that is built for it, on all threads.
LeakCount count_leaks(const ClosedMesh& mesh, size_t rays);

}  // namespace velatura::accel::test
