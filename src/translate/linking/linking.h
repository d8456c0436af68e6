// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "translate/context/instance_source.h"
#include "translate/linking/ray_visibility.h"

#include <cstddef>
#include <cstdint>
#include <map>
#include <tuple>
#include <vector>

namespace velatura::translate::linking {

/// Where geometry stands that was read once and placed more often, for collections of paths.
struct LinkPathMapping {
    /// What is below `read` stands below `placed`; empty: where it was read.
    usd::layer::Path read, placed;
    std::vector<usd::layer::Path> instancers;  ///< point instancers, the innermost first
    VisibilityOpinion inherited;               ///< by what was placed there
};

/// State of this module: where everything stands.
struct LinkPathMappings {
    /// Some light is linked, see note_linking, casters are wanted, or visibility is authored.
    bool is_kept = false;
    /// The first is that of what is placed directly.
    std::vector<LinkPathMapping> list = std::vector<LinkPathMapping>(1);
    std::map<std::tuple<uint32_t, scene::ProvenanceId, const InstanceSource*>, uint32_t> known;
    // Indices into `list`
    std::vector<uint32_t> of_volume;    ///< of Scene::volumes
    std::vector<uint32_t> of_instance;  ///< of Scene::instances; empty unless is_kept
    size_t first_baked_shape = 0;       ///< of Scene::shapes, which stand elsewhere
    std::vector<uint32_t> of_baked;     ///< of those from there on

    /// Of Scene::shapes.
    uint32_t of_shape(size_t i) const {
        return i < first_baked_shape ? 0 : of_baked[i - first_baked_shape];
    }
};

/// Notes whether the light's collections lightLink and shadowLink, or filterLink of its filters,
/// say more than "everything", so that places of instances are kept. Returns it.
bool note_linking(Context& ctx, Prim light);

/// Whether a render pass tells geometry apart by where it stands.
bool asks_for_places(const RenderedPrims& rendered);

/// Where the prototype of a placement stands that itself stands at `outer`, index into
/// LinkPathMappings::list; 0 when nothing is linked.
uint32_t place_inside(Context& ctx, uint32_t outer, const Placement& placement);

/// Paths that what was placed there goes by: its own below the instance that brings it, then those
/// of its point instancers, the innermost first.
std::vector<usd::layer::Path> places_of(const Context& ctx,
                                        uint32_t place,
                                        scene::ProvenanceId provenance);

/// Evaluates the collections of all lights, what is authored of visibility to rays, and the
/// collections of a render pass, for all geometry that was placed: fills Scene::linking and what
/// refers to it. Membership is by path; geometry of a native instance goes by its path
/// below that instance, geometry of a point instancer by that of its prim and, where no rule covers
/// that, by that of the instancer.
void link_all(Context& ctx);

}  // namespace velatura::translate::linking
