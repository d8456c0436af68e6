// SPDX-License-Identifier: Apache-2.0
#include "plugins/hydra/values.h"

#include <pxr/base/gf/half.h>
#include <pxr/base/gf/matrix2d.h>
#include <pxr/base/gf/matrix3d.h>
#include <pxr/base/gf/matrix4d.h>
#include <pxr/base/gf/quatd.h>
#include <pxr/base/gf/quatf.h>
#include <pxr/base/gf/quath.h>
#include <pxr/base/gf/vec2d.h>
#include <pxr/base/gf/vec2f.h>
#include <pxr/base/gf/vec2h.h>
#include <pxr/base/gf/vec2i.h>
#include <pxr/base/gf/vec3d.h>
#include <pxr/base/gf/vec3f.h>
#include <pxr/base/gf/vec3h.h>
#include <pxr/base/gf/vec3i.h>
#include <pxr/base/gf/vec4d.h>
#include <pxr/base/gf/vec4f.h>
#include <pxr/base/gf/vec4h.h>
#include <pxr/base/gf/vec4i.h>
#include <pxr/base/vt/array.h>
#include <pxr/imaging/hd/tokens.h>
#include <pxr/usd/sdf/assetPath.h>

#include <cctype>
#include <cstring>
#include <utility>
#include <vector>

namespace velatura::hydra {

using namespace PXR_NS;

namespace layer = usd::layer;

namespace {

/// Types of the same bytes in both.
template <class To, class From>
To cast(const From& from) {
    static_assert(sizeof(To) == sizeof(From));
    To to;
    std::memcpy(static_cast<void*>(&to), &from, sizeof(To));
    return to;
}

template <class To, class From>
To cast_quaternion(const From& from) {
    using Number = std::decay_t<decltype(To().r)>;
    const auto number = [](const auto& v) { return cast<Number>(v); };
    const auto& i = from.GetImaginary();
    return To(number(from.GetReal()), number(i[0]), number(i[1]), number(i[2]));
}

template <>
layer::QuatHalf cast(const GfQuath& q) {
    return cast_quaternion<layer::QuatHalf>(q);
}

template <>
layer::QuatFloat cast(const GfQuatf& q) {
    return cast_quaternion<layer::QuatFloat>(q);
}

template <>
layer::QuatDouble cast(const GfQuatd& q) {
    return cast_quaternion<layer::QuatDouble>(q);
}

template <>
std::string cast(const std::string& text) {
    return text;
}

template <>
layer::Token cast(const TfToken& token) {
    return layer::Token(token.GetString());
}

template <>
layer::AssetPath cast(const SdfAssetPath& path) {
    return {path.GetResolvedPath().empty() ? path.GetAssetPath() : path.GetResolvedPath()};
}

/// "point3f" instead of "float3", where the role has such a type.
std::string type_with_role(const std::string& type, const TfToken& role) {
    if (role.IsEmpty() || type.size() < 2) return type;
    const char width = type.back();
    const std::string number = type.substr(0, type.size() - 1);
    if (number != "float" && number != "double" && number != "half") return type;
    const std::string suffix = std::string(1, width) + number[0];
    if (role == HdPrimvarRoleTokens->textureCoordinate && width != '4') return "texCoord" + suffix;
    if (role == HdPrimvarRoleTokens->color && width != '2') return "color" + suffix;
    if (width != '3') return type;
    if (role == HdPrimvarRoleTokens->point) return "point" + suffix;
    if (role == HdPrimvarRoleTokens->normal) return "normal" + suffix;
    if (role == HdPrimvarRoleTokens->vector) return "vector" + suffix;
    return type;
}

template <class From, class To>
bool convert(const VtValue& value,
             const std::string& type,
             const TfToken& role,
             std::optional<TypedValue>& out) {
    if (value.IsHolding<From>()) {
        out = {type_with_role(type, role), layer::Value(cast<To>(value.UncheckedGet<From>()))};
        return true;
    }
    if (!value.IsHolding<VtArray<From>>()) return false;
    const VtArray<From>& from = value.UncheckedGet<VtArray<From>>();
    std::vector<To> to;
    to.reserve(from.size());
    for (const From& element : from) to.push_back(cast<To>(element));
    out = {type_with_role(type, role) + "[]", layer::Value::array(std::move(to))};
    return true;
}

}  // namespace

layer::Path to_path(const SdfPath& path) {
    std::string text = path.GetString();
    for (char& c : text) {
        const auto byte = static_cast<unsigned char>(c);
        if (c != '/' && byte < 0x80 && std::isalnum(byte) == 0) c = '_';
    }
    // A name cannot begin with a digit
    std::string names;
    for (size_t i = 0; i < text.size(); ++i) {
        names += text[i];
        const bool begins = text[i] == '/' && i + 1 < text.size();
        if (begins && std::isdigit(static_cast<unsigned char>(text[i + 1])) != 0) names += '_';
    }
    return layer::Path::from(names);
}

std::optional<TypedValue> to_value(const VtValue& value, const TfToken& role) {
    std::optional<TypedValue> out;
    (void)(convert<GfVec3f, layer::Vec3f>(value, "float3", role, out) ||
           convert<float, float>(value, "float", role, out) ||
           convert<int, int32_t>(value, "int", role, out) ||
           convert<GfVec2f, layer::Vec2f>(value, "float2", role, out) ||
           convert<GfVec4f, layer::Vec4f>(value, "float4", role, out) ||
           convert<TfToken, layer::Token>(value, "token", role, out) ||
           convert<std::string, std::string>(value, "string", role, out) ||
           convert<SdfAssetPath, layer::AssetPath>(value, "asset", role, out) ||
           convert<bool, bool>(value, "bool", role, out) ||
           convert<double, double>(value, "double", role, out) ||
           convert<GfMatrix4d, layer::Mat4d>(value, "matrix4d", role, out) ||
           convert<GfMatrix3d, layer::Mat3d>(value, "matrix3d", role, out) ||
           convert<GfMatrix2d, layer::Mat2d>(value, "matrix2d", role, out) ||
           convert<GfVec2d, layer::Vec2d>(value, "double2", role, out) ||
           convert<GfVec3d, layer::Vec3d>(value, "double3", role, out) ||
           convert<GfVec4d, layer::Vec4d>(value, "double4", role, out) ||
           convert<GfVec2i, layer::Vec2i>(value, "int2", role, out) ||
           convert<GfVec3i, layer::Vec3i>(value, "int3", role, out) ||
           convert<GfVec4i, layer::Vec4i>(value, "int4", role, out) ||
           convert<GfHalf, layer::Float16>(value, "half", role, out) ||
           convert<GfVec2h, layer::Vec2h>(value, "half2", role, out) ||
           convert<GfVec3h, layer::Vec3h>(value, "half3", role, out) ||
           convert<GfVec4h, layer::Vec4h>(value, "half4", role, out) ||
           convert<GfQuath, layer::QuatHalf>(value, "quath", role, out) ||
           convert<GfQuatf, layer::QuatFloat>(value, "quatf", role, out) ||
           convert<GfQuatd, layer::QuatDouble>(value, "quatd", role, out) ||
           convert<unsigned char, uint8_t>(value, "uchar", role, out) ||
           convert<unsigned int, uint32_t>(value, "uint", role, out) ||
           convert<int64_t, int64_t>(value, "int64", role, out) ||
           convert<uint64_t, uint64_t>(value, "uint64", role, out));
    return out;
}

}  // namespace velatura::hydra
