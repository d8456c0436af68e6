// SPDX-License-Identifier: Apache-2.0
#include "usd/layer/path.h"

#include <fmt/format.h>

namespace velatura::usd::layer {

namespace {

constexpr int max_target_nesting = 16;

/// Recursive descent over one path text. Ref: AOUSD Core Specification 1.0.1, 8.4 (path grammar).
class PathParser {
  public:
    explicit PathParser(std::string_view text) : text_(text) {}

    Result<Path> parse() {
        Path path = parse_path(0);
        if (problem_.empty() && at_ != text_.size()) fail("end of path");
        if (!problem_.empty()) return Error{"usd-path", problem_};
        return path;
    }

  private:
    bool at_end() const { return at_ >= text_.size(); }

    char peek(size_t ahead = 0) const {
        return at_ + ahead < text_.size() ? text_[at_ + ahead] : '\0';
    }

    bool accept(char c) {
        if (peek() != c || at_end()) return false;
        ++at_;
        return true;
    }

    bool accept_word(std::string_view word) {
        if (text_.substr(at_, word.size()) != word) return false;
        at_ += word.size();
        return true;
    }

    Path fail(std::string_view expected) {
        if (problem_.empty()) {
            const std::string found =
                at_end() ? "the end" : fmt::format("'{}'", text_.substr(at_, 12));
            problem_ = fmt::format("found {} at character {} of path <{}>, expected {}", found,
                                   at_ + 1, text_, expected);
        }
        return {};
    }

    void skip_spaces() {
        while (peek() == ' ' || peek() == '\t') ++at_;
    }

    /// Longest run of identifier characters here; empty when there is none.
    std::string_view identifier() {
        const size_t begin = at_;
        for (size_t length = 0; !at_end(); at_ += length) {
            const uint32_t c = decode_utf8(text_, at_, length);
            if (!(at_ == begin ? c == '_' || is_xid_start(c) : is_xid_continue(c))) break;
        }
        return text_.substr(begin, at_ - begin);
    }

    std::string_view namespaced_identifier() {
        const size_t begin = at_;
        if (identifier().empty()) return {};
        while (peek() == ':') {
            ++at_;
            if (identifier().empty()) return {};
        }
        return text_.substr(begin, at_ - begin);
    }

    std::string_view variant_name() {
        const size_t begin = at_;
        if (peek() == '.') ++at_;
        for (size_t length = 0; !at_end(); at_ += length) {
            const uint32_t c = decode_utf8(text_, at_, length);
            if (c != '|' && c != '-' && !is_xid_continue(c)) break;
        }
        return text_.substr(begin, at_ - begin);
    }

    Path parse_path(int nesting) {
        if (nesting > max_target_nesting) return fail("fewer nested targets");
        if (accept('/')) {
            const Path root = Path::absolute_root();
            if (at_end() || peek() == ']') return root;
            return prim_elements(root, nesting);
        }
        Path path = Path::relative_root();
        if (peek() == '.' && peek(1) != '.') {
            if (at_ + 1 >= text_.size() || peek(1) == ']') {
                ++at_;
                return path;
            }
            return property_elements(path, nesting);
        }
        while (peek() == '.' && peek(1) == '.') {
            at_ += 2;
            path = path.parent();
            if (path.is_empty()) return fail("fewer elements");
            if (!accept('/')) return path;
            if (peek() == '.' && peek(1) != '.') return property_elements(path, nesting);
        }
        return prim_elements(path, nesting);
    }

    Path prim_elements(Path path, int nesting) {
        while (true) {
            const std::string_view name = identifier();
            if (name.empty()) return fail("a prim name");
            path = path.append_child(Token(name));
            bool has_selection = false;
            while (peek() == '{') {
                path = variant_selection(path);
                if (path.is_empty()) return fail("fewer elements");
                has_selection = true;
            }
            if (path.is_empty()) return fail("fewer elements");
            if (peek() == '.') return property_elements(path, nesting);
            if (at_end() || peek() == ']') return path;
            // The selection's brace already parts it from the child's name
            if (has_selection && peek() != '/') continue;
            if (!accept('/')) return fail("'/', '.', '{' or the end");
        }
    }

    Path variant_selection(Path path) {
        ++at_;
        skip_spaces();
        const std::string_view set = variant_set_name();
        if (set.empty()) return fail("a variant set name");
        skip_spaces();
        if (!accept('=')) return fail("'='");
        skip_spaces();
        const std::string_view variant = variant_name();
        skip_spaces();
        if (!accept('}')) return fail("'}'");
        return path.append_variant_selection(Token(set), Token(variant));
    }

    /// Identifier that may hold '-' after its first character.
    std::string_view variant_set_name() {
        const size_t begin = at_;
        if (identifier().empty()) return {};
        while (peek() == '-') {
            ++at_;
            for (size_t length = 0; !at_end(); at_ += length) {
                if (!is_xid_continue(decode_utf8(text_, at_, length))) break;
            }
        }
        return text_.substr(begin, at_ - begin);
    }

    Path property_elements(Path path, int nesting) {
        ++at_;
        const std::string_view name = namespaced_identifier();
        if (name.empty()) return fail("a property name");
        path = path.append_property(Token(name));
        while (!path.is_empty() && !at_end() && peek() != ']') {
            if (path.is_property() && accept('[')) {
                path = target(path, nesting, false);
            } else if (path.is_property() && accept_word(".mapper[")) {
                path = target(path, nesting, true);
            } else if (path.is_property() && accept_word(".expression")) {
                path = path.append_expression();
            } else if ((path.is_target() || path.kind() == PathKind::Mapper) && accept('.')) {
                const std::string_view inner = namespaced_identifier();
                if (inner.empty()) return fail("a property name");
                path = path.is_target() ? path.append_relational_attribute(Token(inner))
                                        : path.append_mapper_argument(Token(inner));
            } else {
                return fail("'.', '[' or the end");
            }
        }
        return path.is_empty() ? fail("fewer elements") : path;
    }

    Path target(Path path, int nesting, bool is_mapper) {
        const Path inner = parse_path(nesting + 1);
        if (!problem_.empty()) return {};
        if (!accept(']')) return fail("']'");
        return is_mapper ? path.append_mapper(inner) : path.append_target(inner);
    }

    std::string_view text_;
    size_t at_ = 0;
    std::string problem_;
};

}  // namespace

Result<Path> Path::parse(std::string_view text) {
    if (text.empty()) return Error{"usd-path", "found an empty path, expected a path"};
    return PathParser(text).parse();
}

}  // namespace velatura::usd::layer
