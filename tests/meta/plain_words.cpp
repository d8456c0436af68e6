// SPDX-License-Identifier: Apache-2.0
// Words and shapes that help, messages and the user's pages do not have.
#include "meta/rules.h"

#include <cctype>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace velatura::meta {

namespace {

struct Phrase {
    std::string_view words, better;
};

// Whole words, in any case
constexpr Phrase banned[] = {
    {"picture", "image, frame, render"},
    {"pictures", "images, frames, renders"},
    {"leave out", "skip, ignore, omit"},
    {"leaves out", "skips, ignores, omits"},
    {"left out", "skipped, ignored, omitted"},
    {"leaving out", "skipping, ignoring, omitting"},
    {"body", "solid, closed mesh, dielectric"},
    {"bodies", "solids, closed meshes, dielectrics"},
    {"matter", "medium, interior"},
    {"told apart", "distinguished"},
    {"tell apart", "distinguish"},
    {"tells apart", "distinguishes"},
    {"ask for", "request, need"},
    {"asks for", "requests, needs"},
    {"asked for", "requested"},
    {"asking for", "requesting"},
    {"know", "a verb that computers do"},
    {"knows", "a verb that computers do"},
    {"may", "can"},
    {"the most", "the maximum"},
    {"the least", "the minimum"},
    {"go on", "continue"},
    {"goes on", "continues"},
    {"going on", "continuing"},
    {"went on", "continued"},
    {"come to", "reach, be"},
    {"comes to", "reaches, is"},
    {"scatterings", "bounces, scattering events"},
    {"worth", "the figure"},
    {"is no", "is not a"},
    {"are no", "are not"},
    {"met", "hit"},
    {"meets", "hits"},
    {"means nothing", "has no effect"},
    {"not there", "not found, missing"},
    {"stand for", "be, represent"},
    {"stands for", "is, represents"},
    {"go by", "be identified by"},
    {"goes by", "is identified by"},
    {"beneath", "below"},
    {"glow", "emit"},
    {"glows", "emits"},
    {"by chance", "at random, by path tracing"},
    {"in equal time", "at equal render time"},
    {"for the same time", "at equal render time"},
    {"how many samples", "spp, samples per pixel"},
    {"has room", "stores, fits"},
    {"have room", "store, fit"},
    {"no room", "does not fit"},
    {"while working on", "at"},
    {"hold no", "have no"},
    {"holds no", "has no"},
    {"noise out of", "denoise"},
    {"spreads light", "non-specular"},
    {"bring", "provide, add"},
    {"brings", "provides, adds"},
    {"count as", "be treated as"},
    {"counts as", "is treated as"},
    {"own tree", "built-in BVH"},
    {"ledger", "biased settings"},
    {"keeps its sums", "resumable"},
    {"ways through", "paths through"},
    {"tell", "state, report, show"},
    {"tells", "states, reports, shows"},
    {"told", "reported"},
    {"say", "state, report, show"},
    {"says", "states, reports, shows"},
    {"said", "stated, reported"},
    {"somebody", "a user, a program"},
    {"nobody", "no user, no program"},
    {"whoever", "the user, the program"},
    {"glowing", "emissive"},
    {"shines", "emits, is on"},
    {"stand", "be, come"},
    {"stands", "is, comes"},
    {"lets", "allows, transmits"},
    {"brought", "provided, added"},
    {"counted as", "treated as"},
    {"give back", "undo, restore"},
    {"gives back", "undoes, restores"},
    {"come about", "result"},
    {"way round", "vice versa"},
    {"on the way", "along the path"},
    {"free way", "free path"},
    {"free ways", "free paths"},
    {"insides", "interior"},
    {"brick by brick", "per brick"},
    {"apart by", "separated by"},
    {"hard to find again", "the probability estimate hit its trial cap"},
    {"densest", "majorant"},
    {"samples ran out", "stopped at --spp"},
    {"that is cut", "truncated"},
    {"that are cut", "truncated"},
    {"another mean", "possible bias"},
    {"given again", "repeatable"},
    {"colour", "color"},
    {"colours", "colors"},
    {"coloured", "colored"},
    {"centre", "center"},
    {"centres", "centers"},
    {"neighbour", "neighbor"},
    {"neighbours", "neighbors"},
    {"neighbouring", "neighboring"},
    {"metre", "meter"},
    {"metres", "meters"},
    {"fibre", "fiber"},
    {"fibres", "fibers"},
    {"centred", "centered"},
    {"grey", "gray"},
    {"normalise", "normalize"},
    {"normalised", "normalized"},
    {"neighbourhood", "neighborhood"},
    {"behaviour", "behavior"},
    {"honour", "honor"},
    {"honoured", "honored"},
    {"favour", "favor"},
    {"labelled", "labeled"},
    {"modelled", "modeled"},
    {"travelled", "traveled"},
    {"cancelled", "canceled"},
    {"recognised", "recognized"},
    {"optimised", "optimized"},
    {"parametrisation", "parametrization"},
    {"polarisation", "polarization"},
    {"catalogue", "catalog"},
    {"licence", "license"},
    {"licences", "licenses"},
};

// What holds a banned phrase and is right
constexpr std::string_view right[] = {"there is no", "there are no", "black body", "black bodies",
                                      "may include"};

// Values of files, which do not change
constexpr std::string_view values[] = {"left out"};

struct Text {
    size_t line = 0;  ///< index
    std::string text;
};

bool is_word(char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_';
}

/// Reads string literals; adjacent ones are one. Comments, characters, #include and raw strings
/// with a delimiter, which hold code, are skipped.
class Literals {
  public:
    explicit Literals(const SourceFile& file) : file_(file) {}

    std::vector<Text> read() {
        for (line_ = 0; line_ < file_.lines.size(); ++line_) {
            const std::string& line = file_.lines[line_];
            if (!in_comment_ && !in_raw_ && line.starts_with("#include")) continue;
            read_line(line);
        }
        return std::move(found_);
    }

  private:
    void read_line(const std::string& line) {
        for (size_t i = 0; i < line.size();) {
            if (in_comment_) {
                const size_t end = line.find("*/", i);
                in_comment_ = end == std::string::npos;
                i = in_comment_ ? line.size() : end + 2;
            } else if (in_raw_) {
                const size_t end = line.find(raw_end_, i);
                in_raw_ = end == std::string::npos;
                if (keeps_raw_) found_.back().text += line.substr(i, in_raw_ ? end : end - i) + " ";
                i = in_raw_ ? line.size() : end + raw_end_.size();
            } else if (line.compare(i, 2, "//") == 0) {
                return;
            } else if (line.compare(i, 2, "/*") == 0) {
                in_comment_ = true;
                i += 2;
            } else if (line.compare(i, 2, "R\"") == 0 && (i == 0 || !is_word(line[i - 1]))) {
                i = begin_raw(line, i + 2);
            } else if (line[i] == '"') {
                i = read_string(line, i + 1);
            } else if (line[i] == '\'' && (i == 0 || !is_word(line[i - 1]))) {
                for (++i; i < line.size() && line[i] != '\''; ++i) i += line[i] == '\\';
                ++i;
                is_adjacent_ = false;
            } else {
                is_adjacent_ = is_adjacent_ && std::isspace(static_cast<unsigned char>(line[i]));
                ++i;
            }
        }
    }

    size_t begin_raw(const std::string& line, size_t i) {
        const size_t open = line.find('(', i);
        if (open == std::string::npos) return line.size();
        raw_end_ = ")" + line.substr(i, open - i) + "\"";
        keeps_raw_ = open == i;
        in_raw_ = true;
        is_adjacent_ = false;
        if (keeps_raw_) found_.push_back({line_, {}});
        return open + 1;
    }

    size_t read_string(const std::string& line, size_t i) {
        if (!is_adjacent_) found_.push_back({line_, {}});
        is_adjacent_ = true;
        for (; i < line.size() && line[i] != '"'; ++i) {
            // Escaped letters are no part of words
            if (line[i] == '\\' && i + 1 < line.size()) {
                ++i;
                found_.back().text += ' ';
            } else {
                found_.back().text += line[i];
            }
        }
        return i + 1;
    }

    const SourceFile& file_;
    std::vector<Text> found_;
    size_t line_ = 0;
    bool in_comment_ = false, in_raw_ = false, keeps_raw_ = false, is_adjacent_ = false;
    std::string raw_end_;
};

/// Lines of a page without blocks and spans of code, and without targets of links.
std::vector<Text> prose_of(const SourceFile& page) {
    std::vector<Text> found;
    bool in_block = false;
    for (size_t i = 0; i < page.lines.size(); ++i) {
        const std::string& line = page.lines[i];
        if (line.starts_with("```")) in_block = !in_block;
        if (in_block || line.starts_with("```") || line.starts_with("    ")) continue;
        Text text{i, {}};
        bool in_span = false, in_target = false;
        for (size_t k = 0; k < line.size(); ++k) {
            if (line[k] == '`') in_span = !in_span;
            if (!in_span && line.compare(k, 2, "](") == 0) in_target = true;
            text.text += in_span || in_target ? ';' : line[k];
            if (line[k] == ')') in_target = false;
        }
        found.push_back(std::move(text));
    }
    return found;
}

/// " the light is left out ; " : words in lower case with one space between, other characters as
/// words of their own; tags of HTML are skipped.
std::string words_of(const std::string& text) {
    std::string words = " ";
    bool in_tag = false;
    for (size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        if (c == '<' && i + 1 < text.size() && (text[i + 1] == '/' || is_word(text[i + 1])))
            in_tag = text.find('>', i) != std::string::npos;
        if (in_tag) {
            in_tag = c != '>';
        } else if (is_word(c) || c == '-' || c == '\'' || static_cast<unsigned char>(c) >= 0x80) {
            words += char(std::tolower(static_cast<unsigned char>(c)));
        } else if (std::isspace(static_cast<unsigned char>(c))) {
            if (words.back() != ' ') words += ' ';
        } else {
            words += words.back() == ' ' ? "; " : " ; ";
        }
    }
    return words + " ";
}

void erase_all(std::string& words, std::string_view phrase) {
    const std::string whole = " " + std::string(phrase) + " ";
    for (size_t at; (at = words.find(whole)) != std::string::npos;)
        words.replace(at, whole.size(), " ; ");
}

/// Pages for people; not those that tests write.
bool is_page_for_users(const SourceFile& file) {
    static constexpr std::string_view pages[] = {"README.md", "CONTRIBUTING.md", "SECURITY.md"};
    static constexpr std::string_view written[] = {"docs/engineering/hard_cases.md",
                                                   "docs/engineering/mutation_testing.md"};
    for (const std::string_view page : pages)
        if (file.path == page) return true;
    for (const std::string_view page : written)
        if (file.path == page) return false;
    return file.is_below("docs/") && file.ends_with(".md");
}

}  // namespace

std::vector<std::string> check_plain_words(const SourceFile& file) {
    const bool is_code =
        file.is_cpp_or_header() &&
        (file.is_below("src/") || file.is_below("compositor/") || file.is_below("plugins/"));
    if (!is_code && !is_page_for_users(file)) return {};
    std::vector<std::string> out;
    for (const Text& text : is_code ? Literals(file).read() : prose_of(file)) {
        std::string words = words_of(text.text);
        // One word is a name or a value
        if (is_code && words.find(' ', 1) >= words.size() - 2) continue;
        bool is_value = false;
        for (const std::string_view value : values) is_value = is_value || text.text == value;
        if (is_value) continue;
        for (const std::string_view phrase : right) erase_all(words, phrase);
        for (const Phrase& phrase : banned)
            if (words.find(" " + std::string(phrase.words) + " ") != std::string::npos)
                out.push_back(file.path + ":" + std::to_string(text.line + 1) + ": \"" +
                              std::string(phrase.words) +
                              "\" is not plain, say: " + std::string(phrase.better));
    }
    return out;
}

}  // namespace velatura::meta
