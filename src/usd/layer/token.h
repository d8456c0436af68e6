// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <compare>
#include <cstddef>
#include <functional>
#include <string>
#include <string_view>

namespace velatura::usd::layer {

/// An interned string: pointer-sized, compared and hashed by address. Interning is thread-safe;
/// texts live until the process ends, so a Token never dangles. The default Token is the empty
/// text.
class Token {
  public:
    Token() : text_(empty_text()) {}

    explicit Token(std::string_view text) : text_(intern(text)) {}

    const std::string& str() const { return *text_; }

    std::string_view view() const { return *text_; }

    bool empty() const { return text_->empty(); }

    bool operator==(const Token& o) const { return text_ == o.text_; }

    bool operator==(std::string_view text) const { return *text_ == text; }

    /// Order by bytes of the text: the same in every run.
    std::strong_ordering operator<=>(const Token& o) const {
        return text_ == o.text_ ? std::strong_ordering::equal : text_->compare(*o.text_) <=> 0;
    }

    size_t hash() const { return std::hash<const void*>()(text_); }

  private:
    static const std::string* intern(std::string_view text);
    static const std::string* empty_text();

    const std::string* text_;
};

}  // namespace velatura::usd::layer

template <>
struct std::hash<velatura::usd::layer::Token> {
    size_t operator()(const velatura::usd::layer::Token& t) const { return t.hash(); }
};
