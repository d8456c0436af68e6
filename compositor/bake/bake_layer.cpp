// SPDX-License-Identifier: Apache-2.0
#include "compositor/bake/bake_layer.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <map>

namespace velatura::compositor::bake {

namespace {

/// Prims by name, in order, with the opinions of each.
struct OverPrim {
    std::map<std::string, OverPrim> children;
    const BakedLight* light = nullptr;
};

/// Names between the slashes of a prim path; bytes above 127 belong to names in UTF-8.
Result<std::vector<std::string>> names_of(const std::string& path) {
    const auto is_start = [](unsigned char c) { return std::isalpha(c) || c == '_' || c > 127; };
    const auto is_part = [&](unsigned char c) { return is_start(c) || std::isdigit(c); };
    std::vector<std::string> names;
    for (const char c : path) {
        if (c == '/') {
            names.emplace_back();
            continue;
        }
        const auto byte = static_cast<unsigned char>(c);
        const bool is_good =
            !names.empty() && (names.back().empty() ? is_start(byte) : is_part(byte));
        if (!is_good)
            return Error{"bad-prim-path",
                         fmt::format("'{}' in velatura/lights is not a prim path", path)};
        names.back() += c;
    }
    if (names.empty() ||
        std::any_of(names.begin(), names.end(), [](const auto& n) { return n.empty(); }))
        return Error{"bad-prim-path",
                     fmt::format("'{}' in velatura/lights is not a prim path", path)};
    return names;
}

/// The shortest text that reads back as the same float, which is what the inputs hold.
std::string number(double v) {
    return fmt::format("{}", float(v));
}

void print(std::string& text,
           const std::string& name,
           const OverPrim& prim,
           const std::string& color_space,
           int depth) {
    const std::string indent(size_t(4 * depth), ' ');
    text += fmt::format("{0}over \"{1}\"\n{0}{{\n", indent, name);
    if (const BakedLight* light = prim.light) {
        // A connection would win over the value
        const auto add = [&](const char* type, const std::string& input, const std::string& value) {
            text += fmt::format("{}    {} inputs:{} = {}\n", indent, type, input, value);
            if (std::find(light->connected.begin(), light->connected.end(), input) !=
                light->connected.end())
                text += fmt::format("{}    {} inputs:{}.connect = None\n", indent, type, input);
        };
        if (light->intensity) add("float", "intensity", number(*light->intensity));
        if (light->exposure) add("float", "exposure", number(*light->exposure));
        if (light->color) {
            const auto& c = *light->color;
            add("color3f", "color",
                fmt::format("({}, {}, {}){}", number(c[0]), number(c[1]), number(c[2]),
                            light->has_color_space
                                ? fmt::format(" (colorSpace = \"{}\")", color_space)
                                : std::string()));
        }
    }
    for (const auto& [child, below] : prim.children)
        print(text, child, below, color_space, depth + 1);
    text += indent + "}\n";
}

/// One line of a comment, whatever is in the names of a file.
std::string comment(std::string line) {
    std::replace_if(
        line.begin(), line.end(), [](unsigned char c) { return c < 32; }, ' ');
    return "# " + line + "\n";
}

/// Walks over the text of a layer, aware of strings, asset paths and comments.
class Scanner {
  public:
    explicit Scanner(const std::string& text, size_t at) : text_(text), at_(at) {}

    bool is_end() const { return at_ >= text_.size(); }

    size_t place() const { return at_; }

    char peek() const { return text_[at_]; }

    /// Past the next piece: a string, an asset path, a comment, a word, or one character.
    void skip() {
        const char c = peek();
        if (c == '#') {
            at_ = std::min(text_.find('\n', at_), text_.size());
        } else if (c == '"' || c == '\'') {
            const std::string three(3, c);
            skip_to(text_.compare(at_, 3, three) == 0 ? three : std::string(1, c), true);
        } else if (c == '@') {
            skip_to(text_.compare(at_, 3, "@@@") == 0 ? "@@@" : "@", false);
        } else if (is_word(c)) {
            while (!is_end() && is_word(peek())) ++at_;
        } else {
            ++at_;
        }
    }

    /// Past a value: what stands in brackets, or one piece.
    void skip_value() {
        skip_space();
        int depth = 0;
        while (!is_end()) {
            const char c = peek();
            depth += c == '[' || c == '{' || c == '('   ? 1
                     : c == ']' || c == '}' || c == ')' ? -1
                                                        : 0;
            skip();
            if (depth <= 0) return;
        }
    }

    void skip_space() {
        while (!is_end() && (std::isspace(static_cast<unsigned char>(peek())) || peek() == '='))
            ++at_;
    }

  private:
    static bool is_word(char c) {
        return std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == ':';
    }

    void skip_to(const std::string& quote, bool has_escapes) {
        at_ += quote.size();
        while (!is_end() && text_.compare(at_, quote.size(), quote) != 0)
            at_ += has_escapes && peek() == '\\' ? 2 : 1;
        at_ = std::min(at_ + quote.size(), text_.size());
    }

    const std::string& text_;
    size_t at_;
};

/// In the delimiters that the name does not hold itself.
std::string asset(const std::string& name) {
    const char* quote = name.find('@') == std::string::npos ? "@" : "@@@";
    return quote + name + quote;
}

}  // namespace

Result<std::string> bake_layer_text(const Bake& bake, const std::string& source) {
    OverPrim root;
    for (const BakedLight& light : bake.lights) {
        const auto names = names_of(light.path);
        if (!names) return names.error();
        OverPrim* prim = &root;
        for (const std::string& name : *names) prim = &prim->children[name];
        prim->light = &light;
    }
    std::string text =
        "#usda 1.0\n" + comment("A light mix of " + source +
                                " as opinions over its lights; put it above the scene.");
    for (const std::string& line : bake.left) text += comment("not baked: " + line);
    for (const std::string& line : bake.notes) text += comment("note: " + line);
    for (const auto& [name, prim] : root.children) {
        text += "\n";
        print(text, name, prim, bake.color_space, 0);
    }
    return text;
}

Result<std::string> stage_metadata(const std::string& usda) {
    if (!usda.starts_with("#usda") && !usda.starts_with("#sdf"))
        return Error{"not-usda", "not a .usda layer"};
    Scanner s(usda, 0);
    while (!s.is_end() && (s.peek() == '#' || std::isspace(static_cast<unsigned char>(s.peek()))))
        s.skip();
    if (s.is_end() || s.peek() != '(') return std::string();
    s.skip();
    std::string metadata;
    int depth = 0;
    while (!s.is_end()) {
        const size_t from = s.place();
        const char c = s.peek();
        if (depth == 0 && c == ')') return metadata;
        depth += c == '(' || c == '[' || c == '{' ? 1 : c == ')' || c == ']' || c == '}' ? -1 : 0;
        s.skip();
        const std::string piece = usda.substr(from, s.place() - from);
        if (depth == 0 && (piece == "subLayers" || piece == "relocates"))
            s.skip_value();
        else
            metadata += piece;
    }
    return Error{"not-usda", "the layer's metadata have no end"};
}

std::string stacked_layer_text(const std::string& stronger,
                               const std::string& weaker,
                               const std::string& metadata) {
    return fmt::format("#usda 1.0\n({}\n    subLayers = [\n        {},\n        {}\n    ]\n)\n",
                       metadata, asset(stronger), asset(weaker));
}

}  // namespace velatura::compositor::bake
