// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/layer/layer.h"

#include <cstdint>

namespace velatura::usd::crate {

/// Fields of files that name the children of a spec; a Layer has them apart.
struct ChildFields {
    layer::Token prims{"primChildren"};
    layer::Token properties{"properties"};
    layer::Token variant_sets{"variantSetChildren"};
    layer::Token variants{"variantChildren"};
};

const ChildFields& child_fields();

/// The field names children that a Layer does not hold: connections, targets, mappers.
bool is_inert_child_field(layer::Token field);

enum class FieldUse : uint8_t {
    Keep,
    Drop,   ///< says nothing: the text form would leave it out
    Wrong,  ///< of a type that the field cannot have
};

/// Brings a field's value into the form that the text reader gives it: modern type names, payloads
/// as list ops, selections sorted. `kind` is that of the spec.
FieldUse convert_field(layer::SpecKind kind, layer::Token name, layer::Value& value);

/// Adds what the text reader always gives a spec: the specifier of prims, offsets of sub-layers.
void complete_fields(layer::Spec& spec, SourceLoc loc);

}  // namespace velatura::usd::crate
