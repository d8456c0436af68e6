// SPDX-License-Identifier: Apache-2.0
#include "usd/text/scanner.h"

#include "base/characters.h"
#include "usd/layer/path.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>

namespace velatura::usd::text {

namespace {

int hex_value(char c) {
    if (is_digit(c)) return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    if (c >= 'A' && c <= 'F') return c - 'A' + 10;
    return -1;
}

/// Which ASCII characters an identifier may hold.
constexpr std::array<bool, 256> identifier_characters = [] {
    std::array<bool, 256> table{};
    for (size_t c = 'a'; c <= 'z'; ++c) table[c] = true;
    for (size_t c = 'A'; c <= 'Z'; ++c) table[c] = true;
    for (size_t c = '0'; c <= '9'; ++c) table[c] = true;
    table['_'] = true;
    return table;
}();

/// Digits from which a number may not fit 64 bits.
constexpr std::ptrdiff_t max_plain_digits = 19;

constexpr double powers_of_ten[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                    1e8,  1e9,  1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
                                    1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};

}  // namespace

Scanner::Scanner(std::string_view text, uint32_t file_id, Diagnostics& diagnostics)
    : begin_(text.data()),
      at_(text.data()),
      end_(text.data() + text.size()),
      line_start_(text.data()),
      file_id_(file_id),
      diagnostics_(diagnostics) {}

void Scanner::newline() {
    // CR LF counts once
    if (*at_ == '\r' && at_ + 1 < end_ && at_[1] == '\n') ++at_;
    ++at_;
    ++line_;
    line_start_ = at_;
}

bool Scanner::skip_block_comment() {
    const SourceLoc start = loc();
    at_ += 2;
    while (at_ < end_) {
        if (*at_ == '*' && peek(1) == '/') {
            at_ += 2;
            return true;
        }
        if (*at_ == '\n' || *at_ == '\r') {
            newline();
        } else {
            ++at_;
        }
    }
    return error("usd-syntax", start,
                 "found the end of the file inside this comment, expected '*/'");
}

void Scanner::skip_line_comment() {
    while (at_ < end_ && *at_ != '\n' && *at_ != '\r') ++at_;
}

void Scanner::skip_inline_slowly() {
    while (at_ < end_) {
        if (*at_ == ' ' || *at_ == '\t') {
            ++at_;
        } else if (*at_ == '#' || (*at_ == '/' && peek(1) == '/')) {
            skip_line_comment();
        } else if (*at_ == '/' && peek(1) == '*') {
            skip_block_comment();
        } else {
            return;
        }
    }
}

void Scanner::skip_lines_slowly() {
    while (true) {
        skip_inline();
        if (at_ == end_ || (*at_ != '\n' && *at_ != '\r')) return;
        newline();
    }
}

bool Scanner::expect(char c) {
    if (accept(c)) return true;
    return fail(fmt::format("'{}'", c));
}

bool Scanner::expect_assignment() {
    skip_inline();
    if (!expect('=')) return false;
    skip_inline();
    return true;
}

std::string_view Scanner::peek_identifier() const {
    const char* p = at_;
    if (p < end_ && is_digit(*p)) return {};
    const std::string_view rest(at_, size_t(end_ - at_));
    while (p < end_) {
        if (identifier_characters[static_cast<unsigned char>(*p)]) {
            ++p;
            continue;
        }
        if (static_cast<unsigned char>(*p) < 0x80) break;
        size_t length = 0;
        const uint32_t c = layer::decode_utf8(rest, size_t(p - at_), length);
        if (!(p == at_ ? layer::is_xid_start(c) : layer::is_xid_continue(c))) break;
        p += length;
    }
    return {at_, size_t(p - at_)};
}

std::string_view Scanner::accept_identifier() {
    const std::string_view word = peek_identifier();
    at_ += word.size();
    return word;
}

bool Scanner::accept_word(std::string_view word) {
    if (peek_identifier() != word) return false;
    at_ += word.size();
    return true;
}

bool Scanner::namespaced_identifier(std::string& out) {
    const char* const start = at_;
    if (accept_identifier().empty()) return fail("a name");
    while (peek() == ':') {
        ++at_;
        if (accept_identifier().empty()) return fail("a name after ':'");
    }
    out.assign(start, size_t(at_ - start));
    return true;
}

bool Scanner::type_identifier(std::string& out) {
    const char* const start = at_;
    if (accept_identifier().empty()) return fail("a type name");
    while (peek() == ':' && peek(1) == ':') {
        at_ += 2;
        if (accept_identifier().empty()) return fail("a name after '::'");
    }
    out.assign(start, size_t(at_ - start));
    return true;
}

bool Scanner::escape(std::string& out) {
    ++at_;
    if (at_ == end_) return false;
    const char c = *at_;
    if (c == 'x' && hex_value(peek(1)) >= 0) {
        int value = hex_value(peek(1));
        at_ += 2;
        if (hex_value(peek()) >= 0) {
            value = value * 16 + hex_value(peek());
            ++at_;
        }
        out += char(value);
        return true;
    }
    if (c >= '0' && c <= '7') {
        int value = 0;
        for (int i = 0; i < 3 && peek() >= '0' && peek() <= '7'; ++i)
            value = value * 8 + (*at_++ - '0');
        out += char(value & 0xff);
        return true;
    }
    constexpr std::string_view names = "abfnrtv";
    constexpr std::string_view codes = "\a\b\f\n\r\t\v";
    const size_t known = names.find(c);
    if (known != std::string_view::npos) {
        out += codes[known];
        ++at_;
    } else if (c == '\n' || c == '\r') {
        out += '\n';
        newline();
    } else {
        // Everything else stands for itself: \" \' \\ and unknown ones
        out += c;
        ++at_;
    }
    return true;
}

bool Scanner::string(std::string& out) {
    if (!at_string()) return fail("a string");
    const SourceLoc start = loc();
    const char quote = *at_;
    const bool is_triple = peek(1) == quote && peek(2) == quote;
    at_ += is_triple ? 3 : 1;
    out.clear();
    while (at_ < end_) {
        const char* run = at_;
        while (at_ < end_ && *at_ != quote && *at_ != '\\' && *at_ != '\n' && *at_ != '\r') ++at_;
        out.append(run, size_t(at_ - run));
        if (at_ == end_) break;
        if (*at_ == quote) {
            if (!is_triple) {
                ++at_;
                return true;
            }
            if (peek(1) == quote && peek(2) == quote) {
                at_ += 3;
                return true;
            }
            out += *at_++;
        } else if (*at_ == '\\') {
            if (!is_triple && (peek(1) == '\n' || peek(1) == '\r')) break;
            if (!escape(out)) break;
        } else if (is_triple) {
            const char* const line_end = at_;
            newline();
            out.append(line_end, size_t(at_ - line_end));
        } else {
            break;
        }
    }
    return error("usd-syntax", start,
                 fmt::format("found {} inside the string that starts here, expected {}",
                             at_end() ? "the end of the file" : "the end of the line",
                             is_triple ? std::string(3, quote) : std::string(1, quote)));
}

bool Scanner::asset(std::string& out) {
    const SourceLoc start = loc();
    if (peek() != '@') return fail("an asset path between '@'");
    const bool is_triple = peek(1) == '@' && peek(2) == '@';
    at_ += is_triple ? 3 : 1;
    out.clear();
    while (at_ < end_ && *at_ != '\n' && *at_ != '\r') {
        if (!is_triple && *at_ == '@') {
            ++at_;
            return true;
        }
        if (is_triple && *at_ == '\\' && peek(1) == '@' && peek(2) == '@' && peek(3) == '@') {
            out += "@@@";
            at_ += 4;
            continue;
        }
        if (is_triple && *at_ == '@' && peek(1) == '@' && peek(2) == '@') {
            // Up to two more belong to the path
            at_ += 3;
            for (int i = 0; i < 2 && peek() == '@'; ++i, ++at_) out += '@';
            return true;
        }
        if (is_control(*at_)) return fail("an asset path without control characters");
        out += *at_++;
    }
    return error("usd-syntax", start,
                 fmt::format("found the end of the line inside this asset path, expected {}",
                             is_triple ? "@@@" : "@"));
}

bool Scanner::path_text(std::string_view& out) {
    if (peek() != '<') return fail("a path between '<' and '>'");
    const SourceLoc start = loc();
    const char* const first = ++at_;
    while (at_ < end_ && *at_ != '>' && *at_ != '\n' && *at_ != '\r') ++at_;
    if (peek() != '>' || at_end()) {
        return error("usd-syntax", start,
                     "found the end of the line inside this path, expected '>'");
    }
    out = {first, size_t(at_ - first)};
    ++at_;
    return true;
}

bool Scanner::at_number() const {
    const char c = peek();
    if (is_digit(c)) return true;
    if (c == '.') return is_digit(peek(1));
    if (c == '-') {
        const char d = peek(1);
        return is_digit(d) || d == '.' || d == 'i' || d == 'n';
    }
    const std::string_view word = peek_identifier();
    return word == "inf" || word == "nan";
}

bool Scanner::fast_number(double& out) {
    const char* p = at_;
    const bool is_negative = p != end_ && *p == '-';
    if (is_negative) ++p;
    uint64_t digits = 0;
    const char* const first = p;
    for (; p != end_ && is_digit(*p); ++p) digits = digits * 10 + uint64_t(*p - '0');
    auto count = p - first;
    int power = 0;
    if (p != end_ && *p == '.') {
        const char* const decimals = ++p;
        for (; p != end_ && is_digit(*p); ++p) digits = digits * 10 + uint64_t(*p - '0');
        count += p - decimals;
        power = -int(std::min<std::ptrdiff_t>(p - decimals, max_plain_digits));
    }
    if (count == 0) return false;
    if (p != end_ && (*p == 'e' || *p == 'E')) {
        ++p;
        const bool is_small = p != end_ && *p == '-';
        if (p != end_ && (*p == '-' || *p == '+')) ++p;
        const char* const exponent = p;
        int e = 0;
        for (; p != end_ && is_digit(*p) && p - exponent < 4; ++p) e = e * 10 + (*p - '0');
        if (p == exponent) return false;
        power += is_small ? -e : e;
    }
    if (!at_separator(p)) return false;
    // Exact: such digits and powers up to 10^22 are doubles, so one operation rounds once (Clinger
    // 1990)
    constexpr uint64_t largest_exact = uint64_t(1) << 53;
    if (count < max_plain_digits && digits <= largest_exact && power >= -22 && power <= 22) {
        const double value = power < 0 ? double(digits) / powers_of_ten[-power]
                                       : double(digits) * powers_of_ten[power];
        out = is_negative ? -value : value;
    } else {
        const auto parsed = std::from_chars(at_, p, out);
        if (parsed.ec != std::errc() || parsed.ptr != p) return false;
    }
    at_ = p;
    return true;
}

bool Scanner::fast_integer(int64_t& out) {
    const char* p = at_;
    const bool is_negative = p != end_ && *p == '-';
    if (is_negative) ++p;
    const char* const first = p;
    int64_t value = 0;
    for (; p != end_ && is_digit(*p) && p - first < max_plain_digits - 1; ++p) {
        value = value * 10 + (*p - '0');
    }
    if (p == first || !at_separator(p)) return false;
    out = is_negative ? -value : value;
    at_ = p;
    return true;
}

bool Scanner::number(Number& out) {
    if (!at_number()) return fail("a number");
    out = {};
    const char* p = at_;
    out.is_negative = *p == '-';
    if (out.is_negative) ++p;
    if (p < end_ && (*p == 'i' || *p == 'n')) {
        const char* const start = at_;
        at_ = p;
        const std::string_view word = accept_identifier();
        if (word != "inf" && word != "nan") {
            at_ = start;
            return fail("a number");
        }
        const double value = word == "inf" ? std::numeric_limits<double>::infinity()
                                           : std::numeric_limits<double>::quiet_NaN();
        out.value = out.is_negative ? -value : value;
        return true;
    }
    const char* const digits = p;
    while (p < end_ && is_digit(*p)) ++p;
    bool is_integer = true;
    if (p < end_ && *p == '.') {
        is_integer = false;
        ++p;
        while (p < end_ && is_digit(*p)) ++p;
    }
    if (p - digits == 1 && *digits == '.') return fail("a number");
    if (p < end_ && (*p == 'e' || *p == 'E')) {
        const char* q = p + 1;
        if (q < end_ && (*q == '+' || *q == '-')) ++q;
        if (q == end_ || !is_digit(*q)) return fail("a number");
        while (q < end_ && is_digit(*q)) ++q;
        p = q;
        is_integer = false;
    }
    const auto parsed = std::from_chars(at_, p, out.value);
    if (parsed.ec == std::errc::result_out_of_range) {
        // Too large is infinite, too small is zero: look at the decimal exponent's sign
        const std::string_view text(at_, size_t(p - at_));
        const size_t e = text.find_first_of("eE");
        const bool is_tiny = e != std::string_view::npos ? text[e + 1] == '-' : digits[0] == '0';
        const double value = is_tiny ? 0.0 : std::numeric_limits<double>::infinity();
        out.value = out.is_negative ? -value : value;
    }
    if (is_integer) {
        const auto whole = std::from_chars(digits, p, out.magnitude);
        out.is_integer = whole.ec == std::errc();
    }
    at_ = p;
    return true;
}

std::string Scanner::found() const {
    if (at_end()) return "the end of the file";
    if (at_line_end()) return "the end of the line";
    std::string_view word = peek_identifier();
    if (word.empty()) {
        size_t length = 1;
        const uint32_t c = layer::decode_utf8({at_, size_t(end_ - at_)}, 0, length);
        if (c == 0xffffffffu || c < 0x20 || c == 0x7f) {
            return fmt::format("byte 0x{:02x}", unsigned(static_cast<unsigned char>(*at_)));
        }
        word = {at_, length};
    }
    return fmt::format("'{}'", word.substr(0, 60));
}

bool Scanner::fail(std::string_view expected) {
    return error("usd-syntax", loc(), fmt::format("found {}, expected {}", found(), expected));
}

bool Scanner::error(const char* code, SourceLoc where, std::string message) {
    if (is_stopped_) return false;
    ++errors_;
    diagnostics_.error(code, where, "", std::move(message));
    return false;
}

bool Scanner::too_deep(std::string_view what, int limit) {
    error("usd-depth", loc(),
          fmt::format("found more than {0} levels of {1}, expected at most {0}", limit, what));
    stop();
    return false;
}

void Scanner::warn(const char* code, SourceLoc where, std::string message) {
    diagnostics_.warn(code, where, "", std::move(message));
}

void Scanner::skip_broken_string() {
    const char quote = *at_;
    const bool is_triple = peek(1) == quote && peek(2) == quote;
    at_ += is_triple ? 3 : 1;
    while (at_ < end_) {
        if (at_line_end()) {
            if (!is_triple) return;
            newline();
        } else if (*at_ == '\\' && at_ + 1 < end_ && at_[1] != '\n' && at_[1] != '\r') {
            at_ += 2;
        } else if (*at_ == quote && (!is_triple || (peek(1) == quote && peek(2) == quote))) {
            at_ += is_triple ? 3 : 1;
            return;
        } else {
            ++at_;
        }
    }
}

void Scanner::recover(const Mark& start, char closer) {
    if (is_stopped_) return;
    const char* const broken_at = at_;
    at_ = start.at;
    line_start_ = start.line_start;
    line_ = start.line;
    int depth = 0;
    while (at_ < end_) {
        const char c = *at_;
        if (c == '"' || c == '\'') {
            skip_broken_string();
        } else if (c == '#') {
            skip_line_comment();
        } else if (at_line_end()) {
            newline();
            while (peek() == ' ' || peek() == '\t') ++at_;
            // A block may open on its own line: it belongs to the statement
            if (depth <= 0 && at_ > broken_at && peek() != '{') return;
        } else {
            if (c == '(' || c == '[' || c == '{') ++depth;
            if (c == ')' || c == ']' || c == '}') --depth;
            if (c == closer && depth < 0) {
                if (at_ >= broken_at) return;
                depth = 0;
            }
            ++at_;
        }
    }
}

bool Scanner::check_utf8() {
    const std::string_view all(begin_, size_t(end_ - begin_));
    for (size_t at = 0; at < all.size();) {
        // Eight bytes of ASCII at a time
        uint64_t word = 0;
        while (all.size() - at >= sizeof word) {
            std::memcpy(&word, all.data() + at, sizeof word);
            if ((word & 0x8080808080808080u) != 0) break;
            at += sizeof word;
        }
        if (at == all.size()) break;
        const auto c = static_cast<unsigned char>(all[at]);
        size_t length = 1;
        if (c >= 0x80 && layer::decode_utf8(all, at, length) == 0xffffffffu) {
            const size_t line_start = all.rfind('\n', at) + 1;
            const auto lines = std::count(begin_, begin_ + at, '\n');
            const SourceLoc where{file_id_, uint32_t(lines) + 1, uint32_t(at - line_start) + 1};
            return error("usd-encoding", where,
                         fmt::format("found byte 0x{:02x} that is not UTF-8, expected UTF-8 text",
                                     unsigned(c)));
        }
        at += length;
    }
    return true;
}

}  // namespace velatura::usd::text
