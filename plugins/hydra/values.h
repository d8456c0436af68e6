// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/layer/path.h"
#include "usd/layer/value.h"

#include <pxr/base/tf/token.h>
#include <pxr/base/vt/value.h>
#include <pxr/usd/sdf/path.h>

#include <optional>
#include <string>

namespace velatura::hydra {

/// A value with the name of its type in USD: "color3f[]".
struct TypedValue {
    std::string type;
    usd::layer::Value value;
};

/// The path of a prim in a layer for a path of Hydra, whose property parts and variant selections
/// become parts of names.
usd::layer::Path to_path(const PXR_NS::SdfPath& path);

/// A value of Hydra. Arrays are copied. Asset paths are those that Hydra resolved.
/// Args:    role: of HdPrimvarRoleTokens: point, normal, vector, color, textureCoordinate.
/// Returns: nullopt for an empty value, and for types that no USD attribute has.
std::optional<TypedValue> to_value(const PXR_NS::VtValue& value, const PXR_NS::TfToken& role = {});

}  // namespace velatura::hydra
