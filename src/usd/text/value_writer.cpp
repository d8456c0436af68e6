// SPDX-License-Identifier: Apache-2.0
#include "usd/text/value_writer.h"

#include "usd/text/number_text.h"
#include "usd/text/writer.h"

namespace velatura::usd::text {

namespace {

using layer::Value;
using layer::ValueType;

void append(std::string& out, bool v) {
    out += v ? '1' : '0';
}

void append(std::string& out, uint8_t v) {
    out += std::to_string(unsigned(v));
}

void append(std::string& out, int32_t v) {
    out += std::to_string(v);
}

void append(std::string& out, uint32_t v) {
    out += std::to_string(v);
}

void append(std::string& out, int64_t v) {
    out += std::to_string(v);
}

void append(std::string& out, uint64_t v) {
    out += std::to_string(v);
}

void append(std::string& out, layer::Float16 v) {
    append_number(out, float(v));
}

void append(std::string& out, float v) {
    append_number(out, v);
}

void append(std::string& out, double v) {
    append_number(out, v);
}

void append(std::string& out, const layer::TimeCodeValue& v) {
    append_number(out, v.value);
}

void append(std::string& out, const std::string& v) {
    append_quoted(out, v);
}

void append(std::string& out, const layer::Token& v) {
    append_quoted(out, v.view());
}

void append(std::string& out, const layer::AssetPath& v) {
    append_asset(out, v.path);
}

void append(std::string& out, const layer::PathExpression& v) {
    append_quoted(out, v.text);
}

void append(std::string&, const layer::OpaqueValue&) {}

template <class At>
void append_tuple(std::string& out, int count, const At& at) {
    out += '(';
    for (int i = 0; i < count; ++i) {
        if (i > 0) out += ", ";
        append(out, at(i));
    }
    out += ')';
}

template <class T>
void append(std::string& out, const Imath::Vec2<T>& v) {
    append_tuple(out, 2, [&](int i) { return v[i]; });
}

template <class T>
void append(std::string& out, const Imath::Vec3<T>& v) {
    append_tuple(out, 3, [&](int i) { return v[i]; });
}

template <class T>
void append(std::string& out, const Imath::Vec4<T>& v) {
    append_tuple(out, 4, [&](int i) { return v[i]; });
}

template <class T>
void append(std::string& out, const Imath::Quat<T>& q) {
    append_tuple(out, 4, [&](int i) { return i == 0 ? q.r : q.v[i - 1]; });
}

template <class M>
void append_matrix(std::string& out, const M& m, int n) {
    out += "( ";
    for (int row = 0; row < n; ++row) {
        if (row > 0) out += ", ";
        append_tuple(out, n, [&](int column) { return m[row][column]; });
    }
    out += " )";
}

void append(std::string& out, const layer::Mat2d& m) {
    append_matrix(out, m, 2);
}

void append(std::string& out, const layer::Mat3d& m) {
    append_matrix(out, m, 3);
}

void append(std::string& out, const layer::Mat4d& m) {
    append_matrix(out, m, 4);
}

template <class T>
void append_as(std::string& out, const Value& value) {
    if (!value.is_array()) {
        append(out, *value.get_if<T>());
        return;
    }
    out += '[';
    bool is_first = true;
    for (const T& item : value.as_array<T>()) {
        if (!is_first) out += ", ";
        is_first = false;
        append(out, item);
    }
    out += ']';
}

template <size_t... I>
void append_attribute_value(std::string& out, const Value& value, std::index_sequence<I...>) {
    using Writer = void (*)(std::string&, const Value&);
    static constexpr Writer writers[] = {
        &append_as<std::tuple_element_t<I, layer::ValueTypeList>>...};
    writers[size_t(value.type())](out, value);
}

}  // namespace

void append_value(std::string& out, const Value& value) {
    if (layer::is_attribute_type(value.type())) {
        append_attribute_value(out, value,
                               std::make_index_sequence<size_t(ValueType::Matrix4d) + 1>());
    } else if (const auto* path = value.get_if<layer::Path>()) {
        out += '<' + path->to_string() + '>';
    } else if (const auto* text = value.get_if<layer::UnregisteredValue>()) {
        out += text->text;
    } else if (const auto* permission = value.get_if<layer::Permission>()) {
        out += *permission == layer::Permission::Public ? "public" : "private";
    } else if (value.is_animation_block()) {
        out += "AnimationBlock";
    } else {
        out += "None";
    }
}

}  // namespace velatura::usd::text
