// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "translate/context/context.h"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace velatura::translate {
inline namespace context {

/// A light prim and its transform into the space of its InstanceSource.
struct LightSite {
    Prim prim;
    Mat4d matrix;                   ///< of one that moves, as when the shutter opens
    std::vector<Mat4d> later = {};  ///< as Placement::later
    double reach = 0;               ///< from its origin, in its own space
};

struct InstanceSource;

/// An instance: one placement of a prototype, in the space of its parent InstanceSource.
struct Placement {
    InstanceSource* what = nullptr;
    Mat4d matrix;  ///< from the prototype, relative to its origin, to the parent, relative to its
    /// [key − 1] the same at the later keys of its motion, 1, 2, 4, 8 or 16 of them; empty: stays.
    std::vector<Mat4d> later = {};
    uint32_t first_value = 0, value_count = 0;  ///< of Scene::instance_values, handed down
    scene::ProvenanceId provenance = scene::none;
};

/// What a traversal of the namespace collects and instances place: the whole stage, or a prototype.
struct InstanceSource {
    std::string name;
    Prim frame;  ///< of a prototype: the prim whose children's space the walk is in
    std::vector<scene::Shape> shapes;   ///< in the space of this source
    std::vector<Placement> placements;  ///< nested ones
    std::vector<LightSite> lights;
    std::vector<scene::Volume> volumes;  ///< in the space of this source
    uint32_t prototype = scene::none;    ///< index into Scene::prototypes once `shapes` moved there
    bool is_being_built = false;         ///< guards against prototypes that hold themselves
    bool is_stage = false;               ///< the whole stage, not a prototype
    bool is_point_prototype = false;     ///< of point instancers, not of native instances
    bool is_origin_fixed = false;        ///< something of a prototype stands relative to `origin`
    /// Of a whole prototype, once motion asked for it: see instancing/placement_motion.cpp.
    std::optional<double> reach;
    /// Subtracted from the translation of every matrix: what is cast to float stays near zero. For
    /// a prototype the position of the first thing in it, in the prototype's authored space.
    Vec3d origin = Vec3d(0.0);
};

/// The matrix, with the parent's origin subtracted from its translation.
Mat4d relative_to(const Mat4d& matrix, const Vec3d& origin);

/// The matrix of what stands around `from`, to around `to`: its translation is
/// from · matrix − to, summed with twice the working precision, since large parts of it cancel.
Mat4d between_origins(const Mat4d& matrix, const Vec3d& from, const Vec3d& to);

/// Chooses the origin of a prototype in which nothing stands yet; no change for others.
void propose_origin(InstanceSource& out, const Vec3d& position);

}  // namespace context
}  // namespace velatura::translate
