// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/check.h"

#include <string>
#include <utility>
#include <variant>

namespace velatura {

/// Why no value could be made. `message` follows the rules of Diagnostic::message.
struct Error {
    std::string code;
    std::string message;
};

/// A value, or the reason there is none; the member names of std::expected, which GCC 12 lacks in
/// C++20. Use it only where no value can exist (a file that cannot be opened); partial results go
/// with Diagnostics.
template <class T>
class [[nodiscard]] Result {
  public:
    Result(T value) : state_(std::in_place_index<0>, std::move(value)) {}

    Result(Error error) : state_(std::in_place_index<1>, std::move(error)) {}

    bool has_value() const { return state_.index() == 0; }

    explicit operator bool() const { return has_value(); }

    T& value() & {
        VELATURA_CHECK(has_value(), "Result::value() without a value");
        return std::get<0>(state_);
    }

    const T& value() const& {
        VELATURA_CHECK(has_value(), "Result::value() without a value");
        return std::get<0>(state_);
    }

    T&& value() && {
        VELATURA_CHECK(has_value(), "Result::value() without a value");
        return std::get<0>(std::move(state_));
    }

    T& operator*() & { return value(); }

    const T& operator*() const& { return value(); }

    T&& operator*() && { return std::move(*this).value(); }

    T* operator->() { return &value(); }

    const T* operator->() const { return &value(); }

    const Error& error() const {
        VELATURA_CHECK(!has_value(), "Result::error() with a value");
        return std::get<1>(state_);
    }

    template <class U>
    T value_or(U&& fallback) const& {
        return has_value() ? std::get<0>(state_) : T(std::forward<U>(fallback));
    }

  private:
    std::variant<T, Error> state_;
};

template <>
class [[nodiscard]] Result<void> {
  public:
    Result() = default;

    Result(Error error) : error_(std::move(error)), ok_(false) {}

    bool has_value() const { return ok_; }

    explicit operator bool() const { return ok_; }

    const Error& error() const {
        VELATURA_CHECK(!ok_, "Result::error() with a value");
        return error_;
    }

  private:
    Error error_;
    bool ok_ = true;
};

}  // namespace velatura
