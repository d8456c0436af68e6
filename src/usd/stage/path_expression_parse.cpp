// SPDX-License-Identifier: Apache-2.0
#include "usd/stage/path_expression.h"

#include <fmt/format.h>

#include <cctype>

namespace velatura::usd::stage {

using layer::Path;

namespace {

using Node = PathExpressionNode;
using Op = PathExpressionNode::Op;

constexpr int max_depth = 100;

bool is_word(char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' ||
           (static_cast<unsigned char>(c) & 0x80) != 0;
}

bool has_wildcard(std::string_view text) {
    return text.empty() || text.find_first_of("*?[") != std::string_view::npos;
}

class Parser {
  public:
    Parser(std::string_view text, Path anchor, const PathMapper& to_stage, std::string& error)
        : text_(text), anchor_(anchor), to_stage_(to_stage), error_(error) {}

    Node parse() {
        skip_blanks();
        if (at_ == text_.size()) return {};
        Node node = expression(0);
        skip_blanks();
        if (error_.empty() && at_ < text_.size()) fail("unexpected text");
        return error_.empty() ? node : Node{};
    }

    /// The text with the literal paths of the stage, after parse().
    std::string mapped_text() const {
        std::string result;
        size_t copied = 0;
        for (const Edit& edit : edits_) {
            result.append(text_, copied, edit.from - copied).append(edit.replacement);
            copied = edit.end;
        }
        return result.append(text_, copied);
    }

  private:
    /// What stands for text_[from, end) on the stage.
    struct Edit {
        size_t from, end;
        std::string replacement;
    };

    static constexpr const char* nothing = "(~//)";

    void fail(std::string_view what) {
        if (error_.empty()) error_ = fmt::format("{} at character {}", what, at_);
    }

    char peek(size_t ahead = 0) const {
        return at_ + ahead < text_.size() ? text_[at_ + ahead] : '\0';
    }

    bool accept(char c) {
        if (peek() != c) return false;
        ++at_;
        return true;
    }

    void skip_blanks() {
        while (std::isspace(static_cast<unsigned char>(peek())) != 0) ++at_;
    }

    bool starts_factor() const {
        const char c = peek();
        return c == '~' || c == '(' || c == '%' || c == '/' || c == '.' || c == '*' || c == '?' ||
               c == '{' || is_word(c);
    }

    // From loose to tight: difference, intersection, union, union by blanks, complement

    Node expression(int depth) {
        Node left = intersection(depth);
        while (error_.empty() && accept_operator('-'))
            left = joined(Op::Difference, std::move(left), intersection(depth));
        return left;
    }

    Node intersection(int depth) {
        Node left = set_union(depth);
        while (error_.empty() && accept_operator('&'))
            left = joined(Op::Intersection, std::move(left), set_union(depth));
        return left;
    }

    Node set_union(int depth) {
        Node left = implied_union(depth);
        while (error_.empty() && accept_operator('+'))
            left = joined(Op::Union, std::move(left), implied_union(depth));
        return left;
    }

    bool accept_operator(char c) {
        skip_blanks();
        return accept(c);
    }

    Node implied_union(int depth) {
        Node left = factor(depth);
        while (error_.empty()) {
            const size_t before = at_;
            skip_blanks();
            if (at_ == before || !starts_factor()) break;
            left = joined(Op::Union, std::move(left), factor(depth));
        }
        return left;
    }

    static Node joined(Op op, Node left, Node right) {
        Node node;
        node.op = op;
        node.operands.push_back(std::move(left));
        node.operands.push_back(std::move(right));
        return node;
    }

    Node factor(int depth) {
        skip_blanks();
        if (depth > max_depth) {
            fail("nested too deeply");
            return {};
        }
        if (accept('~')) {
            Node node;
            node.op = Op::Complement;
            node.operands.push_back(factor(depth + 1));
            return node;
        }
        if (accept('(')) {
            Node node = expression(depth + 1);
            skip_blanks();
            if (!accept(')')) fail("missing ')'");
            return node;
        }
        if (accept('%')) return reference();
        if (!starts_factor()) {
            fail("expected a path pattern");
            return {};
        }
        return pattern();
    }

    Node reference() {
        Node node;
        node.op = Op::Collection;
        const size_t from = at_;
        while (is_word(peek()) || peek() == '/' || peek() == '.') ++at_;
        const std::string_view path = text_.substr(from, at_ - from);
        if (path == "_" && peek() != ':') {
            node.op = Op::Weaker;
            return node;
        }
        if (!accept(':')) {
            fail("missing ':' and the name of a collection");
            return node;
        }
        const size_t name = at_;
        while (is_word(peek()) || peek() == ':') ++at_;
        node.collection_name = std::string(text_.substr(name, at_ - name));
        if (node.collection_name.empty()) fail("missing name of a collection");
        const Path prim = path.empty() ? anchor_ : Path::from(path).make_absolute(anchor_);
        node.collection_prim = to_stage_(prim);
        if (node.collection_prim.is_empty()) {
            node.op = Op::Nothing;
            edits_.push_back({from - 1, at_, nothing});
        } else if (!path.empty()) {
            edits_.push_back({from, from + path.size(), node.collection_prim.to_string()});
        }
        return node;
    }

    Node pattern() {
        Node node;
        node.op = Op::Pattern;
        const size_t from = at_;
        Path prefix = peek() == '/' ? Path::absolute_root() : anchor_;
        step_up(prefix);
        size_t prefix_end = at_;
        bool any_part = false;
        while (error_.empty()) {
            if (peek() == '/' && peek(1) == '/') {
                at_ += 2;
                PathPatternPart stretch;
                stretch.is_stretch = true;
                node.parts.push_back(stretch);
                any_part = true;
            } else if (!accept('/') && any_part) {
                break;
            }
            if (!starts_part()) break;
            PathPatternPart one = part(false);
            any_part = true;
            add_part(node, prefix, std::move(one));
            if (node.parts.empty()) prefix_end = at_;
        }
        if (error_.empty() && peek() == '.' &&
            (is_word(peek(1)) || has_wildcard(text_.substr(at_ + 1, 1)))) {
            ++at_;
            add_part(node, prefix, part(true));
            if (node.parts.empty()) prefix_end = at_;
            if (peek() == '/' && peek(1) == '/') at_ += 2;
        }
        node.prefix = to_stage_(prefix);
        if (node.prefix.is_empty()) {
            node.op = Op::Nothing;
            edits_.push_back({from, at_, nothing});
        } else if (error_.empty()) {
            edits_.push_back({from, prefix_end, literal(node.prefix, prefix_end)});
        }
        return node;
    }

    /// A prefix as text, with what must stand between it and the rest of the pattern.
    std::string literal(const Path& prefix, size_t prefix_end) const {
        const bool has_rest = prefix_end < at_;
        const char next = has_rest ? text_[prefix_end] : '\0';
        const bool is_joined = !has_rest || next == '/' || next == '.';
        if (prefix.is_absolute_root()) return is_joined && has_rest ? "" : "/";
        return prefix.to_string() + (is_joined ? "" : "/");
    }

    /// "." and "../.." in front of a relative pattern.
    void step_up(Path& prefix) {
        if (peek() != '.') return;
        if (peek(1) != '.') {
            // Else it begins a property of the anchor
            if (!is_word(peek(1)) && peek(1) != '*' && peek(1) != '?') ++at_;
            return;
        }
        while (peek() == '.' && peek(1) == '.') {
            at_ += 2;
            if (!prefix.is_absolute_root()) prefix = prefix.parent();
            if (peek() == '/' && peek(1) == '.' && peek(2) == '.') ++at_;
        }
    }

    bool starts_part() const {
        const char c = peek();
        return c == '*' || c == '?' || c == '[' || c == '{' || is_word(c);
    }

    PathPatternPart part(bool is_property) {
        PathPatternPart result;
        result.is_property = is_property;
        const size_t from = at_;
        bool in_set = false;
        while (at_ < text_.size()) {
            const char c = peek();
            if (in_set ? c == ']' : c == '[') in_set = !in_set;
            const bool fits = in_set || is_word(c) || c == '*' || c == '?' || c == ']' ||
                              (is_property && c == ':');
            if (!fits) break;
            ++at_;
        }
        if (in_set) fail("missing ']'");
        result.text = std::string(text_.substr(from, at_ - from));
        if (accept('{')) {
            result.predicate.push_back(predicate_or(0));
            skip_blanks();
            if (!accept('}')) fail("missing '}'");
        }
        if (result.text.empty() && result.predicate.empty()) fail("expected a name");
        return result;
    }

    static void add_part(Node& node, Path& prefix, PathPatternPart part) {
        if (node.parts.empty() && part.predicate.empty() && !has_wildcard(part.text)) {
            prefix = part.is_property ? prefix.append_property(part.text)
                                      : prefix.append_child(part.text);
            return;
        }
        node.parts.push_back(std::move(part));
    }

    // Predicates: or, and, implied and, not, calls

    static PathPredicate both(PathPredicate::Op op, PathPredicate a, PathPredicate b) {
        PathPredicate result;
        result.op = op;
        result.operands.push_back(std::move(a));
        result.operands.push_back(std::move(b));
        return result;
    }

    bool accept_word(std::string_view word) {
        skip_blanks();
        if (text_.substr(at_, word.size()) != word || is_word(peek(word.size()))) return false;
        at_ += word.size();
        return true;
    }

    PathPredicate predicate_or(int depth) {
        PathPredicate left = predicate_and(depth);
        while (error_.empty() && accept_word("or"))
            left = both(PathPredicate::Op::Or, std::move(left), predicate_and(depth));
        return left;
    }

    PathPredicate predicate_and(int depth) {
        PathPredicate left = predicate_not(depth);
        while (error_.empty()) {
            skip_blanks();
            const bool is_said = accept_word("and");
            const size_t here = at_;
            if (!is_said && accept_word("or")) {
                at_ = here;
                break;
            }
            skip_blanks();
            if (!is_said && !is_word(peek()) && peek() != '(') break;
            left = both(PathPredicate::Op::And, std::move(left), predicate_not(depth));
        }
        return left;
    }

    PathPredicate predicate_not(int depth) {
        if (depth > max_depth) {
            fail("nested too deeply");
            return {};
        }
        if (accept_word("not")) {
            PathPredicate result;
            result.op = PathPredicate::Op::Not;
            result.operands.push_back(predicate_not(depth + 1));
            return result;
        }
        skip_blanks();
        if (accept('(')) {
            PathPredicate result = predicate_or(depth + 1);
            skip_blanks();
            if (!accept(')')) fail("missing ')'");
            return result;
        }
        return call();
    }

    PathPredicate call() {
        PathPredicate result;
        const size_t from = at_;
        while (is_word(peek())) ++at_;
        result.function = std::string(text_.substr(from, at_ - from));
        if (result.function.empty()) fail("expected a predicate");
        if (accept(':')) {
            do result.arguments.emplace_back("", argument());
            while (error_.empty() && accept(','));
        } else if (accept('(')) {
            skip_blanks();
            while (error_.empty() && peek() != ')') {
                std::string value = argument();
                skip_blanks();
                std::string name;
                if (accept('=')) {
                    name = std::move(value);
                    skip_blanks();
                    value = argument();
                    skip_blanks();
                }
                result.arguments.emplace_back(std::move(name), std::move(value));
                if (!accept(',')) break;
                skip_blanks();
            }
            if (!accept(')')) fail("missing ')'");
        }
        return result;
    }

    std::string argument() {
        const char quote = peek();
        if (quote == '"' || quote == '\'') {
            ++at_;
            std::string text;
            while (at_ < text_.size() && peek() != quote) {
                if (peek() == '\\' && at_ + 1 < text_.size()) ++at_;
                text += text_[at_++];
            }
            if (!accept(quote)) fail("missing end of a string");
            return text;
        }
        const size_t from = at_;
        constexpr std::string_view ends = " \t\n,)}=(\"'";
        while (at_ < text_.size() && ends.find(peek()) == std::string_view::npos) ++at_;
        if (at_ == from) fail("expected an argument");
        return std::string(text_.substr(from, at_ - from));
    }

    std::string_view text_;
    Path anchor_;
    const PathMapper& to_stage_;
    std::string& error_;
    size_t at_ = 0;
    std::vector<Edit> edits_;
};

}  // namespace

PathExpressionNode parse_path_expression(std::string_view text,
                                         Path anchor,
                                         const PathMapper& to_stage,
                                         std::string& error) {
    return Parser(text, anchor, to_stage, error).parse();
}

std::string path_expression_text(std::string_view text, Path anchor, const PathMapper& to_stage) {
    std::string error;
    Parser parser(text, anchor, to_stage, error);
    parser.parse();
    return error.empty() ? parser.mapped_text() : std::string(text);
}

}  // namespace velatura::usd::stage
