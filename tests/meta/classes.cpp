// SPDX-License-Identifier: Apache-2.0
#include "meta/classes.h"

#include "meta/house.h"

#include <algorithm>
#include <cctype>
#include <map>
#include <set>
#include <string_view>
#include <utility>

namespace velatura::meta {

namespace {

struct CodeToken {
    std::string text;
    size_t line = 0;
};

/// Names and single characters of C++; no comments, directives and literals.
class Scanner {
  public:
    explicit Scanner(const SourceFile& file) {
        for (const std::string& line : file.lines) text_ += line + "\n";
    }

    std::vector<CodeToken> tokens() {
        std::vector<CodeToken> out;
        while (skip_blank()) {
            const char c = text_[at_];
            if (c == '"') {
                skip_string(!out.empty() && at_ > 0 && out.back().text == "R" &&
                            text_[at_ - 1] == 'R');
            } else if (c == '\'') {
                skip_quoted('\'');
            } else {
                const size_t begin = at_++;
                // A number may hold separators: 1'000
                const bool is_number = std::isdigit(static_cast<unsigned char>(c)) != 0;
                while (is_word(c) && (is_word(text_[at_]) || (is_number && text_[at_] == '\'')))
                    ++at_;
                out.push_back({text_.substr(begin, at_ - begin), line_});
            }
        }
        return out;
    }

  private:
    static bool is_word(char c) {
        return c == '_' || std::isalnum(static_cast<unsigned char>(c)) != 0;
    }

    bool starts(std::string_view word) const {
        return std::string_view(text_).substr(at_).starts_with(word);
    }

    /// Goes to the end of `word` or of the text.
    void skip_past(std::string_view word) {
        const size_t found = text_.find(word, at_);
        const size_t end = found == std::string::npos ? text_.size() : found + word.size();
        line_ += size_t(std::count(text_.begin() + long(at_), text_.begin() + long(end), '\n'));
        at_ = end;
    }

    /// Goes to the next token; false at the end.
    bool skip_blank() {
        for (; at_ < text_.size();) {
            if (starts("//")) {
                at_ = text_.find('\n', at_);
            } else if (starts("/*")) {
                skip_past("*/");
            } else if (text_[at_] == '\n') {
                ++line_;
                ++at_;
                is_line_start_ = true;
            } else if (text_[at_] == '#' && is_line_start_) {
                skip_directive();
            } else if (std::isspace(static_cast<unsigned char>(text_[at_]))) {
                ++at_;
            } else {
                is_line_start_ = false;
                return true;
            }
        }
        return false;
    }

    void skip_directive() {
        do {
            skip_past("\n");
        } while (at_ >= 2 && text_[at_ - 2] == '\\' && at_ < text_.size());
        is_line_start_ = true;
    }

    void skip_quoted(char quote) {
        for (++at_; at_ < text_.size() && text_[at_] != quote && text_[at_] != '\n'; ++at_)
            if (text_[at_] == '\\') ++at_;
        if (at_ < text_.size() && text_[at_] == quote) ++at_;
    }

    void skip_string(bool is_raw) {
        if (!is_raw) return skip_quoted('"');
        const size_t open = text_.find('(', at_);
        skip_past(")" + text_.substr(at_ + 1, open - at_ - 1) + "\"");
    }

    std::string text_;
    size_t at_ = 0, line_ = 1;
    bool is_line_start_ = true;
};

using Statement = std::vector<std::string>;

/// Index after the bracket that closes the one at `open`.
size_t after_closing(const Statement& words,
                     size_t open,
                     std::string_view left,
                     std::string_view right) {
    int depth = 0;
    for (size_t i = open; i < words.size(); ++i) {
        if (words[i] == left) ++depth;
        if (words[i] == right && --depth == 0) return i + 1;
    }
    return words.size();
}

/// The statement without template <...>, [[...]], alignas(...) and what is between < and >.
Statement skeleton(const Statement& words) {
    Statement out;
    for (size_t i = 0; i < words.size();) {
        const bool is_after_name =
            !out.empty() && out.back() != "operator" &&
            (std::isalnum(static_cast<unsigned char>(out.back()[0])) || out.back()[0] == '_');
        if (words[i] == "alignas" && i + 1 < words.size()) {
            i = after_closing(words, i + 1, "(", ")");
        } else if (words[i] == "[" && i + 1 < words.size() && words[i + 1] == "[") {
            i = after_closing(words, i, "[", "]");
        } else if (words[i] == "<" && is_after_name) {
            if (out.back() == "template") out.pop_back();
            i = after_closing(words, i, "<", ">");
        } else {
            out.push_back(words[i++]);
        }
    }
    return out;
}

/// The name of the class whose body follows; empty: something else does.
std::string name_of_class(const Statement& statement) {
    const Statement words = skeleton(statement);
    const auto is_class = [](const std::string& w) { return w == "class" || w == "struct"; };
    const auto key = std::find_if(words.begin(), words.end(), is_class);
    if (key == words.end() || std::find(words.begin(), key, "enum") != key) return {};
    std::string name = "unnamed";
    for (auto word = key + 1; word != words.end() && *word != ":" && *word != "final"; ++word) {
        if (*word == "(" || *word == "=") return {};
        name = *word;
    }
    return name;
}

/// Whether the member is a function.
bool is_method(const Statement& statement) {
    static const std::set<std::string> others = {"using",  "typedef", "friend",   "static_assert",
                                                 "enum",   "class",   "struct",   "union",
                                                 "public", "private", "protected"};
    const Statement words = skeleton(statement);
    if (words.empty() || others.contains(words[0])) return false;
    for (size_t i = 0; i < words.size(); ++i) {
        if (words[i] == "operator") return true;
        if (words[i] == "=") return false;
        // Not a pointer to a function
        if (words[i] == "(") return i + 1 == words.size() || words[i + 1] != "*";
    }
    return false;
}

/// Follows the braces of a file and counts what it meets in the bodies of classes.
class Counter {
  public:
    std::vector<ClassSize> count(const std::vector<CodeToken>& tokens) {
        scopes_.push_back({});
        for (size_t i = 0; i < tokens.size(); ++i) {
            const std::string& word = tokens[i].text;
            const std::string& next = i + 1 < tokens.size() ? tokens[i + 1].text : "";
            if (word == "{") {
                open(tokens[i].line);
            } else if (word == "}") {
                close(next);
            } else if (word == ";" && scope().parentheses == 0) {
                end_statement();
            } else if (word == ":" && is_access()) {
                scope().is_private = scope().statement[0] == "private";
                scope().statement.clear();
            } else {
                if (word == "(") ++scope().parentheses;
                if (word == ")") --scope().parentheses;
                scope().statement.push_back(word);
            }
        }
        return std::move(found_);
    }

  private:
    struct Scope {
        bool is_class = false, is_private = false;
        ClassSize size;
        Statement statement;  ///< since the last one that ended
        int parentheses = 0;
    };

    Scope& scope() { return scopes_.back(); }

    bool is_access() {
        const Statement& words = scope().statement;
        return scope().is_class && words.size() == 1 &&
               (words[0] == "public" || words[0] == "private" || words[0] == "protected");
    }

    void end_statement() {
        if (scope().is_class && scope().is_private && is_method(scope().statement))
            ++scope().size.private_methods;
        scope().statement.clear();
    }

    void open(size_t line) {
        Scope inner;
        if (scope().parentheses == 0) {
            inner.size.name = name_of_class(scope().statement);
            inner.size.line = line;
            inner.is_class = !inner.size.name.empty();
            const Statement& words = scope().statement;
            inner.is_private = inner.is_class &&
                               std::find(words.begin(), words.end(), "class") != words.end() &&
                               std::find(words.begin(), words.end(), "struct") == words.end();
        }
        // Outside of a class nothing that stands before a brace is counted
        if (!scope().is_class && scope().parentheses == 0) scope().statement.clear();
        scopes_.push_back(std::move(inner));
    }

    void close(const std::string& next) {
        if (scopes_.size() == 1) return;
        const Scope inner = std::move(scopes_.back());
        scopes_.pop_back();
        if (inner.is_class) found_.push_back(inner.size);
        if (!scope().is_class || scope().parentheses > 0) return;
        // Initializers go on: of members in constructors, and of variables
        const bool goes_on = next == "," || next == "{" || next == ";" || next == ")";
        if (!inner.is_class && !goes_on && is_method(scope().statement)) end_statement();
    }

    std::vector<Scope> scopes_;
    std::vector<ClassSize> found_;
};

}  // namespace

std::vector<ClassSize> classes_of(const SourceFile& file) {
    if (!file.is_cpp_or_header()) return {};
    return Counter().count(Scanner(file).tokens());
}

std::vector<std::string> check_private_methods(const SourceFile& file) {
    constexpr size_t limit = 25;
    if (tier_of(file.path).empty() && !file.is_below("plugins/")) return {};
    std::vector<std::string> out;
    for (const ClassSize& c : classes_of(file))
        if (c.private_methods > limit)
            out.push_back(file.path + ":" + std::to_string(c.line) + ": " + c.name + " has " +
                          std::to_string(c.private_methods) + " private methods, more than " +
                          std::to_string(limit));
    return out;
}

std::vector<TierSize> tier_sizes(const std::vector<SourceFile>& tree) {
    std::map<std::string, TierSize> sizes;
    std::map<std::string, std::vector<size_t>> lengths;
    for (const SourceFile& file : tree) {
        const std::string tier = tier_of(file.path);
        if (tier.empty() || !file.is_cpp_or_header()) continue;
        TierSize& size = sizes[tier];
        size.tier = tier;
        ++size.files;
        size.lines += file.lines.size();
        lengths[tier].push_back(file.lines.size());
        const bool is_data = file.ends_with("_tables.cpp");
        if (!is_data && file.lines.size() > size.largest_file_lines) {
            size.largest_file = file.path.substr(file.path.rfind('/') + 1);
            size.largest_file_lines = file.lines.size();
        }
        size.upward_includes += check_tier_includes(file).size();
        for (const ClassSize& one : classes_of(file))
            if (one.private_methods > size.largest_class.private_methods) size.largest_class = one;
    }
    std::vector<TierSize> out;
    for (auto& [tier, size] : sizes) {
        std::vector<size_t>& all = lengths[tier];
        std::sort(all.begin(), all.end());
        size.median_lines = all[all.size() / 2];
        out.push_back(size);
    }
    return out;
}

std::string tier_size_table(const std::vector<TierSize>& sizes) {
    std::string text =
        "| tier | files | lines | median | largest file | upward includes | "
        "private methods, at most |\n|---|---|---|---|---|---|---|\n";
    const auto cell = [](size_t number) { return std::to_string(number) + " | "; };
    for (const TierSize& s : sizes) {
        text += "| " + s.tier + " | " + cell(s.files) + cell(s.lines) + cell(s.median_lines) +
                s.largest_file + " " + cell(s.largest_file_lines) + cell(s.upward_includes);
        const ClassSize& c = s.largest_class;
        text +=
            c.name.empty() ? "0 |\n" : c.name + " " + std::to_string(c.private_methods) + " |\n";
    }
    return text;
}

}  // namespace velatura::meta
