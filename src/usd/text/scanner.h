// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/diagnostics.h"

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace velatura::usd::text {

/// A number as written.
struct Number {
    double value = 0.0;
    uint64_t magnitude = 0;  ///< of integers that fit
    bool is_integer =
        false;  ///< written without '.', exponent, inf, nan, and |value| fits magnitude
    bool is_negative = false;
};

/// Characters that asset paths must not have, however they are written.
inline bool is_control(char c) {
    return static_cast<unsigned char>(c) < 0x20 || c == 0x7f;
}

/// Walks over the text of a layer, keeps line and column, and reads the words all rules are made
/// of. Functions that read something return false after having reported what they found and
/// expected. Ref: AOUSD Core Specification 1.0.1, 16.2.3 … 16.2.9.
class Scanner {
  public:
    Scanner(std::string_view text, uint32_t file_id, Diagnostics& diagnostics);

    bool at_end() const { return at_ == end_; }

    char peek() const { return at_ < end_ ? *at_ : '\0'; }

    char peek(size_t ahead) const { return size_t(end_ - at_) > ahead ? at_[ahead] : '\0'; }

    SourceLoc loc() const { return {file_id_, line_, uint32_t(at_ - line_start_) + 1}; }

    /// Skips blanks and comments within the line; a comment between slash and asterisk may span
    /// lines.
    void skip_inline() {
        if (at_ != end_ && *at_ == ' ') ++at_;
        if (at_ == end_ || is_plain(*at_)) return;
        skip_inline_slowly();
    }

    /// Skips blanks, comments and line ends.
    void skip_lines() {
        if (at_ != end_ && *at_ == ' ') ++at_;
        if (at_ == end_ || is_plain(*at_)) return;
        skip_lines_slowly();
    }

    bool at_line_end() const { return at_end() || *at_ == '\n' || *at_ == '\r'; }

    /// Takes the character if it comes next.
    bool accept(char c) {
        if (at_ == end_ || *at_ != c) return false;
        ++at_;
        return true;
    }

    bool expect(char c);
    /// '=' with blanks around it.
    bool expect_assignment();

    /// Identifier here ("" when none). The view is into the text.
    std::string_view peek_identifier() const;
    std::string_view accept_identifier();
    /// Takes the word if it comes next as a whole identifier.
    bool accept_word(std::string_view word);
    bool namespaced_identifier(std::string& out);
    /// Name of a type: identifiers joined by "::".
    bool type_identifier(std::string& out);

    bool at_string() const { return peek() == '"' || peek() == '\''; }

    bool string(std::string& out);
    /// @path@ or @@@path@@@.
    bool asset(std::string& out);
    /// The text between '<' and '>'.
    bool path_text(std::string_view& out);

    bool at_number() const;
    bool number(Number& out);
    /// The same for a decimal, perhaps with an exponent, in front of a separator, exactly rounded
    /// too; false, taking nothing, when it is something else.
    bool fast_number(double& out);
    /// The same for an integer of up to 18 digits.
    bool fast_integer(int64_t& out);

    /// Reports "found …, expected `expected`" here; always false.
    bool fail(std::string_view expected);
    /// Reports a message at a place; always false.
    bool error(const char* code, SourceLoc where, std::string message);
    void warn(const char* code, SourceLoc where, std::string message);
    /// Reports more than `limit` levels of `what` here and stops; always false.
    bool too_deep(std::string_view what, int limit);

    size_t error_count() const { return errors_; }

    /// Jumps to the end; what is missing there is no longer reported.
    void stop() {
        at_ = end_;
        is_stopped_ = true;
    }

    /// A place to come back to.
    struct Mark {
        const char* at;
        const char* line_start;
        uint32_t line;
    };

    Mark mark() const { return {at_, line_start_, line_}; }

    /// After an error in the statement that began at `start`: skips to the end of the line past the
    /// error on which all brackets opened since the start are closed again, or to the bracket
    /// `closer` that ends the enclosing block.
    void recover(const Mark& start, char closer = '}');
    /// Reports bytes that are not UTF-8; false when there are any.
    bool check_utf8();

  private:
    /// Neither a blank nor the begin of a line end or comment.
    static bool is_plain(char c) { return c > ' ' && c != '#' && c != '/'; }

    bool at_separator(const char* p) const {
        return p != end_ && (*p == ',' || *p == ')' || *p == ']' || *p == ' ' || *p == '\n' ||
                             *p == '\r' || *p == ':');
    }

    void skip_inline_slowly();
    void skip_lines_slowly();
    void newline();
    void skip_broken_string();
    bool skip_block_comment();
    void skip_line_comment();
    bool escape(std::string& out);
    std::string found() const;

    const char* begin_;
    const char* at_;
    const char* end_;
    const char* line_start_;
    uint32_t line_ = 1;
    uint32_t file_id_;
    Diagnostics& diagnostics_;
    size_t errors_ = 0;
    bool is_stopped_ = false;
};

}  // namespace velatura::usd::text
