// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/stage/schema_fallbacks.h"

#include <span>
#include <string_view>
#include <vector>

namespace velatura::usd::stage {

/// A schema this renderer reads: its base (typed schemas) and the APIs it has built in.
struct SchemaType {
    std::string_view name;
    std::string_view base;
    std::vector<std::string_view> apis;
};

/// A relationship that a schema declares.
struct SchemaRelationship {
    std::string_view schema, name;
};

/// Facts of OpenUSD 24.08 to 26.03's schema.usda files (UsdGeom, UsdLux, UsdShade, UsdRender,
/// UsdVol, UsdSkel names).
std::span<const SchemaType> schema_types();
std::span<const SchemaAttribute> schema_attributes();
std::span<const SchemaRelationship> schema_relationships();

}  // namespace velatura::usd::stage
