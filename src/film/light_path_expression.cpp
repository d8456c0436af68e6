// SPDX-License-Identifier: Apache-2.0
#include "film/light_path_expression.h"

#include "base/nearest_names.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <optional>

namespace velatura::film {

namespace {

constexpr std::string_view types = "CRTVLOB", scatterings = "DGS";

SymbolSet both(SymbolSet a, const SymbolSet& b) {
    for (size_t i = 0; i < a.size(); ++i) a[i] = a[i] && b[i];
    return a;
}

SymbolSet either(SymbolSet a, const SymbolSet& b) {
    for (size_t i = 0; i < a.size(); ++i) a[i] = a[i] || b[i];
    return a;
}

/// Recursive descent. What is wrong first ends the text, so that every rule comes to its end.
class Parser {
  public:
    Parser(std::string_view text, const PathSymbols& symbols, bool is_strict)
        : text_(text), symbols_(symbols), is_strict_(is_strict) {}

    Result<PathPattern> parse() {
        if (text_.size() > longest_expression)
            return Error{
                "lpe",
                fmt::format("light path expression of {} characters exceeds the maximum of {}",
                            text_.size(), longest_expression)};
        PathPattern pattern = choice(0);
        if (!is_at_end()) fail(fmt::format("unexpected {}", token()));
        if (error_) return *error_;
        return pattern;
    }

  private:
    void fail(const std::string& why) { fail_at(at_, why); }

    void fail_at(size_t where, const std::string& why) {
        if (!error_)
            error_ = Error{"lpe", fmt::format("light path expression \"{}\", column {}: {}", text_,
                                              where + 1, why)};
        at_ = text_.size();
    }

    bool is_at_end() {
        while (at_ < text_.size() && (text_[at_] == ' ' || text_[at_] == '\t')) ++at_;
        return at_ == text_.size();
    }

    /// 0 at the end.
    char peek() { return is_at_end() ? '\0' : text_[at_]; }

    bool take(char c) {
        if (peek() != c) return false;
        ++at_;
        return true;
    }

    void expect(char c, std::string_view what) {
        if (!take(c)) fail(fmt::format("expected {} {}, found {}", c, what, token()));
    }

    std::string token() { return is_at_end() ? "the end" : fmt::format("\"{}\"", text_[at_]); }

    PathPattern choice(int depth) {
        PathPattern all;
        all.kind = PathPattern::Kind::Choice;
        if (depth > deepest_expression) {
            fail(fmt::format("brackets are nested deeper than {}", deepest_expression));
            return all;
        }
        do all.parts.push_back(sequence(depth));
        while (take('|'));
        return all;
    }

    PathPattern sequence(int depth) {
        PathPattern all;
        all.kind = PathPattern::Kind::Sequence;
        while (peek() != '\0' && peek() != '|' && peek() != ')')
            all.parts.push_back(repeated(item(depth)));
        if (all.parts.empty()) fail(fmt::format("expected an event, found {}", token()));
        return all;
    }

    PathPattern item(int depth) {
        if (!take('(')) {
            PathPattern one;
            one.event = event();
            return one;
        }
        PathPattern inside = choice(depth + 1);
        expect(')', "to close the bracket");
        return inside;
    }

    PathPattern repeated(PathPattern part) {
        PathPattern all;
        all.kind = PathPattern::Kind::Repeat;
        if (take('*')) {
            all.max = -1;
        } else if (take('+')) {
            all.min = 1;
            all.max = -1;
        } else if (peek() == '?') {
            fail("? is not supported: write {0,1}");
        } else if (take('{')) {
            all.min = all.max = number();
            if (take(',')) all.max = peek() == '}' ? -1 : number();
            if (all.max >= 0 && all.max < all.min) fail("the second count is below the first");
            expect('}', "after the count");
        } else {
            return part;
        }
        if (std::string_view("*+{?").find(peek()) != std::string_view::npos && peek() != '\0')
            fail(fmt::format("{} repeats a repetition; put it in ( )", token()));
        all.parts.push_back(std::move(part));
        return all;
    }

    int number() {
        peek();
        const char* const begin = text_.data() + at_;
        int value = 0;
        const auto [end, failed] = std::from_chars(begin, text_.data() + text_.size(), value);
        if (failed != std::errc() || value < 0 || value > largest_repeat) {
            fail(fmt::format("expected a count of 0 to {}", largest_repeat));
            return 0;
        }
        at_ += size_t(end - begin);
        return value;
    }

    /// One event: a letter, '.', 'label', <...>, or a set of these.
    SymbolSet event() {
        if (take('[')) return set([this] { return single(); });
        return single();
    }

    SymbolSet single() {
        if (take('<')) return group();
        if (peek() == '\'') return label();
        return letter(types, scatterings);
    }

    /// What is between [ and ].
    template <class Member>
    SymbolSet set(const Member& member) {
        const bool is_negated = take('^');
        SymbolSet all = member();
        while (peek() != ']' && peek() != '\0') all = either(std::move(all), member());
        expect(']', "to close the set");
        if (!is_negated) return all;
        all.flip();
        // The camera begins every path and is not among what may come instead
        all[PathSymbols::camera] = false;
        return all;
    }

    /// What is between < and >: type, scattering, label; those left out may be any.
    SymbolSet group() {
        SymbolSet all = any();
        const auto slot = [this, &all](const auto& member) {
            if (peek() == '>' || peek() == '\0') return;
            all = both(std::move(all), take('[') ? set(member) : member());
        };
        if (peek() != '\'') slot([this] { return letter(types, ""); });
        if (peek() != '\'') slot([this] { return letter("", scatterings); });
        slot([this] { return peek() == '\'' ? label() : letter("", ""); });
        expect('>', "to close the event, which has a type, a scattering letter and one label");
        return all;
    }

    SymbolSet any() const { return SymbolSet(symbols_.count(), true); }

    /// One of some letters, or '.'.
    SymbolSet letter(std::string_view some_types, std::string_view some_scatterings) {
        const char c = peek();
        if (take('.')) return any();
        if (c != '\0' && some_types.find(c) != std::string_view::npos) {
            ++at_;
            return symbols_.of_type(c);
        }
        if (c != '\0' && some_scatterings.find(c) != std::string_view::npos) {
            ++at_;
            return symbols_.of_scattering(c, is_strict_);
        }
        fail(fault_of(c, some_types, some_scatterings));
        return symbols_.none();
    }

    std::string fault_of(char c, std::string_view some_types, std::string_view some_scatterings) {
        if (c == 's') return "s matches nothing: straight transmission is not an event here";
        if (c == '<') return "groups within < > are not supported";
        if (c == 'A') return "A (albedo) is not supported: the layer `albedo` has it";
        std::string expected =
            some_types.empty() && some_scatterings.empty() ? "a label in ' '" : "one of";
        for (const std::string_view letters : {some_types, some_scatterings})
            for (const char letter : letters) expected += fmt::format(" {}", letter);
        return fmt::format("expected {} or '.', found {}", expected, token());
    }

    SymbolSet label() {
        peek();
        const size_t begin = at_;
        expect('\'', "before the label");
        const size_t end = text_.find('\'', at_);
        if (end == std::string_view::npos) {
            fail_at(begin, "expected ' to close the label");
            return symbols_.none();
        }
        const std::string word(text_.substr(at_, end - at_));
        at_ = end + 1;
        SymbolSet all = symbols_.of_label(word);
        if (word == "env" || std::find(all.begin(), all.end(), true) != all.end()) return all;
        fail_at(begin, fmt::format("unknown light group or lobe '{}'{}", word,
                                   did_you_mean(word, symbols_.labels())));
        return symbols_.none();
    }

    std::string_view text_;
    const PathSymbols& symbols_;
    bool is_strict_;
    size_t at_ = 0;
    std::optional<Error> error_;
};

bool take_prefix(std::string_view& text, std::string_view prefix) {
    while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
    if (!text.starts_with(prefix)) return false;
    text.remove_prefix(prefix.size());
    return true;
}

}  // namespace

accumulate::PathLayer make_path_layer(std::string name, std::string_view text, std::string family) {
    using Light = accumulate::PathLayer::Light;
    take_prefix(text, "lpe:");
    Light light = Light::Arriving;
    if (take_prefix(text, "unoccluded;"))
        light = Light::Unoccluded;
    else if (take_prefix(text, "shadow;") || take_prefix(text, "shadows;"))
        light = Light::Shadow;
    return {std::move(name), std::string(text), light, std::move(family)};
}

Result<PathPattern> parse_path_expression(std::string_view text,
                                          const PathSymbols& symbols,
                                          bool is_strict) {
    return Parser(text, symbols, is_strict).parse();
}

}  // namespace velatura::film
