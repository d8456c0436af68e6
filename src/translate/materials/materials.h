// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "scene/material.h"
#include "translate/context/context.h"

#include <string>
#include <unordered_map>
#include <vector>

namespace velatura::translate::materials {

/// A material that was translated, and the primvars that it reads.
struct MaterialEntry {
    scene::MaterialId id = scene::none;
    std::vector<std::string> primvars;
    std::vector<std::string> needed;  ///< those of `primvars` that have no authored fallback
    std::string name;                 ///< prim path
    bool is_emissive = false;
    bool is_displacing = false;
    bool is_hair = false;         ///< means something to curves alone
    bool needs_tangents = false;  ///< by texture coordinates of the mesh, whatever their name
};

/// State of this module: what bindings are followed, and what they led to.
struct TranslatedMaterials {
    std::vector<std::string> purposes = {"full"};  ///< the first that binds wins
    std::unordered_map<std::string, MaterialEntry> entries;
    bool has_emissive = false;
};

/// Material bound to a gprim or GeomSubset, translated on first use; id none when nothing usable is
/// bound.
const MaterialEntry& bound_material(Context& ctx, Prim prim);
/// Whether a binding reaches the prim at all, usable or not.
bool has_binding(Context& ctx, Prim prim);

}  // namespace velatura::translate::materials
