// SPDX-License-Identifier: Apache-2.0
// Values that attributes may have: scalars and arrays.
#include "usd/crate/append.h"
#include "usd/crate/coding.h"
#include "usd/crate/packer.h"
#include "usd/crate/stored.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>

namespace velatura::usd::crate {

using layer::Token;
using layer::Value;
using layer::ValueType;

namespace {

/// A number as a small integer, when it is one; minus zero is none.
template <class Int, class T>
std::optional<Int> as_integer(T value) {
    const double d = double(value);
    if (!(d >= double(std::numeric_limits<Int>::min()) &&
          d <= double(std::numeric_limits<Int>::max()))) {
        return std::nullopt;
    }
    const Int i = Int(d);
    if (double(i) != d || (i == 0 && std::signbit(d))) return std::nullopt;
    return i;
}

template <class M>
std::optional<uint32_t> inline_matrix(const M& m, int n) {
    uint32_t bits = 0;
    for (int row = 0; row < n; ++row) {
        for (int column = 0; column < n; ++column) {
            const auto part = as_integer<int8_t>(m[row][column]);
            if (!part || (row != column && *part != 0)) return std::nullopt;
            if (row == column) bits |= uint32_t(uint8_t(*part)) << (8 * row);
        }
    }
    return bits;
}

/// The 32 bits a value can be inlined as.
template <class T>
std::optional<uint32_t> inline_bits(const T& value) {
    if constexpr (std::is_same_v<T, bool>) {
        return value ? 1 : 0;
    } else if constexpr (std::is_same_v<T, double>) {
        const float f = float(value);
        // Out of range and no number lie in the file
        if (!std::isfinite(f) || double(f) != value) return std::nullopt;
        return std::bit_cast<uint32_t>(f);
    } else if constexpr (std::is_same_v<T, int64_t>) {
        if (value != int64_t(int32_t(value))) return std::nullopt;
        return uint32_t(int32_t(value));
    } else if constexpr (std::is_same_v<T, uint64_t>) {
        if (value != uint64_t(uint32_t(value))) return std::nullopt;
        return uint32_t(value);
    } else if constexpr (std::is_same_v<T, layer::Mat2d>) {
        return inline_matrix(value, 2);
    } else if constexpr (std::is_same_v<T, layer::Mat3d>) {
        return inline_matrix(value, 3);
    } else if constexpr (std::is_same_v<T, layer::Mat4d>) {
        return inline_matrix(value, 4);
    } else if constexpr (is_stored_plain<T> && sizeof(T) <= sizeof(uint32_t)) {
        uint32_t bits = 0;
        std::memcpy(&bits, &value, sizeof value);
        return bits;
    } else if constexpr (std::is_same_v<T, layer::TimeCodeValue> || is_quaternion<T> ||
                         is_text<T>) {
        return std::nullopt;
    } else {
        uint32_t bits = 0;
        constexpr int n = int(sizeof(T) / sizeof(value[0]));
        for (int i = 0; i < n; ++i) {
            const auto part = as_integer<int8_t>(value[i]);
            if (!part) return std::nullopt;
            bits |= uint32_t(uint8_t(*part)) << (8 * i);
        }
        return bits;
    }
}

/// The stored form of an element that is no text.
template <class T>
void append_element(std::string& bytes, const T& value) {
    if constexpr (std::is_same_v<T, bool>) {
        bytes += value ? '\1' : '\0';
    } else if constexpr (is_quaternion<T>) {
        for (int i = 0; i < 3; ++i) append(bytes, value.v[i]);
        append(bytes, value.r);
    } else {
        append(bytes, value);
    }
}

/// Codes of distinct values and the values; nothing when there are too many to pay.
template <class T>
bool make_table(std::span<const T> elements, std::vector<T>& table, std::vector<int32_t>& codes) {
    // By their bits, so that minus zero and all that is no number come back as they are
    using Bits = std::conditional_t<sizeof(T) == 2, uint16_t,
                                    std::conditional_t<sizeof(T) == 4, uint32_t, uint64_t>>;
    const size_t max_table = std::min<size_t>(elements.size() / 4, 1024);
    std::unordered_map<Bits, int32_t> known;
    codes.reserve(elements.size());
    for (const T& e : elements) {
        Bits bits;
        std::memcpy(&bits, &e, sizeof bits);
        const auto [it, is_new] = known.emplace(bits, int32_t(table.size()));
        if (is_new) {
            if (table.size() == max_table) return false;
            table.push_back(e);
        }
        codes.push_back(it->second);
    }
    return true;
}

void append_integers(std::string& bytes, std::span<const int32_t> integers) {
    std::string coded;
    encode_integers(integers, coded);
    append(bytes, uint64_t(coded.size()));
    bytes += coded;
}

}  // namespace

template <class T>
bool Packer::pack_scalar(const T& value, ValueRep& out) {
    constexpr TypeId type = type_id_of<T>;
    if constexpr (std::is_same_v<T, std::string>) {
        out = ValueRep::make(type, string(value), ValueRep::inlined_bit);
    } else if constexpr (std::is_same_v<T, Token>) {
        out = ValueRep::make(type, token(value), ValueRep::inlined_bit);
    } else if constexpr (std::is_same_v<T, layer::AssetPath>) {
        out = ValueRep::make(type, token(Token(value.path)), ValueRep::inlined_bit);
    } else {
        if (const auto bits = inline_bits(value)) {
            out = ValueRep::make(type, *bits, ValueRep::inlined_bit);
            return true;
        }
        std::string bytes;
        if constexpr (std::is_same_v<T, layer::PathExpression>) {
            need({0, 10, 0});
            append(bytes, string(value.text));
        } else {
            if constexpr (std::is_same_v<T, layer::TimeCodeValue>) need({0, 9, 0});
            append_element(bytes, value);
        }
        out = store(type, bytes);
    }
    return true;
}

template <class T>
bool Packer::compress_array(std::span<const T> elements, std::string& bytes) const {
    if (elements.size() < min_compressed_array) return false;
    if constexpr (is_integer_of_arrays<T>) {
        if (version_ < Version{0, 5, 0}) return false;
        using Signed = std::make_signed_t<T>;
        std::string coded;
        encode_integers(
            std::span(reinterpret_cast<const Signed*>(elements.data()), elements.size()), coded);
        append(bytes, uint64_t(coded.size()));
        bytes += coded;
        return true;
    } else if constexpr (is_float_of_arrays<T>) {
        if (version_ < Version{0, 6, 0}) return false;
        std::vector<int32_t> codes;
        for (const T& e : elements) {
            const auto code = as_integer<int32_t>(e);
            if (!code) break;
            codes.push_back(*code);
        }
        if (codes.size() == elements.size()) {
            bytes += 'i';
            append_integers(bytes, codes);
            return true;
        }
        codes.clear();
        std::vector<T> table;
        if (!make_table(elements, table, codes)) return false;
        bytes += 't';
        append(bytes, uint32_t(table.size()));
        for (const T& e : table) append(bytes, e);
        append_integers(bytes, codes);
        return true;
    }
    return false;
}

template <class T>
bool Packer::pack_array(std::span<const T> elements, ValueRep& out) {
    constexpr TypeId type = type_id_of<T>;
    if (std::is_same_v<T, layer::TimeCodeValue>) need({0, 9, 0});
    if (std::is_same_v<T, layer::PathExpression>) need({0, 10, 0});
    if (elements.empty()) {
        out = ValueRep::make(type, 0, ValueRep::array_bit);
        return true;
    }
    std::string bytes;
    if (version_ < Version{0, 5, 0}) append(bytes, uint32_t(1));
    if (version_ < Version{0, 7, 0}) {
        if (elements.size() > std::numeric_limits<uint32_t>::max()) need({0, 7, 0});
        append(bytes, uint32_t(elements.size()));
    } else {
        append(bytes, uint64_t(elements.size()));
    }
    if (compress_array(elements, bytes)) {
        out = store(type, bytes, ValueRep::array_bit | ValueRep::compressed_bit);
        return true;
    }
    if constexpr (is_stored_plain<T>) {
        bytes.append(reinterpret_cast<const char*>(elements.data()), elements.size_bytes());
    } else {
        bytes.reserve(bytes.size() + elements.size() * stored_size<T>());
        for (const T& e : elements) {
            if constexpr (std::is_same_v<T, Token>) {
                append(bytes, token(e));
            } else if constexpr (std::is_same_v<T, std::string>) {
                append(bytes, string(e));
            } else if constexpr (std::is_same_v<T, layer::AssetPath>) {
                append(bytes, string(e.path));
            } else if constexpr (std::is_same_v<T, layer::PathExpression>) {
                append(bytes, string(e.text));
            } else {
                append_element(bytes, e);
            }
        }
    }
    out = store(type, bytes, ValueRep::array_bit, true);
    return true;
}

bool Packer::pack(const Value& value, ValueRep& out) {
    if (!layer::is_attribute_type(value.type())) return pack_field_type(value, out);
    bool is_packed = false;
    const auto pack_as = [&]<class T>(const T*) {
        if (layer::value_type_of<T> != value.type()) return;
        if constexpr (type_id_of<T> != TypeId::Invalid) {
            is_packed = value.is_array() ? pack_array<T>(value.as_array<T>(), out)
                                         : pack_scalar<T>(*value.get_if<T>(), out);
        }
    };
    constexpr size_t count = size_t(ValueType::Matrix4d) + 1;
    [&]<size_t... I>(std::index_sequence<I...>) {
        (pack_as(static_cast<const std::tuple_element_t<I, layer::ValueTypeList>*>(nullptr)), ...);
    }
    (std::make_index_sequence<count>());
    return is_packed;
}

}  // namespace velatura::usd::crate
