// SPDX-License-Identifier: Apache-2.0
#include "usd/text/value_parser.h"

#include "usd/text/number_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace velatura::usd::text {

namespace {

std::string lower_case(std::string_view text) {
    std::string result(text);
    for (char& c : result) {
        if (c >= 'A' && c <= 'Z') c = char(c - 'A' + 'a');
    }
    return result;
}

}  // namespace

bool ValueParser::enter() {
    if (depth_ >= max_value_depth) return s_.too_deep("nested values", max_value_depth);
    ++depth_;
    return true;
}

bool ValueParser::wrong_count(size_t found, size_t expected) {
    return s_.fail(found < expected
                       ? fmt::format("',' and {} more of {} items", expected - found, expected)
                       : fmt::format("')' after {} items", expected));
}

template <class T>
bool ValueParser::integer(T& out) {
    const SourceLoc where = s_.loc();
    int64_t plain = 0;
    Number n;
    if (s_.fast_integer(plain)) {
        if (std::in_range<T>(plain)) {
            out = T(plain);
            return true;
        }
        n.value = std::numeric_limits<double>::infinity();
    } else {
        if (!s_.at_number()) return s_.fail("an integer");
        if (!s_.number(n)) return false;
        if (n.is_integer) {
            constexpr auto largest = uint64_t(std::numeric_limits<T>::max());
            const uint64_t limit =
                n.is_negative ? (std::is_signed_v<T> ? largest + 1 : 0) : largest;
            if (n.magnitude <= limit) {
                out = n.is_negative ? T(0 - n.magnitude) : T(n.magnitude);
                return true;
            }
            n.value = std::numeric_limits<double>::infinity();
        }
    }
    // Compare as doubles: the bounds are powers of two or beyond 15 digits
    const bool fits = n.value == std::trunc(n.value) &&
                      n.value >= double(std::numeric_limits<T>::min()) &&
                      n.value < double(std::numeric_limits<T>::max()) + 1.0;
    if (!fits) {
        return s_.error(
            "usd-value", where,
            fmt::format("found a number that does not fit, expected an integer of {} to {}",
                        int64_t(std::numeric_limits<T>::min()),
                        uint64_t(std::numeric_limits<T>::max())));
    }
    out = T(n.value);
    return true;
}

bool ValueParser::element(bool& out) {
    const std::string word = lower_case(s_.peek_identifier());
    if (word == "true" || word == "yes" || word == "on") {
        out = true;
    } else if (word == "false" || word == "no" || word == "off") {
        out = false;
    } else {
        if (!s_.at_number()) return s_.fail("true or false");
        Number n;
        if (!s_.number(n)) return false;
        out = n.value != 0.0;
        return true;
    }
    s_.accept_identifier();
    return true;
}

bool ValueParser::element(uint8_t& out) {
    return integer(out);
}

bool ValueParser::element(int32_t& out) {
    return integer(out);
}

bool ValueParser::element(uint32_t& out) {
    return integer(out);
}

bool ValueParser::element(int64_t& out) {
    return integer(out);
}

bool ValueParser::element(uint64_t& out) {
    return integer(out);
}

bool ValueParser::element(double& out) {
    if (s_.fast_number(out)) return true;
    Number n;
    if (!s_.number(n)) return false;
    out = n.value;
    return true;
}

bool ValueParser::element(float& out) {
    double v = 0.0;
    if (!element(v)) return false;
    out = float(v);
    return true;
}

bool ValueParser::element(layer::Float16& out) {
    double v = 0.0;
    if (!element(v)) return false;
    out = layer::Float16(float(v));
    return true;
}

bool ValueParser::element(layer::TimeCodeValue& out) {
    return element(out.value);
}

bool ValueParser::element(std::string& out) {
    if (s_.peek() != '<') return s_.string(out);
    // Old files write tokens as paths
    const SourceLoc where = s_.loc();
    std::string_view path;
    if (!s_.path_text(path)) return false;
    out = path;
    s_.warn("usd-value", where,
            fmt::format("found path <{}>, expected a string; taking its text", path));
    return true;
}

bool ValueParser::element(layer::Token& out) {
    std::string text;
    if (!element(text)) return false;
    out = layer::Token(text);
    return true;
}

bool ValueParser::element(layer::AssetPath& out) {
    if (!s_.at_string()) return s_.asset(out.path);
    const SourceLoc where = s_.loc();
    if (!s_.string(out.path)) return false;
    if (std::any_of(out.path.begin(), out.path.end(), is_control))
        return s_.error(
            "usd-value", where,
            "found a control character in this string, expected an asset path without any");
    s_.warn("usd-value", where,
            fmt::format("found string \"{}\", expected @an asset path@", out.path));
    return true;
}

bool ValueParser::element(layer::PathExpression& out) {
    return s_.string(out.text);
}

bool ValueParser::element(layer::OpaqueValue&) {
    return s_.fail("no value: attributes of type opaque and group have none");
}

template <class T>
bool ValueParser::scalar_of(ValueParser& parser, layer::Value& out) {
    T value{};
    if (!parser.element(value)) return false;
    out = layer::Value(std::move(value));
    return true;
}

template <class T>
bool ValueParser::array_of(ValueParser& parser, layer::Value& out) {
    std::vector<T> items;
    // What the smallest block of memory holds
    constexpr size_t few = sizeof(T) < 24 ? 24 / sizeof(T) : 1;
    items.reserve(few);
    const bool ok = parser.bracketed('[', ']', [&] {
        T item{};
        if (!parser.element(item)) return false;
        items.push_back(std::move(item));
        return true;
    });
    if (!ok) return false;
    if (items.size() > few) items.shrink_to_fit();
    out = layer::Value::array<T>(std::move(items));
    return true;
}

template <size_t... I>
bool ValueParser::dispatch(const layer::TypeInfo& type,
                           layer::Value& out,
                           std::index_sequence<I...>) {
    using Reader = bool (*)(ValueParser&, layer::Value&);
    static constexpr Reader scalars[] = {
        &scalar_of<std::tuple_element_t<I, layer::ValueTypeList>>...};
    static constexpr Reader arrays[] = {
        &array_of<std::tuple_element_t<I, layer::ValueTypeList>>...};
    return (type.is_array ? arrays : scalars)[size_t(type.type)](*this, out);
}

bool ValueParser::typed(const layer::TypeInfo& type, layer::Value& out) {
    constexpr size_t count = size_t(layer::ValueType::Matrix4d) + 1;
    return dispatch(type, out, std::make_index_sequence<count>());
}

bool ValueParser::untyped_list(char open, char close, std::string& out) {
    if (!enter()) return false;
    out += open;
    bool is_first = true;
    const bool ok = bracketed(open, close, [&] {
        if (!is_first) out += ", ";
        is_first = false;
        return untyped(out);
    });
    out += close;
    leave();
    return ok;
}

bool ValueParser::untyped(std::string& out) {
    if (s_.peek() == '[') return untyped_list('[', ']', out);
    if (s_.peek() == '(') return untyped_list('(', ')', out);
    if (s_.at_string()) {
        std::string text;
        if (!s_.string(text)) return false;
        append_quoted(out, text);
        return true;
    }
    if (s_.peek() == '@') {
        std::string path;
        if (!s_.asset(path)) return false;
        append_asset(out, path);
        return true;
    }
    if (s_.peek() == '<') {
        std::string_view path;
        if (!s_.path_text(path)) return false;
        out.append("<").append(path).append(">");
        return true;
    }
    if (s_.at_number()) {
        Number n;
        if (!s_.number(n)) return false;
        if (n.is_integer) {
            out += fmt::format("{}{}", n.is_negative ? "-" : "", n.magnitude);
        } else {
            append_number(out, n.value);
        }
        return true;
    }
    std::string word;
    if (s_.peek_identifier().empty()) return s_.fail("a value");
    if (!s_.type_identifier(word)) return false;
    out += word;
    return true;
}

bool ValueParser::dictionary_entry(layer::Dictionary& out) {
    const SourceLoc type_loc = s_.loc();
    std::string type_name;
    if (!s_.type_identifier(type_name)) return false;
    s_.skip_inline();
    if (s_.accept('[')) {
        s_.skip_inline();
        if (!s_.expect(']')) return false;
        type_name += "[]";
        s_.skip_inline();
    }
    std::string key;
    if (s_.at_string()) {
        if (!s_.string(key)) return false;
    } else {
        key = s_.accept_identifier();
        if (key.empty()) return s_.fail("a key");
    }
    s_.skip_inline();
    if (!s_.expect('=')) return false;
    s_.skip_inline();
    layer::Value value;
    if (type_name == "dictionary") {
        layer::Dictionary inner;
        if (!dictionary(inner)) return false;
        value = layer::Value(std::move(inner));
    } else if (s_.accept_word("None")) {
        value = layer::Value::block();
    } else if (const layer::TypeInfo* type = layer::find_type(type_name)) {
        if (!typed(*type, value)) return false;
    } else {
        s_.warn(
            "usd-unknown-type", type_loc,
            fmt::format("found unknown type '{}', expected a value type; its value is kept as text",
                        type_name));
        layer::UnregisteredValue text;
        if (!untyped(text.text)) return false;
        value = layer::Value(std::move(text));
    }
    out.entries[key] = std::move(value);
    return true;
}

bool ValueParser::dictionary(layer::Dictionary& out) {
    if (!enter()) return false;
    const bool ok = statements('{', '}', [&] { return dictionary_entry(out); });
    leave();
    return ok;
}

bool ValueParser::string_dictionary(layer::Dictionary& out) {
    return bracketed('{', '}', [&] {
        std::string key;
        std::string value;
        if (!s_.string(key)) return false;
        s_.skip_inline();
        if (!s_.expect(':')) return false;
        s_.skip_inline();
        if (!s_.string(value)) return false;
        out.entries[key] = layer::Value(std::move(value));
        return true;
    });
}

bool ValueParser::names(std::vector<std::string>& out) {
    std::string name;
    if (s_.at_string()) {
        if (!s_.string(name)) return false;
        out.push_back(name);
        return true;
    }
    return bracketed('[', ']', [&] {
        if (!s_.string(name)) return false;
        out.push_back(name);
        return true;
    });
}

}  // namespace velatura::usd::text
