// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/crate/value_context.h"
#include "usd/layer/types.h"
#include "usd/layer/value.h"

#include <cstdint>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace velatura::usd::crate {

class ValueReader;

template <class T>
concept Number = std::is_arithmetic_v<T>;

/// Reads the items that values at an offset are made of. What is wrong is left in the cursor.
/// Ref: AOUSD Core Specification 1.0.1, 16.3.10; what follows a value within a value, from OpenUSD.
class ItemReader {
  public:
    /// `values`: reads values within values.
    ItemReader(ValueContext& context, ValueReader& values) : context_(context), values_(values) {}

    template <Number T>
    void item(Cursor& c, T& out) {
        out = c.read<T>();
    }

    void item(Cursor& c, std::string& out);
    void item(Cursor& c, layer::Token& out);
    void item(Cursor& c, layer::Path& out);
    void item(Cursor& c, layer::LayerOffset& out);
    void item(Cursor& c, layer::Reference& out);
    void item(Cursor& c, layer::Payload& out);
    void item(Cursor& c, layer::UnregisteredValue& out);
    void item(Cursor& c, layer::Dictionary& out);
    void item(Cursor& c, layer::Value& out);

    template <class A, class B>
    void item(Cursor& c, std::pair<A, B>& out) {
        item(c, out.first);
        item(c, out.second);
    }

    /// A count and as many items.
    template <class T>
    void items(Cursor& c, std::vector<T>& out) {
        const uint64_t n = context_.count(c, min_stored<T>(), sizeof(T));
        out.reserve(n);
        for (uint64_t i = 0; i < n && c.ok(); ++i) {
            T value{};
            item(c, value);
            out.push_back(std::move(value));
        }
    }

  private:
    /// Bytes of a T in a file, at least.
    template <class T>
    static constexpr uint64_t min_stored() {
        if constexpr (std::is_same_v<T, layer::Reference>) return 32;
        if constexpr (std::is_same_v<T, layer::Payload>) return 8;
        if constexpr (std::is_same_v<T, layer::LayerOffset>) return 16;
        // Values begin with an offset, names and paths are indices
        if constexpr (std::is_same_v<T, layer::UnregisteredValue>) return 8;
        if constexpr (std::is_arithmetic_v<T>) return sizeof(T);
        return 4;
    }

    ValueContext& context_;
    ValueReader& values_;
};

}  // namespace velatura::usd::crate
