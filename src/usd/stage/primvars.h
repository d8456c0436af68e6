// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/stage/stage.h"

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace velatura::usd::stage {

enum class Interpolation : unsigned char { Constant, Uniform, Varying, Vertex, FaceVarying };

std::optional<Interpolation> interpolation_from_name(std::string_view name);
std::string_view interpolation_name(Interpolation interpolation);

/// A primvar, maybe inherited from an ancestor (then constant).
struct Primvar {
    std::string name;     ///< without "primvars:"
    Attribute attribute;  ///< the values
    Attribute indices;    ///< "<attribute>:indices"; without value when not indexed
    Interpolation interpolation = Interpolation::Constant;
    int element_size = 1;  ///< consecutive array elements that make one primvar element

    bool is_indexed() const { return indices.is_authored() && indices.has_authored_value(); }

    /// Indices; empty when not indexed or blocked.
    std::vector<int> index_values(TimeCode time = {}) const;
};

/// The prim's own primvar or the nearest ancestor's constant one; nullopt when neither has a value.
std::optional<Primvar> find_primvar(Prim prim, std::string_view name);

/// All primvars with a value that apply to the prim, inherited constants included, sorted by name.
std::vector<Primvar> find_primvars(Prim prim);

/// A primvar view of any attribute with interpolation metadata ("normals", "widths"), whose
/// fallback is given.
Primvar as_primvar(Attribute attribute, Interpolation fallback);

}  // namespace velatura::usd::stage
