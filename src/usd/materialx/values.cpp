// SPDX-License-Identifier: Apache-2.0
#include "usd/materialx/values.h"

#include <array>
#include <cctype>
#include <charconv>
#include <utility>
#include <vector>

namespace velatura::usd::materialx {

namespace {

using layer::Value;

constexpr std::pair<std::string_view, std::string_view> types[] = {
    {"boolean", "bool"},          {"integer", "int"},           {"float", "float"},
    {"color3", "color3f"},        {"color4", "color4f"},        {"vector2", "float2"},
    {"vector3", "float3"},        {"vector4", "float4"},        {"matrix33", "matrix3d"},
    {"matrix44", "matrix4d"},     {"string", "string"},         {"filename", "asset"},
    {"integerarray", "int[]"},    {"floatarray", "float[]"},    {"stringarray", "string[]"},
    {"color3array", "color3f[]"}, {"color4array", "color4f[]"}, {"vector2array", "float2[]"},
    {"vector3array", "float3[]"}, {"vector4array", "float4[]"}};

bool is_separator(char c) {
    return c == ',' || c == ';' || std::isspace(static_cast<unsigned char>(c)) != 0;
}

/// Numbers apart by commas or spaces; nullopt when something else is among them.
template <class T>
std::optional<std::vector<T>> parse_numbers(std::string_view text) {
    std::vector<T> numbers;
    const char* at = text.data();
    const char* const end = at + text.size();
    while (true) {
        while (at != end && is_separator(*at)) ++at;
        if (at == end) return numbers;
        if (*at == '+') ++at;
        T number = 0;
        const auto [next, error] = std::from_chars(at, end, number);
        if (error != std::errc() || (next != end && !is_separator(*next))) return std::nullopt;
        numbers.push_back(number);
        at = next;
    }
}

template <class T>
std::optional<T> parse_one(std::string_view text) {
    const auto numbers = parse_numbers<T>(text);
    if (!numbers || numbers->size() != 1) return std::nullopt;
    return numbers->front();
}

template <class Matrix>
std::optional<Value> matrix_value(const std::vector<double>& numbers, size_t side) {
    if (numbers.size() != side * side) return std::nullopt;
    Matrix m;
    for (size_t i = 0; i < side; ++i)
        for (size_t j = 0; j < side; ++j) m[int(i)][int(j)] = numbers[i * side + j];
    return Value(m);
}

std::optional<Value> parse_tuple(std::string_view type, std::string_view text) {
    const auto numbers = parse_numbers<float>(text);
    if (!numbers) return std::nullopt;
    const std::vector<float>& n = *numbers;
    const char last = type.back();
    if (size_t(last - '0') != n.size()) return std::nullopt;
    if (last == '2') return Value(layer::Vec2f(n[0], n[1]));
    if (last == '3') return Value(layer::Vec3f(n[0], n[1], n[2]));
    return Value(layer::Vec4f(n[0], n[1], n[2], n[3]));
}

}  // namespace

std::string_view usd_type(std::string_view type) {
    for (const auto& [ours, theirs] : types) {
        if (ours == type) return theirs;
    }
    return "token";
}

std::optional<Value> parse_value(std::string_view type, std::string_view text) {
    if (type == "string") return Value(std::string(text));
    if (type == "filename") return Value(layer::AssetPath{std::string(text)});
    if (type == "boolean") {
        if (text == "true" || text == "True" || text == "1") return Value(true);
        if (text == "false" || text == "False" || text == "0") return Value(false);
        return std::nullopt;
    }
    if (type == "integer") {
        const auto number = parse_one<int32_t>(text);
        return number ? std::optional(Value(*number)) : std::nullopt;
    }
    if (type == "float") {
        const auto number = parse_one<float>(text);
        return number ? std::optional(Value(*number)) : std::nullopt;
    }
    if (type == "matrix33" || type == "matrix44") {
        const auto numbers = parse_numbers<double>(text);
        if (!numbers) return std::nullopt;
        return type == "matrix33" ? matrix_value<layer::Mat3d>(*numbers, 3)
                                  : matrix_value<layer::Mat4d>(*numbers, 4);
    }
    const bool is_tuple = type == "color3" || type == "color4" || type == "vector2" ||
                          type == "vector3" || type == "vector4";
    return is_tuple ? parse_tuple(type, text) : std::nullopt;
}

std::string usd_name(std::string_view name) {
    std::string out;
    for (const char c : name) {
        if (c == ':') {
            out += "__";
        } else {
            const bool is_plain = std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_';
            out += is_plain ? c : '_';
        }
    }
    if (out.empty() || std::isdigit(static_cast<unsigned char>(out.front())) != 0) out = "_" + out;
    return out;
}

}  // namespace velatura::usd::materialx
