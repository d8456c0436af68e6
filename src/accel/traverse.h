// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accel/bvh_layout.h"
#include "geometry/primitive_set.h"
#include "geometry/surface_point.h"
#include "scene/linking.h"

#include <cstdint>
#include <span>
#include <vector>

namespace velatura::accel {

/// A placed prototype, as traversal needs it.
struct InstanceRecord {
    double prototype_from_render[4][3];  ///< row vectors, row 3 = translation
    uint32_t tree = 0;                   ///< index into SceneTrees::prototypes
    uint32_t instance = 0;               ///< index into Scene::instances
};

/// A primitive, as traversal needs it.
struct PrimitiveRecord {
    const geometry::PrimitiveSet* set = nullptr;
    uint32_t index = 0;  ///< within the set
    uint32_t id = 0;     ///< counts like those of triangles
};

/// The primitives of a prototype, in its space.
struct PrimitiveTree {
    WideTree tree;                            ///< leaves index `primitives`
    std::vector<PrimitiveRecord> primitives;  ///< those that can be hit
    double origin_slack = 0;                  ///< QuerySlack::origin for `tree`
};

/// A placement that moves.
struct MovingInstance {
    uint32_t tree = 0;      ///< index into SceneTrees::prototypes
    uint32_t instance = 0;  ///< index into Scene::instances
};

/// The instances that move over the same number of segments.
struct MovingInstances {
    MovingTree boxes;                       ///< no leaves: they index `instances`
    std::vector<MovingInstance> instances;  ///< those that can be hit
    std::vector<Mat4> keys;                 ///< [instance][key] render_from_prototype
    QueryBounds query_bounds;               ///< of the boxes at all keys
    double origin_slack = 0;                ///< QuerySlack::origin for `boxes`
};

/// The classes of everything, for rays that meet some of them only; empty in scenes without any.
struct SceneClasses {
    /// Those that an instance gives the shapes of its prototype.
    struct Row {
        uint32_t prototype = 0;
        std::vector<scene::LinkClass> of_shape;
        uint32_t folded = 0;      ///< scene::LinkSet::folded_bit of all of them
        bool is_uniform = false;  ///< all alike
    };

    std::vector<scene::LinkClass> of_shape;              ///< placed directly
    std::vector<uint32_t> direct_first;                  ///< [shape placed directly] its first id
    std::vector<std::vector<uint32_t>> prototype_first;  ///< [prototype][shape] the same
    std::vector<Row> rows;
    std::vector<uint32_t> row_of_instance;  ///< [instance]

    const Row& row(uint32_t instance) const { return rows[row_of_instance[instance]]; }
};

/// Everything a ray meets.
struct SceneTrees {
    WideTree direct;                            ///< triangles placed directly that do not move
    MovingTrees direct_motion;                  ///< and those that do
    std::vector<WideTree> prototypes;           ///< in prototype space
    std::vector<MovingTrees> prototype_motion;  ///< [prototype]; empty when nothing moves in any
    /// Boxes of instances and of primitives placed directly; leaves index `instances` and, from
    /// their number on, `primitives`.
    WideTree top;
    std::vector<InstanceRecord> instances;            ///< those that can be hit
    std::vector<PrimitiveRecord> primitives;          ///< those that can be hit
    std::vector<PrimitiveTree> prototype_primitives;  ///< [prototype]; empty when none has any
    double top_origin_slack = 0;                      ///< QuerySlack::origin for `top`

    std::vector<MovingInstances> moving_instances;
    SceneClasses classes;  ///< WideNode::classes are only there with it

    bool has_motion() const {
        return !direct_motion.is_empty() || !prototype_motion.empty() || !moving_instances.empty();
    }
};

/// Best hit so far. `id` counts the triangles and primitives of a prototype, or of what is placed
/// directly.
struct TreeHit {
    float t = 0, b1 = 0, b2 = 0;
    uint32_t instance = scene::none;
    uint32_t id = scene::none;
    bool is_leaving = false;  ///< see TriangleHit; of primitives never
};

/// Kernels compiled for one instruction set.
struct Kernels {
    const char* name;
    /// Closest hit with 0 < t < ray.t_max; among equal t one that enters before one that leaves, as
    /// front and back of a body are at its outline; among those the smallest (instance, id). False:
    /// no hit.
    bool (*intersect)(const SceneTrees&, const geometry::Ray&, TreeHit&);
    bool (*is_occluded)(const SceneTrees&, const geometry::Ray&);
    /// The same for scenes in which something moves; those above know of no motion.
    bool (*intersect_moving)(const SceneTrees&, const geometry::Ray&, TreeHit&);
    bool (*is_occluded_moving)(const SceneTrees&, const geometry::Ray&);
    /// The same among some of the geometry, whether anything moves or not: for scenes with classes.
    bool (*intersect_some)(const SceneTrees&,
                           const geometry::Ray&,
                           const scene::LinkSet&,
                           TreeHit&);
    bool (*is_occluded_by_some)(const SceneTrees&, const geometry::Ray&, const scene::LinkSet&);
    /// The same for many rays, among the triangles placed directly alone; id none: no hit. nullptr
    /// where the instruction set makes it slower than ray by ray.
    void (*intersect_batch)(const SceneTrees&, std::span<const geometry::Ray>, std::span<TreeHit>);
    void (*occlude_batch)(const SceneTrees&, std::span<const geometry::Ray>, std::span<uint8_t>);
};

/// The fastest kernels that this processor runs. All give the same bits: hits are decided in double
/// by the operations of hit_triangle, one by one or four side by side, after a conservative filter
/// in floats.
const Kernels& best_kernels();

/// Those and the slower ones that this processor runs, for tests.
std::vector<Kernels> all_kernels();

}  // namespace velatura::accel
