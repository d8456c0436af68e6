// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accel/accelerator.h"
#include "base/math.h"

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace velatura::scene {
struct Scene;
}

namespace velatura::geometry {
class GeometrySet;
}

namespace velatura::accel {

struct Kernels;

/// How the tree is built. Hits do not depend on any of these, only time and memory do.
struct BvhOptions {
    int bins = 16;       ///< candidate planes per axis of the surface area heuristic, 2 … 32
    int max_depth = 48;  ///< of binary splits by cost; deeper ones halve the triangles
    double spare_references = 0.3;  ///< how many parts of divided triangles the tree may hold more
                                    ///< than triangles, relative to them; 0 = none is divided
    const Kernels* kernels = nullptr;  ///< of traverse.h; nullptr = the fastest for this processor
};

/// Triangles of one shape as the builder reads them; copied, need not outlive the build.
struct TriangleSoupView {
    std::span<const Vec3> positions;                     ///< [vertex]
    std::span<const std::array<uint32_t, 3>> triangles;  ///< [triangle] vertex indices
};

/// One placement of a prototype. A singular or non-finite matrix makes the instance unhittable.
struct SoupInstance {
    uint32_t prototype = 0;
    Mat4 render_from_prototype;
};

/// A scene reduced to triangles.
struct SoupScene {
    std::vector<TriangleSoupView> shapes;                   ///< render space
    std::vector<std::vector<TriangleSoupView>> prototypes;  ///< [prototype][shape]
    std::vector<SoupInstance> instances;
};

/// Own bounding volume hierarchy: 8-wide nodes over the triangles placed directly and over each
/// prototype, and one more over the instances. Built in parallel; the result does not depend on the
/// number of threads.
///
/// A hit is what `hit_triangle` (ray_query.h) says in double precision; boxes and the SIMD filter
/// are conservative, so every hit is the one that testing all triangles would find, bit for bit.
/// Dropped at build: triangles without area and those with a coordinate that is not below 2^126 in
/// absolute value. Of exact duplicates one may be kept, the one with the smallest index.
std::unique_ptr<Accelerator> build_bvh(const SoupScene& scene, const BvhOptions& options = {});

/// The triangles of a scene; refers to those of `geometry`.
SoupScene make_soup(const scene::Scene& scene, const geometry::GeometrySet& geometry);

std::unique_ptr<Accelerator> build_bvh(const scene::Scene& scene,
                                       const geometry::GeometrySet& geometry,
                                       const BvhOptions& options = {});

}  // namespace velatura::accel
