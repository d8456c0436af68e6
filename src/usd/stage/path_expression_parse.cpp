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

/// A position in the text of an expression, and the first error.
class Cursor {
  public:
    Cursor(std::string_view text, std::string& error) : text_(text), error_(error) {}

    std::string_view text() const { return text_; }

    bool is_good() const { return error_.empty(); }

    bool is_at_end() const { return at_ >= text_.size(); }

    size_t at() const { return at_; }

    void go_to(size_t at) { at_ = at; }

    void skip(size_t characters = 1) { at_ += characters; }

    void fail(std::string_view what) {
        if (error_.empty()) error_ = fmt::format("{} at character {}", what, at_);
    }

    char peek(size_t ahead = 0) const {
        return at_ + ahead < text_.size() ? text_[at_ + ahead] : '\0';
    }

    /// What was read since `from`.
    std::string_view since(size_t from) const { return text_.substr(from, at_ - from); }

    void skip_blanks() {
        while (std::isspace(static_cast<unsigned char>(peek())) != 0) ++at_;
    }

    bool accept(char c) {
        if (peek() != c) return false;
        ++at_;
        return true;
    }

    /// Skips blanks first, also where the character is another.
    bool accept_operator(char c) {
        skip_blanks();
        return accept(c);
    }

    /// Skips blanks first, also where the word is another.
    bool accept_word(std::string_view word) {
        skip_blanks();
        if (text_.substr(at_, word.size()) != word || is_word(peek(word.size()))) return false;
        at_ += word.size();
        return true;
    }

  private:
    std::string_view text_;
    std::string& error_;
    size_t at_ = 0;
};

/// Predicates in braces: or, and, implied and, not, calls.
class PredicateParser {
  public:
    explicit PredicateParser(Cursor& in) : in_(in) {}

    PathPredicate parse() { return any_of(0); }

  private:
    static PathPredicate both(PathPredicate::Op op, PathPredicate a, PathPredicate b) {
        PathPredicate result;
        result.op = op;
        result.operands.push_back(std::move(a));
        result.operands.push_back(std::move(b));
        return result;
    }

    PathPredicate any_of(int depth) {
        PathPredicate left = all_of(depth);
        while (in_.is_good() && in_.accept_word("or"))
            left = both(PathPredicate::Op::Or, std::move(left), all_of(depth));
        return left;
    }

    PathPredicate all_of(int depth) {
        PathPredicate left = one(depth);
        while (in_.is_good()) {
            in_.skip_blanks();
            const bool is_said = in_.accept_word("and");
            const size_t here = in_.at();
            if (!is_said && in_.accept_word("or")) {
                in_.go_to(here);
                break;
            }
            in_.skip_blanks();
            if (!is_said && !is_word(in_.peek()) && in_.peek() != '(') break;
            left = both(PathPredicate::Op::And, std::move(left), one(depth));
        }
        return left;
    }

    PathPredicate one(int depth) {
        if (depth > max_depth) {
            in_.fail("nested too deeply");
            return {};
        }
        if (in_.accept_word("not")) {
            PathPredicate result;
            result.op = PathPredicate::Op::Not;
            result.operands.push_back(one(depth + 1));
            return result;
        }
        in_.skip_blanks();
        if (in_.accept('(')) {
            PathPredicate result = any_of(depth + 1);
            in_.skip_blanks();
            if (!in_.accept(')')) in_.fail("missing ')'");
            return result;
        }
        return call();
    }

    PathPredicate call() {
        PathPredicate result;
        const size_t from = in_.at();
        while (is_word(in_.peek())) in_.skip();
        result.function = std::string(in_.since(from));
        if (result.function.empty()) in_.fail("expected a predicate");
        if (in_.accept(':')) {
            do result.arguments.emplace_back("", argument());
            while (in_.is_good() && in_.accept(','));
        } else if (in_.accept('(')) {
            in_.skip_blanks();
            while (in_.is_good() && in_.peek() != ')') {
                std::string value = argument();
                in_.skip_blanks();
                std::string name;
                if (in_.accept('=')) {
                    name = std::move(value);
                    in_.skip_blanks();
                    value = argument();
                    in_.skip_blanks();
                }
                result.arguments.emplace_back(std::move(name), std::move(value));
                if (!in_.accept(',')) break;
                in_.skip_blanks();
            }
            if (!in_.accept(')')) in_.fail("missing ')'");
        }
        return result;
    }

    std::string argument() {
        const char quote = in_.peek();
        if (quote == '"' || quote == '\'') {
            in_.skip();
            std::string text;
            while (!in_.is_at_end() && in_.peek() != quote) {
                if (in_.peek() == '\\' && in_.at() + 1 < in_.text().size()) in_.skip();
                text += in_.peek();
                in_.skip();
            }
            if (!in_.accept(quote)) in_.fail("missing end of a string");
            return text;
        }
        const size_t from = in_.at();
        constexpr std::string_view ends = " \t\n,)}=(\"'";
        while (!in_.is_at_end() && ends.find(in_.peek()) == std::string_view::npos) in_.skip();
        if (in_.at() == from) in_.fail("expected an argument");
        return std::string(in_.since(from));
    }

    Cursor& in_;
};

class Parser {
  public:
    Parser(std::string_view text, Path anchor, const PathMapper& to_stage, std::string& error)
        : in_(text, error), anchor_(anchor), to_stage_(to_stage) {}

    Node parse() {
        in_.skip_blanks();
        if (in_.is_at_end()) return {};
        Node node = expression(0);
        in_.skip_blanks();
        if (in_.is_good() && !in_.is_at_end()) in_.fail("unexpected text");
        return in_.is_good() ? node : Node{};
    }

    /// The text with the literal paths of the stage, after parse().
    std::string mapped_text() const {
        std::string result;
        size_t copied = 0;
        for (const Edit& edit : edits_) {
            result.append(in_.text(), copied, edit.from - copied).append(edit.replacement);
            copied = edit.end;
        }
        return result.append(in_.text(), copied);
    }

  private:
    /// What replaces the characters [from, end) of the text on the stage.
    struct Edit {
        size_t from, end;
        std::string replacement;
    };

    static constexpr const char* nothing = "(~//)";

    bool starts_factor() const {
        const char c = in_.peek();
        return c == '~' || c == '(' || c == '%' || c == '/' || c == '.' || c == '*' || c == '?' ||
               c == '{' || is_word(c);
    }

    // From loose to tight: difference, intersection, union, union by blanks, complement

    Node expression(int depth) {
        return chain(Op::Difference, '-', [&] { return intersection(depth); });
    }

    Node intersection(int depth) {
        return chain(Op::Intersection, '&', [&] { return set_union(depth); });
    }

    Node set_union(int depth) {
        return chain(Op::Union, '+', [&] { return implied_union(depth); });
    }

    /// Operands of one operator, from left to right.
    template <class Operand>
    Node chain(Op op, char sign, const Operand& operand) {
        Node left = operand();
        while (in_.is_good() && in_.accept_operator(sign))
            left = joined(op, std::move(left), operand());
        return left;
    }

    Node implied_union(int depth) {
        Node left = factor(depth);
        while (in_.is_good()) {
            const size_t before = in_.at();
            in_.skip_blanks();
            if (in_.at() == before || !starts_factor()) break;
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
        in_.skip_blanks();
        if (depth > max_depth) {
            in_.fail("nested too deeply");
            return {};
        }
        if (in_.accept('~')) {
            Node node;
            node.op = Op::Complement;
            node.operands.push_back(factor(depth + 1));
            return node;
        }
        if (in_.accept('(')) {
            Node node = expression(depth + 1);
            in_.skip_blanks();
            if (!in_.accept(')')) in_.fail("missing ')'");
            return node;
        }
        if (in_.accept('%')) return reference();
        if (!starts_factor()) {
            in_.fail("expected a path pattern");
            return {};
        }
        return pattern();
    }

    Node reference() {
        Node node;
        node.op = Op::Collection;
        const size_t from = in_.at();
        while (is_word(in_.peek()) || in_.peek() == '/' || in_.peek() == '.') in_.skip();
        const std::string_view path = in_.since(from);
        if (path == "_" && in_.peek() != ':') {
            node.op = Op::Weaker;
            return node;
        }
        if (!in_.accept(':')) {
            in_.fail("missing ':' and the name of a collection");
            return node;
        }
        const size_t name = in_.at();
        while (is_word(in_.peek()) || in_.peek() == ':') in_.skip();
        node.collection_name = std::string(in_.since(name));
        if (node.collection_name.empty()) in_.fail("missing name of a collection");
        const Path prim = path.empty() ? anchor_ : Path::from(path).make_absolute(anchor_);
        node.collection_prim = to_stage_(prim);
        if (node.collection_prim.is_empty()) {
            node.op = Op::Nothing;
            edits_.push_back({from - 1, in_.at(), nothing});
        } else if (!path.empty()) {
            edits_.push_back({from, from + path.size(), node.collection_prim.to_string()});
        }
        return node;
    }

    Node pattern() {
        Node node;
        node.op = Op::Pattern;
        const size_t from = in_.at();
        Path prefix = in_.peek() == '/' ? Path::absolute_root() : anchor_;
        step_up(prefix);
        size_t prefix_end = in_.at();
        bool any_part = false;
        while (in_.is_good()) {
            if (in_.peek() == '/' && in_.peek(1) == '/') {
                in_.skip(2);
                PathPatternPart stretch;
                stretch.is_stretch = true;
                node.parts.push_back(stretch);
                any_part = true;
            } else if (!in_.accept('/') && any_part) {
                break;
            }
            if (!starts_part()) break;
            PathPatternPart one = part(false);
            any_part = true;
            add_part(node, prefix, std::move(one));
            if (node.parts.empty()) prefix_end = in_.at();
        }
        if (in_.is_good() && in_.peek() == '.' &&
            (is_word(in_.peek(1)) || has_wildcard(in_.text().substr(in_.at() + 1, 1)))) {
            in_.skip();
            add_part(node, prefix, part(true));
            if (node.parts.empty()) prefix_end = in_.at();
            if (in_.peek() == '/' && in_.peek(1) == '/') in_.skip(2);
        }
        node.prefix = to_stage_(prefix);
        if (node.prefix.is_empty()) {
            node.op = Op::Nothing;
            edits_.push_back({from, in_.at(), nothing});
        } else if (in_.is_good()) {
            edits_.push_back({from, prefix_end, literal(node.prefix, prefix_end)});
        }
        return node;
    }

    /// A prefix as text, with what must stand between it and the rest of the pattern.
    std::string literal(const Path& prefix, size_t prefix_end) const {
        const bool has_rest = prefix_end < in_.at();
        const char next = has_rest ? in_.text()[prefix_end] : '\0';
        const bool is_joined = !has_rest || next == '/' || next == '.';
        if (prefix.is_absolute_root()) return is_joined && has_rest ? "" : "/";
        return prefix.to_string() + (is_joined ? "" : "/");
    }

    /// "." and "../.." in front of a relative pattern.
    void step_up(Path& prefix) {
        if (in_.peek() != '.') return;
        if (in_.peek(1) != '.') {
            // Else it begins a property of the anchor
            if (!is_word(in_.peek(1)) && in_.peek(1) != '*' && in_.peek(1) != '?') in_.skip();
            return;
        }
        while (in_.peek() == '.' && in_.peek(1) == '.') {
            in_.skip(2);
            if (!prefix.is_absolute_root()) prefix = prefix.parent();
            if (in_.peek() == '/' && in_.peek(1) == '.' && in_.peek(2) == '.') in_.skip();
        }
    }

    bool starts_part() const {
        const char c = in_.peek();
        return c == '*' || c == '?' || c == '[' || c == '{' || is_word(c);
    }

    PathPatternPart part(bool is_property) {
        PathPatternPart result;
        result.is_property = is_property;
        const size_t from = in_.at();
        bool in_set = false;
        while (!in_.is_at_end()) {
            const char c = in_.peek();
            if (in_set ? c == ']' : c == '[') in_set = !in_set;
            const bool fits = in_set || is_word(c) || c == '*' || c == '?' || c == ']' ||
                              (is_property && c == ':');
            if (!fits) break;
            in_.skip();
        }
        if (in_set) in_.fail("missing ']'");
        result.text = std::string(in_.since(from));
        if (in_.accept('{')) {
            result.predicate.push_back(PredicateParser(in_).parse());
            in_.skip_blanks();
            if (!in_.accept('}')) in_.fail("missing '}'");
        }
        if (result.text.empty() && result.predicate.empty()) in_.fail("expected a name");
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

    Cursor in_;
    Path anchor_;
    const PathMapper& to_stage_;
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
