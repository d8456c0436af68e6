// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/layer/value.h"

#include <optional>
#include <span>
#include <string_view>

namespace velatura::usd::stage {

/// One attribute that a schema declares; `fallback` is .usda value text ("" = declared without a
/// value).
struct SchemaAttribute {
    std::string_view schema;  ///< typed schema ("Mesh") or applied one ("ShapingAPI")
    std::string_view name;
    std::string_view type;  ///< "float3[]"
    bool uniform;
    std::string_view fallback;
};

/// Base type of a typed schema; "" for roots and unknown types.
std::string_view schema_base(std::string_view type);
bool schema_is_a(std::string_view type, std::string_view base);
/// API schemas that a type has without authoring them ("SphereLight" → "LightAPI").
std::span<const std::string_view> schema_builtin_apis(std::string_view type);
/// The declaration of an attribute on one schema or the bases of a typed one; nullptr when there is
/// none.
const SchemaAttribute* find_schema_attribute(std::string_view schema, std::string_view name);
/// The parsed fallback; nullopt when the declaration has none.
std::optional<layer::Value> schema_fallback(const SchemaAttribute& attribute);

}  // namespace velatura::usd::stage
