// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/layer/list_op.h"
#include "usd/layer/types.h"

#include <cstddef>
#include <cstdint>
#include <string>
#include <tuple>
#include <type_traits>
#include <vector>

namespace velatura::usd::layer {

class Value;
class Dictionary;
class TimeSamples;
struct Reference;
struct Payload;
struct SplineValue;

// clang-format off
/// What a Value holds (of an array: what its elements are).
enum class ValueType : uint8_t {
    // Element types of attributes, scalar or array
    Bool, UChar, Int, UInt, Int64, UInt64, Half, Float, Double, TimeCode, String, Token, Asset,
    PathExpression, Opaque, Int2, Int3, Int4, Half2, Half3, Half4, Float2, Float3, Float4, Double2,
    Double3, Double4, Quath, Quatf, Quatd, Matrix2d, Matrix3d, Matrix4d,
    // Types of fields only
    Dictionary, TokenListOp, StringListOp, PathListOp, ReferenceListOp, PayloadListOp, IntListOp,
    UIntListOp, Int64ListOp, UInt64ListOp, UnregisteredListOp, Path, Specifier, Permission,
    Variability, LayerOffsets, RelocateMap, SelectionMap, TimeSamples, Unregistered, Spline,
    Payload,
    // No C++ type
    Block,           ///< `None`: hides weaker values
    AnimationBlock,  ///< `AnimationBlock`: hides weaker time samples and splines, not defaults
    Empty,           ///< nothing authored
};
// clang-format on

using TokenListOp = ListOp<Token>;
using StringListOp = ListOp<std::string>;
using PathListOp = ListOp<Path>;
using ReferenceListOp = ListOp<Reference>;
using PayloadListOp = ListOp<Payload>;

// clang-format off
/// The C++ types of ValueType, in its order.
using ValueTypeList = std::tuple<
    bool, uint8_t, int32_t, uint32_t, int64_t, uint64_t, Float16, float, double, TimeCodeValue,
    std::string, Token, AssetPath, PathExpression, OpaqueValue, Vec2i, Vec3i, Vec4i, Vec2h, Vec3h,
    Vec4h, Vec2f, Vec3f, Vec4f, Vec2d, Vec3d, Vec4d, QuatHalf, QuatFloat, QuatDouble, Mat2d, Mat3d,
    Mat4d,
    Dictionary, TokenListOp, StringListOp, PathListOp, ReferenceListOp, PayloadListOp,
    ListOp<int32_t>, ListOp<uint32_t>, ListOp<int64_t>, ListOp<uint64_t>,
    ListOp<UnregisteredValue>, Path, Specifier, Permission, Variability, std::vector<LayerOffset>,
    Relocates, VariantSelections, TimeSamples, UnregisteredValue, SplineValue, Payload>;
// clang-format on
static_assert(std::tuple_size_v<ValueTypeList> == size_t(ValueType::Block));

namespace detail {
template <class T, size_t I = 0>
constexpr size_t value_type_index() {
    if constexpr (I == std::tuple_size_v<ValueTypeList>) {
        return I;
    } else if constexpr (std::is_same_v<T, std::tuple_element_t<I, ValueTypeList>>) {
        return I;
    } else {
        return value_type_index<T, I + 1>();
    }
}

// Types whose bytes may be moved about with memcpy although Imath declares copy constructors for
// them
template <class T>
inline constexpr bool is_plain =
    std::is_trivially_destructible_v<T> && !std::is_same_v<T, OpaqueValue>;
}  // namespace detail

/// T is one of ValueTypeList.
template <class T>
concept ValueElement = detail::value_type_index<T>()
< std::tuple_size_v<ValueTypeList>;

template <ValueElement T>
inline constexpr ValueType value_type_of = ValueType(detail::value_type_index<T>());

inline constexpr bool is_attribute_type(ValueType t) {
    return t <= ValueType::Matrix4d;
}

}  // namespace velatura::usd::layer
