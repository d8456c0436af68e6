// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "geometry/surface_point.h"
#include "scene/linking.h"

#include <cstddef>
#include <cstdint>
#include <span>

namespace velatura::accel {

struct SoupScene;  // bvh.h

/// Triangles that were left out of a tree because each lies exactly on another, with a smaller
/// number.
struct Duplicates {
    size_t count = 0;
    uint32_t prototype = scene::none;  ///< of the first of them; none: placed directly
    uint32_t shape = 0, triangle = 0;  ///< of the first of them, as those of geometry::Hit
};

/// What was built, for statistics.
struct AcceleratorStats {
    size_t triangles = 0;   ///< stored once per prototype
    size_t references = 0;  ///< triangles and parts of divided ones in leaves
    size_t primitives = 0;  ///< of PrimitiveSets, stored once per prototype
    size_t instances = 0;
    Duplicates duplicates;  ///< found where no plane divides what lies in one place, elsewhere kept
    size_t nodes = 0;
    size_t bytes = 0;
    double build_seconds = 0;
    const char* quality = "";  ///< of the own tree, see BvhQuality
};

/// Finds where rays meet the triangles and primitives of a scene. Implementations are immutable
/// after the build, but for move_instances, and safe to share among threads. Results depend on
/// nothing but the geometry: of hits with the same t one by which the ray enters wins, then the
/// smallest (instance, shape, triangle or primitive). Rays with a NaN or infinite component meet
/// nothing.
class Accelerator {
  public:
    virtual ~Accelerator() = default;

    /// Closest hit with 0 < t < ray.t_max; an invalid Hit when there is none.
    virtual geometry::Hit intersect(const geometry::Ray& ray) const = 0;

    /// Whether anything lies at 0 < t < ray.t_max.
    virtual bool is_occluded(const geometry::Ray& ray) const = 0;

    /// The same among the geometry of the classes in `met` alone; the rest is as if it were not
    /// there. Classes are those of SoupScene::classes.
    virtual geometry::Hit intersect_some(const geometry::Ray& ray,
                                         const scene::LinkSet& met) const = 0;
    virtual bool is_occluded_by_some(const geometry::Ray& ray, const scene::LinkSet& met) const = 0;

    /// The same for many rays at once, among everything; hits[i] is that of rays[i]. Which one is
    /// faster depends on the scene and on how alike the rays are: RayStream (ray_stream.h) finds
    /// out.
    virtual void intersect_batch(std::span<const geometry::Ray> rays,
                                 std::span<geometry::Hit> hits) const {
        for (size_t i = 0; i < rays.size(); ++i) hits[i] = intersect(rays[i]);
    }

    /// The same; occluded[i] is 0 or 1.
    virtual void is_occluded_batch(std::span<const geometry::Ray> rays,
                                   std::span<uint8_t> occluded) const {
        for (size_t i = 0; i < rays.size(); ++i) occluded[i] = is_occluded(rays[i]);
    }

    /// Whether these two do anything else than trace one ray after the other.
    virtual bool has_batches() const { return false; }

    /// Places the instances as in `scene`, whose shapes and prototypes are those that it was built
    /// of. Not while rays are traced. Returns: false where it has to be built again for that.
    virtual bool move_instances(const SoupScene& scene) {
        (void)scene;
        return false;
    }

    /// Box of everything, render space.
    virtual Box3 bounds() const = 0;

    virtual AcceleratorStats stats() const = 0;
};

}  // namespace velatura::accel
