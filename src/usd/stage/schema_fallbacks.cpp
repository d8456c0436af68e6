// SPDX-License-Identifier: Apache-2.0
#include "usd/stage/schema_fallbacks.h"

#include "usd/layer/type_name.h"
#include "usd/stage/schema_tables.h"
#include "usd/stage/value_cast.h"

#include <charconv>
#include <string>
#include <unordered_map>
#include <vector>

namespace velatura::usd::stage {

using layer::Value;
using layer::ValueType;

namespace {

const std::unordered_map<std::string_view, const SchemaType*>& type_index() {
    static const auto index = [] {
        std::unordered_map<std::string_view, const SchemaType*> map;
        for (const SchemaType& type : schema_types()) map.emplace(type.name, &type);
        return map;
    }();
    return index;
}

const SchemaType* find_schema(std::string_view name) {
    const auto found = type_index().find(name);
    return found == type_index().end() ? nullptr : found->second;
}

using AttributeIndex = std::unordered_map<std::string, const SchemaAttribute*>;

const AttributeIndex& attribute_index() {
    static const auto index = [] {
        AttributeIndex map;
        for (const SchemaAttribute& a : schema_attributes()) {
            map.emplace(std::string(a.schema) + "." + std::string(a.name), &a);
        }
        return map;
    }();
    return index;
}

/// Every number in "(1, 2)" or "[(1, 2), (3, 4)]".
std::vector<double> numbers_in(std::string_view text) {
    std::vector<double> numbers;
    const char* at = text.data();
    const char* const end = at + text.size();
    while (at < end) {
        double v = 0.0;
        const auto parsed = std::from_chars(at, end, v);
        if (parsed.ec == std::errc()) numbers.push_back(v);
        at = parsed.ec == std::errc() ? parsed.ptr : at + 1;
    }
    return numbers;
}

/// Every double-quoted text in "[\"a\", \"b\"]".
std::vector<layer::Token> tokens_in(std::string_view text) {
    std::vector<layer::Token> tokens;
    for (size_t at = text.find('"'); at != std::string_view::npos;) {
        const size_t close = text.find('"', at + 1);
        tokens.emplace_back(text.substr(at + 1, close - at - 1));
        at = text.find('"', close + 1);
    }
    return tokens;
}

std::optional<Value> parse_tuple(std::string_view text, size_t count) {
    const std::vector<double> n = numbers_in(text);
    if (n.size() != count) return std::nullopt;
    if (count == 2) return Value(layer::Vec2d(n[0], n[1]));
    if (count == 3) return Value(layer::Vec3d(n[0], n[1], n[2]));
    if (count == 4) return Value(layer::Vec4d(n[0], n[1], n[2], n[3]));
    return std::nullopt;
}

template <class T>
std::optional<Value> as(const std::optional<Value>& value) {
    const auto cast = value ? value_cast<T>(*value) : std::nullopt;
    return cast ? std::optional<Value>(Value(*cast)) : std::nullopt;
}

std::optional<Value> empty_array(ValueType type) {
    switch (type) {
        case ValueType::Int:
            return Value::array(std::vector<int>());
        case ValueType::Int64:
            return Value::array(std::vector<int64_t>());
        case ValueType::Float:
            return Value::array(std::vector<float>());
        case ValueType::Float3:
            return Value::array(std::vector<layer::Vec3f>());
        case ValueType::Float4:
            return Value::array(std::vector<layer::Vec4f>());
        default:
            return std::nullopt;
    }
}

std::optional<Value> parse(const layer::TypeInfo& info, std::string_view text) {
    if (info.is_array) {
        if (info.type == ValueType::Token) return Value::array(tokens_in(text));
        if (text == "[]") return empty_array(info.type);
        if (info.type == ValueType::Float3 && info.columns == 3) {
            const std::vector<double> n = numbers_in(text);
            std::vector<layer::Vec3f> points;
            for (size_t i = 0; i + 2 < n.size(); i += 3) {
                points.emplace_back(float(n[i]), float(n[i + 1]), float(n[i + 2]));
            }
            return Value::array(std::move(points));
        }
        return std::nullopt;
    }
    switch (info.type) {
        case ValueType::Bool:
            return Value(text == "true" || text == "1");
        case ValueType::Int:
            return Value(int(numbers_in(text).at(0)));
        case ValueType::Float:
            return Value(float(numbers_in(text).at(0)));
        case ValueType::Double:
            return Value(numbers_in(text).at(0));
        case ValueType::TimeCode:
            return Value(layer::TimeCodeValue{numbers_in(text).at(0)});
        case ValueType::Token:
            return Value(tokens_in(text).at(0));
        case ValueType::String:
            return Value(tokens_in(text).at(0).str());
        case ValueType::Asset:
            return Value(layer::AssetPath{});
        case ValueType::Int2:
            return as<layer::Vec2i>(parse_tuple(text, 2));
        case ValueType::Float2:
            return as<layer::Vec2f>(parse_tuple(text, 2));
        case ValueType::Float3:
            return as<layer::Vec3f>(parse_tuple(text, 3));
        case ValueType::Float4:
            return as<layer::Vec4f>(parse_tuple(text, 4));
        case ValueType::Double3:
            return parse_tuple(text, 3);
        default:
            return std::nullopt;
    }
}

}  // namespace

std::string_view schema_base(std::string_view type) {
    const SchemaType* found = find_schema(type);
    return found ? found->base : std::string_view();
}

bool schema_is_a(std::string_view type, std::string_view base) {
    for (; !type.empty(); type = schema_base(type)) {
        if (type == base) return true;
    }
    return false;
}

std::span<const std::string_view> schema_builtin_apis(std::string_view type) {
    for (; !type.empty(); type = schema_base(type)) {
        const SchemaType* found = find_schema(type);
        if (found && !found->apis.empty()) return found->apis;
    }
    return {};
}

const SchemaAttribute* find_schema_attribute(std::string_view schema, std::string_view name) {
    for (; !schema.empty(); schema = schema_base(schema)) {
        const auto found = attribute_index().find(std::string(schema) + "." + std::string(name));
        if (found != attribute_index().end()) return found->second;
    }
    return nullptr;
}

std::optional<Value> schema_fallback(const SchemaAttribute& attribute) {
    if (attribute.fallback.empty()) return std::nullopt;
    const layer::TypeInfo* info = layer::find_type(attribute.type);
    return info ? parse(*info, attribute.fallback) : std::nullopt;
}

}  // namespace velatura::usd::stage
