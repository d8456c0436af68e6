// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/layer/token.h"
#include "usd/layer/value.h"

#include <cstdint>
#include <span>
#include <string_view>

namespace velatura::usd::layer {

/// What a value stands for beside its numbers.
enum class Role : uint8_t {
    None,
    Point,
    Normal,
    Vector,
    Color,
    TexCoord,
    Frame,
    Transform,
    PointIndex,
    EdgeIndex,
    FaceIndex,
    Group
};

/// A value type an attribute may be declared with, such as "color3f[]".
struct TypeInfo {
    Token name;         ///< the name to write; legacy names read as their modern ones
    Token scalar_name;  ///< name without "[]"
    ValueType type = ValueType::Opaque;  ///< of the value or of the elements
    Role role = Role::None;
    bool is_array = false;
    uint8_t rows = 1;     ///< matrices: 2, 3, 4; else 1
    uint8_t columns = 1;  ///< numbers per tuple or matrix row; 1 for scalars
};

/// Descriptor of a modern or legacy type name; nullptr for names USD does not know.
const TypeInfo* find_type(std::string_view name);
const TypeInfo* find_type(Token name);
/// Every type under the name it is written with, scalar and array.
std::span<const TypeInfo> all_types();

/// Plain type name of a value without role: "float3[]", "dictionary"; empty for types that only
/// fields have.
std::string_view plain_type_name(const Value& value);

/// Numbers per row and rows of an attribute element type.
struct TypeShape {
    uint8_t rows = 1;
    uint8_t columns = 1;
};

TypeShape shape_of(ValueType type);

}  // namespace velatura::usd::layer
