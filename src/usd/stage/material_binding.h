// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/stage/stage.h"

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace velatura::usd::stage {

/// How a prim got its material.
struct MaterialBinding {
    Prim
        material;  ///< invalid when nothing is bound, or when the winning binding names no Material
    Relationship relation;  ///< the winning binding; invalid when nothing is bound

    bool is_bound() const { return relation.is_valid(); }
};

/// Resolves material bindings for `prim` (a gprim or a GeomSubset): purpose first, then
/// all-purpose; nearest wins unless an ancestor says strongerThanDescendants; collection bindings
/// beat direct ones on one prim. `purpose` is "full", "preview" or "" (all-purpose only). Ref:
/// UsdShadeMaterialBindingAPI.
MaterialBinding resolve_material(Prim prim, std::string_view purpose = "full");
/// The same by the first of several purposes that something is bound for, then all-purpose.
MaterialBinding resolve_material(Prim prim, std::span<const std::string> purposes);

/// GeomSubsets of a mesh that bind materials: familyName "materialBind", elementType "face", in
/// namespace order.
std::vector<Prim> material_subsets(Prim mesh);

}  // namespace velatura::usd::stage
