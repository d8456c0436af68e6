// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/layer/type_name.h"
#include "usd/layer/value.h"
#include "usd/text/scanner.h"

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace velatura::usd::text {

/// Nesting of the dictionaries and lists of one value beyond which a layer is refused.
inline constexpr int max_value_depth = 256;

/// Reads values. Functions return false after having reported what is wrong.
/// Ref: AOUSD Core Specification 1.0.1, 16.2.10 … 16.2.12 and 16.2.16.6.
class ValueParser {
  public:
    explicit ValueParser(Scanner& scanner) : s_(scanner) {}

    /// A value of a known type; None and AnimationBlock are not handled here.
    bool typed(const layer::TypeInfo& type, layer::Value& out);
    /// A value of no known type, as normalized text.
    bool untyped(std::string& out);
    /// { type key = value … }
    bool dictionary(layer::Dictionary& out);
    /// { "a": "b", … } as a dictionary of strings.
    bool string_dictionary(layer::Dictionary& out);
    /// "a" or ["a", "b"].
    bool names(std::vector<std::string>& out);

    /// '[' item, item, … ']' with `item` reading one; a line end may not stand before a comma.
    template <class Item>
    bool bracketed(char open, char close, const Item& item) {
        if (!s_.expect(open)) return false;
        s_.skip_lines();
        while (s_.peek() != close || s_.at_end()) {
            if (!item()) return false;
            s_.skip_inline();
            if (s_.accept(',')) {
                s_.skip_lines();
                continue;
            }
            s_.skip_lines();
            if (s_.peek() != close)
                return s_.fail(close == ']'   ? "',' or ']'"
                               : close == ')' ? "',' or ')'"
                                              : "',' or '}'");
        }
        return s_.expect(close);
    }

    /// Statements between brackets, apart by line ends or semicolons.
    template <class Statement>
    bool statements(char open, char close, const Statement& statement) {
        if (!s_.expect(open)) return false;
        s_.skip_lines();
        while (s_.peek() != close || s_.at_end()) {
            if (!statement()) return false;
            s_.skip_inline();
            if (s_.peek() == close && !s_.at_end()) break;
            if (!s_.accept(';') && (s_.at_end() || !s_.at_line_end())) {
                return s_.fail(close == ')' ? "';', ')' or the end of the line"
                                            : "';', '}' or the end of the line");
            }
            s_.skip_lines();
        }
        return s_.expect(close);
    }

    /// Counts one level of nesting; false, with an error, beyond max_value_depth.
    bool enter();

    void leave() { --depth_; }

    // Elements of typed values
    bool element(bool& out);
    bool element(uint8_t& out);
    bool element(int32_t& out);
    bool element(uint32_t& out);
    bool element(int64_t& out);
    bool element(uint64_t& out);
    bool element(layer::Float16& out);
    bool element(float& out);
    bool element(double& out);
    bool element(layer::TimeCodeValue& out);
    bool element(std::string& out);
    bool element(layer::Token& out);
    bool element(layer::AssetPath& out);
    bool element(layer::PathExpression& out);
    bool element(layer::OpaqueValue& out);

    template <class T>
    bool element(Imath::Vec2<T>& out) {
        return tuple(2, [&](size_t i) { return element(out[int(i)]); });
    }

    template <class T>
    bool element(Imath::Vec3<T>& out) {
        return tuple(3, [&](size_t i) { return element(out[int(i)]); });
    }

    template <class T>
    bool element(Imath::Vec4<T>& out) {
        return tuple(4, [&](size_t i) { return element(out[int(i)]); });
    }

    template <class T>
    bool element(Imath::Quat<T>& out) {
        return tuple(4, [&](size_t i) { return element(i == 0 ? out.r : out.v[int(i) - 1]); });
    }

    bool element(layer::Mat2d& out) { return matrix(out, 2); }

    bool element(layer::Mat3d& out) { return matrix(out, 3); }

    bool element(layer::Mat4d& out) { return matrix(out, 4); }

  private:
    template <class Component>
    bool tuple(size_t count, const Component& component) {
        if (!s_.accept('(')) return s_.fail("'('");
        for (size_t i = 0; i < count; ++i) {
            s_.skip_lines();
            if (!component(i)) return false;
            s_.skip_inline();
            const bool has_comma = s_.accept(',');
            if (!has_comma && i + 1 < count) return wrong_count(i + 1, count);
        }
        s_.skip_lines();
        return s_.accept(')') || wrong_count(count + 1, count);
    }

    template <class M>
    bool matrix(M& out, size_t n) {
        return tuple(n, [&](size_t row) {
            return tuple(n, [&](size_t column) { return element(out[int(row)][int(column)]); });
        });
    }

    template <class T>
    static bool scalar_of(ValueParser& parser, layer::Value& out);
    template <class T>
    static bool array_of(ValueParser& parser, layer::Value& out);
    template <size_t... I>
    bool dispatch(const layer::TypeInfo& type, layer::Value& out, std::index_sequence<I...>);

    template <class T>
    bool integer(T& out);
    bool wrong_count(size_t found, size_t expected);
    bool untyped_list(char open, char close, std::string& out);
    bool dictionary_entry(layer::Dictionary& out);

    Scanner& s_;
    int depth_ = 0;
};

}  // namespace velatura::usd::text
