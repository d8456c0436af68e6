// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accel/accelerator.h"
#include "base/math.h"
#include "geometry/primitive_set.h"
#include "scene/linking.h"

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

/// How much time goes into building the tree. Hits do not depend on it.
enum class BvhQuality {
    Fast,      ///< few candidate planes, no triangle divided
    Balanced,  ///< what BvhOptions say by default
    High,      ///< smaller leaves where they cost less, planes through triangles tried everywhere
};

const char* name_of(BvhQuality quality);

/// The one that is likely to take the least time in all, by the number of rays to come. The same on
/// every machine.
BvhQuality choose_quality(double rays, size_t triangles);

/// How the tree is built. Hits do not depend on any of these, only time and memory do.
struct BvhOptions {
    int bins = 16;         ///< candidate planes per axis of the surface area heuristic, 2 … 32
    size_t leaf_size = 8;  ///< triangles at which splitting ends, 1 … 8; fewer find hardly more
    int max_depth = 48;    ///< of binary splits by cost; deeper ones halve the triangles
    double spare_references = 0.3;  ///< how many parts of divided triangles the tree may hold more
                                    ///< than triangles, relative to them; 0 = none is divided
    int backoff =
        1;  ///< where dividing triangles did not pay, it is tried again where the range has
            ///< shrunk to 2^-backoff, then 2^-(2·backoff) of that …; 0 = at every node
    bool keep_shapes_apart = false;  ///< keep exact duplicates that are in different shapes
    BvhQuality quality = BvhQuality::Balanced;  ///< only a name here; see options_of
    const Kernels* kernels = nullptr;  ///< of traverse.h; nullptr = the fastest for this processor
};

BvhOptions options_of(BvhQuality quality);

/// Triangles of one shape as the builder reads them; copied, need not outlive the build. Or its
/// primitives, which are kept; a shape has one or the other.
struct TriangleSoupView {
    std::span<const Vec3> positions;                     ///< [vertex]
    std::span<const std::array<uint32_t, 3>> triangles;  ///< [triangle] vertex indices
    std::shared_ptr<const geometry::PrimitiveSet> primitives = nullptr;
    std::span<const std::vector<Vec3>> later_positions = {};  ///< see geometry::TriangleMeshData
    bool is_flipped = false;  ///< the outside is where the corners run clockwise

    uint32_t segments() const { return uint32_t(later_positions.size()); }  ///< 0: does not move

    /// Which of its corners a tree has second and third: in trees they run counter-clockwise as
    /// seen from outside.
    size_t second() const { return is_flipped ? 2 : 1; }

    size_t third() const { return is_flipped ? 1 : 2; }

    /// What Hit::triangle counts.
    size_t count() const { return primitives ? primitives->size() : triangles.size(); }
};

/// One placement of a prototype. A singular or non-finite matrix makes the instance unhittable.
struct SoupInstance {
    uint32_t prototype = 0;
    Mat4 render_from_prototype;
    /// [key − 1] the same at the later keys of an instance that moves, see scene::Instance. Not
    /// there at all when a key is not finite; see place_at_time (placement.h) for singular ones.
    std::span<const Mat4> later = {};
};

/// Classes of the geometry, for rays that meet some of them only: scene/linking.h. Empty: all is of
/// class 0.
struct SoupClasses {
    std::vector<scene::LinkClass> of_shape;           ///< [shape placed directly]
    std::vector<std::vector<scene::LinkClass>> rows;  ///< [row][shape of a prototype]
    std::vector<uint32_t> row_of_instance;            ///< [instance]; none: all of class 0

    bool is_empty() const { return of_shape.empty() && row_of_instance.empty(); }

    scene::LinkClass of(uint32_t instance, uint32_t shape) const {
        if (is_empty()) return 0;
        if (instance == scene::none) return of_shape[shape];
        const uint32_t row = row_of_instance[instance];
        return row == scene::none ? 0 : rows[row][shape];
    }
};

/// A scene reduced to triangles and primitives.
struct SoupScene {
    std::vector<TriangleSoupView> shapes;                   ///< render space
    std::vector<std::vector<TriangleSoupView>> prototypes;  ///< [prototype][shape]
    std::vector<SoupInstance> instances;
    SoupClasses classes = {};
};

/// Own bounding volume hierarchy: 8-wide nodes over the triangles placed directly and over each
/// prototype, and one more over the instances and the primitives placed directly. Primitives of a
/// prototype have a tree beside that of its triangles. Built in parallel; the result does not
/// depend on the number of threads.
///
/// A hit is what `hit_triangle` (ray_query.h) says in double precision; boxes and the SIMD filter
/// are conservative, so every hit is the one that testing all triangles and primitives would find,
/// bit for bit.
/// Dropped at build: triangles without area and those with a coordinate that is not below 2^126 in
/// absolute value. Of exact duplicates one may be kept, the one with the smallest index; those in
/// different shapes all are where the scene has classes.
std::unique_ptr<Accelerator> build_bvh(const SoupScene& scene, const BvhOptions& options = {});

/// The triangles of a scene; refers to those of `geometry`.
SoupScene make_soup(const scene::Scene& scene, const geometry::GeometrySet& geometry);

size_t triangle_count(const SoupScene& scene);  ///< those of a prototype once

std::unique_ptr<Accelerator> build_bvh(const scene::Scene& scene,
                                       const geometry::GeometrySet& geometry,
                                       const BvhOptions& options = {});

}  // namespace velatura::accel
