// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/crate/crate_file.h"
#include "usd/layer/types.h"
#include "usd/layer/value_type.h"

#include <cstdint>
#include <cstring>
#include <string>
#include <type_traits>
#include <utility>

namespace velatura::usd::crate {

/// T lies in files as it lies in memory.
template <class T>
inline constexpr bool is_stored_plain =
    (std::is_arithmetic_v<T> && !std::is_same_v<T, bool>) || std::is_same_v<T, layer::Float16> ||
    std::is_same_v<T, layer::TimeCodeValue> || std::is_same_v<T, layer::Vec2i> ||
    std::is_same_v<T, layer::Vec3i> || std::is_same_v<T, layer::Vec4i> ||
    std::is_same_v<T, layer::Vec2h> || std::is_same_v<T, layer::Vec3h> ||
    std::is_same_v<T, layer::Vec4h> || std::is_same_v<T, layer::Vec2f> ||
    std::is_same_v<T, layer::Vec3f> || std::is_same_v<T, layer::Vec4f> ||
    std::is_same_v<T, layer::Vec2d> || std::is_same_v<T, layer::Vec3d> ||
    std::is_same_v<T, layer::Vec4d> || std::is_same_v<T, layer::Mat2d> ||
    std::is_same_v<T, layer::Mat3d> || std::is_same_v<T, layer::Mat4d>;

template <class T>
inline constexpr bool is_text =
    std::is_same_v<T, std::string> || std::is_same_v<T, layer::Token> ||
    std::is_same_v<T, layer::AssetPath> || std::is_same_v<T, layer::PathExpression>;

template <class T>
inline constexpr bool is_quaternion =
    std::is_same_v<T, layer::QuatHalf> || std::is_same_v<T, layer::QuatFloat> ||
    std::is_same_v<T, layer::QuatDouble>;

/// Arrays of T may be compressed as integers.
template <class T>
inline constexpr bool is_integer_of_arrays =
    std::is_same_v<T, int32_t> || std::is_same_v<T, uint32_t> || std::is_same_v<T, int64_t> ||
    std::is_same_v<T, uint64_t>;

/// Arrays of T may be compressed as whole numbers or by a table.
template <class T>
inline constexpr bool is_float_of_arrays =
    std::is_same_v<T, layer::Float16> || std::is_same_v<T, float> || std::is_same_v<T, double>;

/// Bytes of a T in a file: texts are indices of 32 bits.
template <class T>
constexpr size_t stored_size() {
    return is_text<T> ? sizeof(uint32_t) : sizeof(T);
}

/// Type number of a T.
template <class T>
inline constexpr TypeId type_id_of = TypeId::Invalid;
// clang-format off
template <> inline constexpr TypeId type_id_of<bool> = TypeId::Bool;
template <> inline constexpr TypeId type_id_of<uint8_t> = TypeId::UChar;
template <> inline constexpr TypeId type_id_of<int32_t> = TypeId::Int;
template <> inline constexpr TypeId type_id_of<uint32_t> = TypeId::UInt;
template <> inline constexpr TypeId type_id_of<int64_t> = TypeId::Int64;
template <> inline constexpr TypeId type_id_of<uint64_t> = TypeId::UInt64;
template <> inline constexpr TypeId type_id_of<layer::Float16> = TypeId::Half;
template <> inline constexpr TypeId type_id_of<float> = TypeId::Float;
template <> inline constexpr TypeId type_id_of<double> = TypeId::Double;
template <> inline constexpr TypeId type_id_of<layer::TimeCodeValue> = TypeId::TimeCode;
template <> inline constexpr TypeId type_id_of<std::string> = TypeId::String;
template <> inline constexpr TypeId type_id_of<layer::Token> = TypeId::Token;
template <> inline constexpr TypeId type_id_of<layer::AssetPath> = TypeId::Asset;
template <> inline constexpr TypeId type_id_of<layer::PathExpression> = TypeId::PathExpression;
template <> inline constexpr TypeId type_id_of<layer::Vec2i> = TypeId::Int2;
template <> inline constexpr TypeId type_id_of<layer::Vec3i> = TypeId::Int3;
template <> inline constexpr TypeId type_id_of<layer::Vec4i> = TypeId::Int4;
template <> inline constexpr TypeId type_id_of<layer::Vec2h> = TypeId::Half2;
template <> inline constexpr TypeId type_id_of<layer::Vec3h> = TypeId::Half3;
template <> inline constexpr TypeId type_id_of<layer::Vec4h> = TypeId::Half4;
template <> inline constexpr TypeId type_id_of<layer::Vec2f> = TypeId::Float2;
template <> inline constexpr TypeId type_id_of<layer::Vec3f> = TypeId::Float3;
template <> inline constexpr TypeId type_id_of<layer::Vec4f> = TypeId::Float4;
template <> inline constexpr TypeId type_id_of<layer::Vec2d> = TypeId::Double2;
template <> inline constexpr TypeId type_id_of<layer::Vec3d> = TypeId::Double3;
template <> inline constexpr TypeId type_id_of<layer::Vec4d> = TypeId::Double4;
template <> inline constexpr TypeId type_id_of<layer::QuatHalf> = TypeId::Quath;
template <> inline constexpr TypeId type_id_of<layer::QuatFloat> = TypeId::Quatf;
template <> inline constexpr TypeId type_id_of<layer::QuatDouble> = TypeId::Quatd;
template <> inline constexpr TypeId type_id_of<layer::Mat2d> = TypeId::Matrix2d;
template <> inline constexpr TypeId type_id_of<layer::Mat3d> = TypeId::Matrix3d;
template <> inline constexpr TypeId type_id_of<layer::Mat4d> = TypeId::Matrix4d;

// clang-format on

/// Calls `visit` with a null pointer to the C++ type of a type number that attributes may have;
/// false when it is none.
template <class Visit>
bool visit_attribute_type(TypeId type, const Visit& visit) {
    const auto try_one = [&]<class T>([[maybe_unused]] const T* tag) {
        if constexpr (type_id_of<T> == TypeId::Invalid) {
            return false;
        } else {
            if (type_id_of<T> != type) return false;
            visit(tag);
            return true;
        }
    };
    constexpr size_t count = size_t(layer::ValueType::Matrix4d) + 1;
    return [&]<size_t... I>(std::index_sequence<I...>) {
        return (
            try_one(static_cast<const std::tuple_element_t<I, layer::ValueTypeList>*>(nullptr)) ||
            ...);
    }
    (std::make_index_sequence<count>());
}

/// The element whose stored_size() bytes begin at `data`, for all types but texts.
template <class T>
T load_element(const char* data) {
    if constexpr (std::is_same_v<T, bool>) {
        return *data != 0;
    } else if constexpr (is_quaternion<T>) {
        // Files have the real part last
        using Part = std::remove_cvref_t<decltype(T().r)>;
        Part parts[4];
        for (int i = 0; i < 4; ++i) {
            std::memcpy(static_cast<void*>(&parts[i]), data + size_t(i) * sizeof(Part),
                        sizeof(Part));
        }
        return T(parts[3], Imath::Vec3<Part>(parts[0], parts[1], parts[2]));
    } else {
        T value;
        std::memcpy(static_cast<void*>(&value), data, sizeof(T));
        return value;
    }
}

/// The text an index of an element of a text type stands for; false when there is none. The bytes
/// a copy of it takes are added to `copied`.
template <class T>
bool load_text(const CrateFile& file, uint32_t index, T& out, uint64_t& copied) {
    if constexpr (std::is_same_v<T, layer::Token>) {
        if (index >= file.tokens.size()) return false;
        out = file.tokens[index];
    } else {
        if (index >= file.strings.size()) return false;
        const std::string& text = file.tokens[file.strings[index]].str();
        copied += text.size();
        if constexpr (std::is_same_v<T, std::string>) {
            out = text;
        } else if constexpr (std::is_same_v<T, layer::AssetPath>) {
            out.path = text;
        } else {
            out.text = text;
        }
    }
    return true;
}

}  // namespace velatura::usd::crate
