// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "scene/mesh.h"
#include "translate/context/context.h"
#include "translate/materials/materials.h"
#include "usd/stage/primvars.h"

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <unordered_set>
#include <vector>

namespace velatura::translate::geometry {

/// How many elements of each kind a prim has; 0: the interpolation is not possible.
struct ElementCounts {
    size_t faces = 0, points = 0, corners = 0;
    std::optional<size_t> varying = std::nullopt;  ///< of curves; else as many as points
};

/// State of this module: primvars that are read whether a material reads them or not.
struct RequestedPrimvars {
    std::unordered_set<std::string> names = {std::string(scene::display_color_primvar),
                                             std::string(scene::display_opacity_primvar), "st",
                                             "UVMap"};
    bool lists_all = false;  ///< notes the others in `found` as well
    std::map<std::string, scene::FoundPrimvar> found;

    /// Notes a primvar of the stage; width 0: it was not read.
    void note(const usd::stage::Primvar& primvar, int width);
};

/// Primvars that `materials` or the rest of the image want, checked against the element counts,
/// order by name.
std::vector<scene::Primvar> read_primvars(
    Context& ctx,
    Prim prim,
    const ElementCounts& counts,
    const std::vector<const materials::MaterialEntry*>& materials);

/// Adds scene::object_space_primvars where a material asks for them; matrix: of the prim, into
/// shape space.
void add_object_space(Context& ctx,
                      const std::vector<const materials::MaterialEntry*>& materials,
                      const Mat4d& matrix,
                      std::vector<scene::Primvar>& primvars);

/// Number of elements of a primvar of this interpolation.
size_t element_count(const ElementCounts& counts, scene::Interpolation interpolation);

}  // namespace velatura::translate::geometry
