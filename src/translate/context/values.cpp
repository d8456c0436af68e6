// SPDX-License-Identifier: Apache-2.0
#include "translate/context/values.h"

#include "usd/stage/xform.h"

#include <algorithm>
#include <cmath>
#include <span>

namespace velatura::translate {
inline namespace context {

namespace {

namespace layer = usd::layer;
using layer::Value;

template <class Out, class T>
void append(std::vector<Out>& rows, const T& v) {
    if constexpr (std::is_arithmetic_v<T> || std::is_same_v<T, layer::Float16>) {
        rows.push_back(static_cast<Out>(v));
    } else if constexpr (requires { v.r; }) {
        rows.push_back(static_cast<Out>(v.v.x));
        rows.push_back(static_cast<Out>(v.v.y));
        rows.push_back(static_cast<Out>(v.v.z));
        rows.push_back(static_cast<Out>(v.r));
    } else {
        for (unsigned i = 0; i < T::dimensions(); ++i) rows.push_back(static_cast<Out>(v[int(i)]));
    }
}

template <class T>
int width_of() {
    if constexpr (std::is_arithmetic_v<T> || std::is_same_v<T, layer::Float16>) {
        return 1;
    } else if constexpr (requires(T v) { v.r; }) {
        return 4;
    } else {
        return int(T::dimensions());
    }
}

template <class T, class Out>
bool read_as(const Value& value, std::vector<Out>& rows, int& width) {
    if (const T* scalar = value.get_if<T>()) {
        width = width_of<T>();
        append(rows, *scalar);
        return true;
    }
    if (!value.holds_array<T>()) return false;
    width = width_of<T>();
    const std::span<const T> elements = value.as_array<T>();
    rows.reserve(elements.size() * size_t(width));
    for (const T& element : elements) append(rows, element);
    return true;
}

template <class Out, class... T>
bool read_as_any(const Value& value, std::vector<Out>& rows, int& width) {
    rows.clear();
    return (read_as<T>(value, rows, width) || ...);
}

template <class Out>
bool read_rows_as(const Value& value, std::vector<Out>& rows, int& width) {
    return read_as_any<Out, layer::Vec3f, layer::Vec2f, float, double, int32_t, layer::Vec3d,
                       layer::Vec4f, layer::Vec4d, layer::Vec2d, layer::Float16, layer::Vec2h,
                       layer::Vec3h, layer::Vec4h, bool, uint8_t, uint32_t, int64_t, uint64_t,
                       layer::Vec2i, layer::Vec3i, layer::Vec4i, layer::QuatHalf, layer::QuatFloat,
                       layer::QuatDouble>(value, rows, width);
}

std::optional<std::string> text_of(const Value& value) {
    if (const auto* s = value.get_if<std::string>()) return *s;
    if (const auto* t = value.get_if<layer::Token>()) return t->str();
    if (const auto* a = value.get_if<layer::AssetPath>()) return a->path;
    return std::nullopt;
}

}  // namespace

bool read_rows(const Value& value, std::vector<float>& rows, int& width) {
    return read_rows_as(value, rows, width);
}

bool read_rows(const Value& value, std::vector<double>& rows, int& width) {
    return read_rows_as(value, rows, width);
}

double read_number(const usd::stage::Attribute& attribute,
                   double otherwise,
                   usd::stage::TimeCode time) {
    std::vector<double> rows;
    int width = 0;
    const Value value = attribute.value(time);
    if (const auto* t = value.get_if<layer::TimeCodeValue>()) return t->value;
    if (!read_rows(value, rows, width) || rows.empty()) return otherwise;
    return rows[0];
}

int read_int(const usd::stage::Attribute& attribute, int otherwise, usd::stage::TimeCode time) {
    const double v = read_number(attribute, otherwise, time);
    return std::abs(v) < 2147483648.0 ? int(v) : otherwise;
}

bool read_bool(const usd::stage::Attribute& attribute, bool otherwise, usd::stage::TimeCode time) {
    return read_number(attribute, otherwise ? 1.0 : 0.0, time) != 0.0;
}

std::optional<std::vector<double>> read_vector(const usd::stage::Attribute& attribute,
                                               int width,
                                               usd::stage::TimeCode time) {
    std::vector<double> rows;
    int found = 0;
    const Value value = attribute.value(time);
    if (!read_rows(value, rows, found) || found != width || rows.size() < size_t(width))
        return std::nullopt;
    rows.resize(size_t(width));
    return rows;
}

std::string read_text(const usd::stage::Attribute& attribute,
                      std::string_view otherwise,
                      usd::stage::TimeCode time) {
    return text_of(attribute.value(time)).value_or(std::string(otherwise));
}

std::vector<std::string> read_texts(const usd::stage::Attribute& attribute,
                                    usd::stage::TimeCode time) {
    const Value value = attribute.value(time);
    std::vector<std::string> out;
    for (const layer::Token& t : value.as_array<layer::Token>()) out.push_back(t.str());
    for (const std::string& s : value.as_array<std::string>()) out.push_back(s);
    return out;
}

std::vector<int64_t> read_ints(const Value& value) {
    std::vector<int64_t> out;
    const auto copy = [&](auto elements) { out.assign(elements.begin(), elements.end()); };
    if (value.holds_array<int32_t>()) copy(value.as_array<int32_t>());
    if (value.holds_array<int64_t>()) copy(value.as_array<int64_t>());
    if (value.holds_array<uint32_t>()) copy(value.as_array<uint32_t>());
    return out;
}

bool is_finite(const Vec3d& v) {
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

bool keeps_a_surface(const Mat4d& m) {
    const Mat3d cofactors = cofactor_matrix(m);
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            if (cofactors[i][j] != 0.0) return true;
    return false;
}

Mat4 to_float(const Mat4d& m) {
    Mat4 out;
    for (int i = 0; i < 4; ++i)
        for (int j = 0; j < 4; ++j) out[i][j] = float(m[i][j]);
    return out;
}

}  // namespace context
}  // namespace velatura::translate
