// SPDX-License-Identifier: Apache-2.0
#include "usd/layer/type_name.h"

#include <string>
#include <unordered_map>
#include <vector>

namespace velatura::usd::layer {

namespace {

struct NamedType {
    const char* name;
    ValueType type;
    Role role;
};

using T = ValueType;

// Ref: AOUSD Core Specification 1.0.1, chapter 6 (data types)
constexpr NamedType modern_types[] = {
    {"bool", T::Bool, Role::None},
    {"uchar", T::UChar, Role::None},
    {"int", T::Int, Role::None},
    {"uint", T::UInt, Role::None},
    {"int64", T::Int64, Role::None},
    {"uint64", T::UInt64, Role::None},
    {"half", T::Half, Role::None},
    {"float", T::Float, Role::None},
    {"double", T::Double, Role::None},
    {"timecode", T::TimeCode, Role::None},
    {"string", T::String, Role::None},
    {"token", T::Token, Role::None},
    {"asset", T::Asset, Role::None},
    {"pathExpression", T::PathExpression, Role::None},
    {"opaque", T::Opaque, Role::None},
    {"group", T::Opaque, Role::Group},
    {"int2", T::Int2, Role::None},
    {"int3", T::Int3, Role::None},
    {"int4", T::Int4, Role::None},
    {"half2", T::Half2, Role::None},
    {"half3", T::Half3, Role::None},
    {"half4", T::Half4, Role::None},
    {"float2", T::Float2, Role::None},
    {"float3", T::Float3, Role::None},
    {"float4", T::Float4, Role::None},
    {"double2", T::Double2, Role::None},
    {"double3", T::Double3, Role::None},
    {"double4", T::Double4, Role::None},
    {"point3h", T::Half3, Role::Point},
    {"point3f", T::Float3, Role::Point},
    {"point3d", T::Double3, Role::Point},
    {"vector3h", T::Half3, Role::Vector},
    {"vector3f", T::Float3, Role::Vector},
    {"vector3d", T::Double3, Role::Vector},
    {"normal3h", T::Half3, Role::Normal},
    {"normal3f", T::Float3, Role::Normal},
    {"normal3d", T::Double3, Role::Normal},
    {"color3h", T::Half3, Role::Color},
    {"color3f", T::Float3, Role::Color},
    {"color3d", T::Double3, Role::Color},
    {"color4h", T::Half4, Role::Color},
    {"color4f", T::Float4, Role::Color},
    {"color4d", T::Double4, Role::Color},
    {"texCoord2h", T::Half2, Role::TexCoord},
    {"texCoord2f", T::Float2, Role::TexCoord},
    {"texCoord2d", T::Double2, Role::TexCoord},
    {"texCoord3h", T::Half3, Role::TexCoord},
    {"texCoord3f", T::Float3, Role::TexCoord},
    {"texCoord3d", T::Double3, Role::TexCoord},
    {"quath", T::Quath, Role::None},
    {"quatf", T::Quatf, Role::None},
    {"quatd", T::Quatd, Role::None},
    {"matrix2d", T::Matrix2d, Role::None},
    {"matrix3d", T::Matrix3d, Role::None},
    {"matrix4d", T::Matrix4d, Role::None},
    {"frame4d", T::Matrix4d, Role::Frame},
    // Older than USD, but with a meaning of their own, so they keep their names
    {"Transform", T::Matrix4d, Role::Transform},
    {"PointIndex", T::Int, Role::PointIndex},
    {"EdgeIndex", T::Int, Role::EdgeIndex},
    {"FaceIndex", T::Int, Role::FaceIndex},
};

struct LegacyName {
    const char* legacy;
    const char* modern;
};

// Names of value types in files older than USD: they read as the modern type
constexpr LegacyName legacy_names[] = {
    {"Vec2i", "int2"},         {"Vec3i", "int3"},           {"Vec4i", "int4"},
    {"Vec2h", "half2"},        {"Vec3h", "half3"},          {"Vec4h", "half4"},
    {"Vec2f", "float2"},       {"Vec3f", "float3"},         {"Vec4f", "float4"},
    {"Vec2d", "double2"},      {"Vec3d", "double3"},        {"Vec4d", "double4"},
    {"PointFloat", "point3f"}, {"Point", "point3d"},        {"NormalFloat", "normal3f"},
    {"Normal", "normal3d"},    {"VectorFloat", "vector3f"}, {"Vector", "vector3d"},
    {"ColorFloat", "color3f"}, {"Color", "color3d"},        {"Quath", "quath"},
    {"Quatf", "quatf"},        {"Quatd", "quatd"},          {"Matrix2d", "matrix2d"},
    {"Matrix3d", "matrix3d"},  {"Matrix4d", "matrix4d"},    {"Frame", "frame4d"},
};

class TypeTable {
  public:
    TypeTable() {
        for (const NamedType& named : modern_types) {
            add(named, false);
            if (named.type != T::Opaque) add(named, true);
        }
        for (const TypeInfo& info : types_) by_name_.emplace(info.name, &info);
        for (const LegacyName& l : legacy_names) {
            for (const char* suffix : {"", "[]"}) {
                const Token modern(std::string(l.modern) + suffix);
                by_name_.emplace(Token(std::string(l.legacy) + suffix), by_name_.at(modern));
            }
        }
    }

    const TypeInfo* find(Token name) const {
        const auto it = by_name_.find(name);
        return it == by_name_.end() ? nullptr : it->second;
    }

    std::span<const TypeInfo> all() const { return types_; }

  private:
    void add(const NamedType& named, bool is_array) {
        const TypeShape shape = shape_of(named.type);
        TypeInfo info;
        info.scalar_name = Token(named.name);
        info.name = is_array ? Token(std::string(named.name) + "[]") : info.scalar_name;
        info.type = named.type;
        info.role = named.role;
        info.is_array = is_array;
        info.rows = shape.rows;
        info.columns = shape.columns;
        types_.push_back(info);
    }

    std::vector<TypeInfo> types_;
    std::unordered_map<Token, const TypeInfo*> by_name_;
};

const TypeTable& type_table() {
    static const TypeTable* const table = new TypeTable;
    return *table;
}

}  // namespace

const TypeInfo* find_type(Token name) {
    return type_table().find(name);
}

const TypeInfo* find_type(std::string_view name) {
    return find_type(Token(name));
}

std::span<const TypeInfo> all_types() {
    return type_table().all();
}

std::string_view plain_type_name(const Value& value) {
    if (value.type() == ValueType::Dictionary) return "dictionary";
    if (!is_attribute_type(value.type())) return {};
    for (const TypeInfo& info : all_types()) {
        const bool is_plain = info.role == Role::None;
        if (is_plain && info.type == value.type() && info.is_array == value.is_array()) {
            return info.name.view();
        }
    }
    return {};
}

TypeShape shape_of(ValueType type) {
    switch (type) {
        case T::Int2:
        case T::Half2:
        case T::Float2:
        case T::Double2:
            return {1, 2};
        case T::Int3:
        case T::Half3:
        case T::Float3:
        case T::Double3:
            return {1, 3};
        case T::Int4:
        case T::Half4:
        case T::Float4:
        case T::Double4:
        case T::Quath:
        case T::Quatf:
        case T::Quatd:
            return {1, 4};
        case T::Matrix2d:
            return {2, 2};
        case T::Matrix3d:
            return {3, 3};
        case T::Matrix4d:
            return {4, 4};
        default:
            return {1, 1};
    }
}

}  // namespace velatura::usd::layer
