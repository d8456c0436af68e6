// SPDX-License-Identifier: Apache-2.0
#include "usd/crate/scalar_reader.h"

#include "usd/crate/stored.h"

#include <fmt/format.h>

#include <bit>
#include <cstring>
#include <type_traits>

namespace velatura::usd::crate {

namespace {

/// Component i of the up to four small integers that a vector or diagonal is inlined as.
int8_t small(uint32_t inlined, int i) {
    return int8_t(uint8_t(inlined >> (8 * i)));
}

template <class T>
inline constexpr bool is_matrix =
    std::is_same_v<T, layer::Mat2d> || std::is_same_v<T, layer::Mat3d> ||
    std::is_same_v<T, layer::Mat4d>;

/// Types of up to 32 bits are always inlined, whatever the flag says.
template <class T>
inline constexpr bool is_always_inlined = std::is_same_v<T, bool> ||
                                          std::is_same_v<T, std::string> ||
                                          std::is_same_v<T, layer::Token> ||
                                          std::is_same_v<T, layer::AssetPath> ||
                                          (is_stored_plain<T> && sizeof(T) <= sizeof(uint32_t));

template <class T>
T from_inlined(uint32_t bits) {
    if constexpr (std::is_same_v<T, bool>) {
        return (bits & 0xff) != 0;
    } else if constexpr (is_always_inlined<T>) {
        T value;
        std::memcpy(static_cast<void*>(&value), &bits, sizeof(T));
        return value;
    } else if constexpr (std::is_same_v<T, int64_t>) {
        return int64_t(int32_t(bits));
    } else if constexpr (std::is_same_v<T, uint64_t>) {
        return bits;
    } else if constexpr (std::is_same_v<T, double>) {
        return double(std::bit_cast<float>(bits));
    } else if constexpr (std::is_same_v<T, layer::TimeCodeValue>) {
        return {double(std::bit_cast<float>(bits))};
    } else if constexpr (is_matrix<T>) {
        T m;
        constexpr int n = sizeof(T) == 32 ? 2 : sizeof(T) == 72 ? 3 : 4;
        m.makeIdentity();
        for (int i = 0; i < n; ++i) m[i][i] = double(small(bits, i));
        return m;
    } else if constexpr (is_quaternion<T>) {
        return T();
    } else {
        T v;
        using Part = std::remove_cvref_t<decltype(v[0])>;
        constexpr int n = int(sizeof(T) / sizeof(Part));
        for (int i = 0; i < n; ++i) v[i] = Part(small(bits, i));
        return v;
    }
}

}  // namespace

template <class T>
bool ScalarReader::read_scalar(ValueRep rep, layer::Value& out) {
    if constexpr (is_text<T>) {
        uint32_t index = rep.inlined();
        // Inlined asset paths are tokens, those in arrays strings
        bool is_token = std::is_same_v<T, layer::AssetPath>;
        if constexpr (std::is_same_v<T, layer::PathExpression>) {
            is_token = rep.is_inlined();
            if (!is_token) {
                Cursor c(context_.file->bytes(), rep.payload());
                index = c.read<uint32_t>();
                if (!c.ok()) return context_.fail(c);
            }
        }
        T value{};
        uint64_t copied = 0;
        if (is_token && index < context_.file->tokens.size()) {
            const std::string& text = context_.file->tokens[index].str();
            copied = text.size();
            if constexpr (std::is_same_v<T, layer::AssetPath>) value.path = text;
            if constexpr (std::is_same_v<T, layer::PathExpression>) value.text = text;
        } else if (is_token || !load_text(*context_.file, index, value, copied)) {
            return context_.fail(
                rep.payload(),
                fmt::format("found text {}, expected one of {} tokens and {} strings", index,
                            context_.file->tokens.size(), context_.file->strings.size()));
        }
        Cursor c(context_.file->bytes());
        if (!context_.spend(c, copied)) return context_.fail(c);
        out = layer::Value(std::move(value));
        return true;
    } else {
        if (is_always_inlined<T> || rep.is_inlined()) {
            out = layer::Value(from_inlined<T>(rep.inlined()));
            return true;
        }
        Cursor c(context_.file->bytes(), rep.payload());
        const std::string_view raw = c.take(sizeof(T));
        if (!c.ok()) return context_.fail(c);
        out = layer::Value(load_element<T>(raw.data()));
        return true;
    }
}

bool ScalarReader::read_enumeration(ValueRep rep, layer::Value& out) {
    const uint32_t n = rep.inlined();
    if (rep.type() == TypeId::Specifier && n <= uint32_t(layer::Specifier::Class)) {
        out = layer::Value(layer::Specifier(n));
        return true;
    }
    if (rep.type() == TypeId::Permission && n <= uint32_t(layer::Permission::Private)) {
        out = layer::Value(layer::Permission(n));
        return true;
    }
    // 2 is "config" of old files, which means uniform
    if (rep.type() == TypeId::Variability && n <= 2) {
        out = layer::Value(n == 0 ? layer::Variability::Varying : layer::Variability::Uniform);
        return true;
    }
    return context_.fail(0, fmt::format("found {} for an enumeration of type {}, expected less", n,
                                        int(rep.type())));
}

bool ScalarReader::read(ValueRep rep, layer::Value& out, bool& is_scalar) {
    bool ok = false;
    is_scalar =
        visit_attribute_type(rep.type(), [&]<class T>(const T*) { ok = read_scalar<T>(rep, out); });
    if (is_scalar) return ok;
    is_scalar = true;
    switch (rep.type()) {
        case TypeId::Specifier:
        case TypeId::Permission:
        case TypeId::Variability:
            return read_enumeration(rep, out);
        case TypeId::ValueBlock:
            out = layer::Value::block();
            return true;
        case TypeId::AnimationBlock:
            out = layer::Value::animation_block();
            return true;
        case TypeId::Dictionary:
            if (!rep.is_inlined()) break;
            out = layer::Value(layer::Dictionary());
            return true;
        default:
            break;
    }
    is_scalar = false;
    return false;
}

}  // namespace velatura::usd::crate
