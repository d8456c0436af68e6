// SPDX-License-Identifier: Apache-2.0
#include "base/characters.h"
#include "usd/layer/expression_node.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

namespace velatura::usd::layer {

namespace {

using Node = VariableExpression::Node;

struct Function {
    std::string_view name;
    int fewest;
    int max;  ///< -1: any number of arguments
};

constexpr Function functions[] = {
    {"if", 2, 3},  {"and", 2, -1},     {"or", 2, -1}, {"not", 1, 1},      {"eq", 2, 2},
    {"neq", 2, 2}, {"lt", 2, 2},       {"leq", 2, 2}, {"gt", 2, 2},       {"geq", 2, 2},
    {"at", 2, 2},  {"contains", 2, 2}, {"len", 1, 1}, {"defined", 1, -1},
};

bool is_name_start(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
}

bool is_name_char(char c) {
    return is_name_start(c) || is_digit(c);
}

int hex_digit(char c) {
    if (is_digit(c)) return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    return c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
}

/// Recursive descent; the first error ends it.
class Parser {
  public:
    explicit Parser(std::string_view text) : text_(text) {}

    bool parse(Node& root) {
        if (!accept('`')) return fail("expressions must begin with '`'");
        if (!parse_expression(root, true, 0)) return false;
        if (!accept('`')) return fail("missing ending '`'");
        return at_ == text_.size() || fail("unexpected text after the expression");
    }

    const std::string& error() const { return error_; }

  private:
    bool fail(std::string_view what) {
        if (error_.empty()) error_ = fmt::format("{} at character {}", what, at_);
        return false;
    }

    char peek() const { return at_ < text_.size() ? text_[at_] : '\0'; }

    bool accept(char c) {
        if (peek() != c || at_ == text_.size()) return false;
        ++at_;
        return true;
    }

    void skip_spaces() {
        while (peek() == ' ') ++at_;
    }

    std::string_view take_name() {
        const size_t from = at_;
        if (is_name_start(peek())) {
            while (is_name_char(peek())) ++at_;
        }
        return text_.substr(from, at_ - from);
    }

    bool parse_expression(Node& node, bool lists_allowed, int depth) {
        if (depth > max_expression_depth) return fail("expression is nested too deeply");
        const char c = peek();
        if (c == '$') return parse_variable(node);
        if (c == '"' || c == '\'') return parse_string(node);
        if (is_digit(c) || c == '-') return parse_integer(node);
        if (c == '[' && lists_allowed) return parse_list(node, depth);
        if (is_name_start(c)) return parse_word(node, depth);
        return fail("unexpected expression");
    }

    bool parse_variable(Node& node) {
        node.kind = ExpressionKind::Variable;
        if (text_.substr(at_, 2) != "${") return fail("unexpected expression");
        at_ += 2;
        node.text = std::string(take_name());
        if (node.text.empty()) return fail("the name of a variable must be a C identifier");
        return accept('}') || fail("missing ending '}'");
    }

    bool parse_string(Node& node) {
        node.kind = ExpressionKind::String;
        const char quote = text_[at_++];
        while (at_ < text_.size() && peek() != quote) {
            Node& part = node.children.emplace_back();
            if (text_.substr(at_, 2) == "${") {
                if (!parse_variable(part)) return false;
            } else {
                part.kind = ExpressionKind::String;
                take_plain_text(part.text, quote);
            }
        }
        return accept(quote) || fail(fmt::format("missing ending '{}'", quote));
    }

    /// Text up to the end of the string or the next variable, its escapes undone.
    void take_plain_text(std::string& out, char quote) {
        while (at_ < text_.size() && peek() != quote && text_.substr(at_, 2) != "${") {
            const char c = text_[at_++];
            if (c == '\\' && at_ < text_.size()) {
                take_escape(out);
            } else {
                out += c;
            }
        }
    }

    /// What follows a backslash: C's letters, up to three octal or two hexadecimal digits; any
    /// other character stands for itself.
    void take_escape(std::string& out) {
        constexpr std::string_view letters = "abfnrtv";
        constexpr std::string_view meanings = "\a\b\f\n\r\t\v";
        const char c = text_[at_++];
        if (const size_t letter = letters.find(c); letter != std::string_view::npos) {
            out += meanings[letter];
        } else if (c == 'x') {
            int code = 0;
            for (int i = 0; i < 2 && hex_digit(peek()) >= 0; ++i)
                code = code * 16 + hex_digit(text_[at_++]);
            out += char(code);
        } else if (c >= '0' && c <= '7') {
            int code = c - '0';
            for (int i = 0; i < 2 && peek() >= '0' && peek() <= '7'; ++i)
                code = code * 8 + (text_[at_++] - '0');
            out += char(code);
        } else {
            out += c;
        }
    }

    bool parse_integer(Node& node) {
        node.kind = ExpressionKind::Integer;
        const char* first = text_.data() + at_;
        const auto [end, failed] =
            std::from_chars(first, text_.data() + text_.size(), node.integer);
        if (failed == std::errc::result_out_of_range) {
            return fail(fmt::format("integer {} is out of range", std::string(first, end)));
        }
        if (failed != std::errc()) return fail("unexpected expression");
        at_ += size_t(end - first);
        return true;
    }

    bool parse_list(Node& node, int depth) {
        node.kind = ExpressionKind::List;
        ++at_;
        return parse_items(node, ']', false, depth);
    }

    /// Elements or arguments up to the closing character, commas between them.
    bool parse_items(Node& node, char close, bool lists_allowed, int depth) {
        skip_spaces();
        if (accept(close)) return true;
        do {
            skip_spaces();
            if (!parse_expression(node.children.emplace_back(), lists_allowed, depth + 1))
                return false;
            skip_spaces();
        } while (accept(','));
        return accept(close) || fail(fmt::format("missing ending '{}'", close));
    }

    /// true, false, none or a function.
    bool parse_word(Node& node, int depth) {
        const size_t start = at_;
        const std::string_view word = take_name();
        if (word == "True" || word == "true" || word == "False" || word == "false") {
            node.kind = ExpressionKind::Boolean;
            node.boolean = word == "True" || word == "true";
            return true;
        }
        if (word == "None" || word == "none") return true;
        node.kind = ExpressionKind::Function;
        node.text = std::string(word);
        skip_spaces();
        if (!accept('(')) {
            at_ = start;
            return fail("unexpected expression");
        }
        if (!parse_items(node, ')', true, depth)) return false;
        return check_arguments(node);
    }

    bool check_arguments(const Node& node) {
        const auto* known = std::find_if(std::begin(functions), std::end(functions),
                                         [&](const Function& f) { return f.name == node.text; });
        if (known == std::end(functions))
            return fail(fmt::format("unknown function {}", node.text));
        const int given = int(node.children.size());
        if (given < known->fewest && known->max < 0) {
            return fail(fmt::format("function '{}' requires at least {} arguments", node.text,
                                    known->fewest));
        }
        if (given < known->fewest || (known->max >= 0 && given > known->max))
            return fail(fmt::format("function '{}' does not take {} arguments", node.text, given));
        return true;
    }

    std::string_view text_;
    size_t at_ = 0;
    std::string error_;
};

}  // namespace

std::string parse_expression(std::string_view text, VariableExpression::Node& root) {
    Parser parser(text);
    parser.parse(root);
    return parser.error();
}

}  // namespace velatura::usd::layer
