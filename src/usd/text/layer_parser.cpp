// SPDX-License-Identifier: Apache-2.0
#include "usd/text/layer_parser.h"

#include "usd/text/list_edit.h"

#include <fmt/format.h>

namespace velatura::usd::text {

namespace {

constexpr std::string_view byte_order_mark = "\xef\xbb\xbf";
constexpr size_t max_errors = 100;

std::string_view without_mark(std::string_view bytes) {
    if (bytes.starts_with(byte_order_mark)) bytes.remove_prefix(byte_order_mark.size());
    return bytes;
}

}  // namespace

Result<std::shared_ptr<layer::Layer>> read_text_layer(std::string_view bytes,
                                                      std::string identifier,
                                                      Diagnostics& diagnostics,
                                                      const TextOptions& options) {
    const uint32_t file_id = diagnostics.file_id(identifier);
    auto result = std::make_shared<layer::Layer>(identifier);
    result->set_file_id(file_id);
    LayerParser parser(without_mark(bytes), file_id, *result, diagnostics, options);
    parser.parse();
    if (parser.error_count() > 0) {
        return Error{
            "usd-parse",
            fmt::format("found {} error{} in layer @{}@, expected a text layer",
                        parser.error_count(), parser.error_count() == 1 ? "" : "s", identifier)};
    }
    return result;
}

LayerParser::LayerParser(std::string_view text,
                         uint32_t file_id,
                         layer::Layer& layer,
                         Diagnostics& diagnostics,
                         const TextOptions& options)
    : context_(text, file_id, layer, diagnostics, options),
      s_(context_.scanner),
      layer_(layer),
      names_(context_.names),
      metadata_(context_),
      properties_(context_, metadata_) {}

void LayerParser::parse() {
    layer_.pseudo_root().set_loc(s_.loc());
    if (!s_.check_utf8() || !header()) return;
    s_.skip_lines();
    const Scanner::Mark start = s_.mark();
    if (s_.peek() == '(' && !metadata_.block(layer::Path::absolute_root(), layer_.pseudo_root()))
        s_.recover(start);
    while (s_.error_count() < max_errors) {
        s_.skip_lines();
        if (s_.at_end()) return;
        const Scanner::Mark item = s_.mark();
        if (layer_item()) continue;
        s_.recover(item);
        // A brace too many would stop recovery at the same place for ever
        s_.accept('}');
    }
}

bool LayerParser::header() {
    const auto word = [&](std::string_view expected) {
        for (size_t i = 0; i < expected.size(); ++i) {
            if (s_.peek(i) != expected[i]) return false;
        }
        for (const char c : expected) s_.accept(c);
        return true;
    };
    context_.is_legacy = word("#sdf ");
    if (!context_.is_legacy && !word("#usda ")) return s_.fail("'#usda 1.0' as the first line");
    while (s_.accept(' ') || s_.accept('\t')) {
    }
    const SourceLoc where = s_.loc();
    std::string version;
    while ((s_.peek() >= '0' && s_.peek() <= '9') || s_.peek() == '.') {
        version += s_.peek();
        s_.accept(s_.peek());
    }
    const bool is_known = context_.is_legacy ? version.starts_with("1.")
                                             : version == "1.0" || version.starts_with("1.0.");
    if (!is_known && !version.starts_with("1.")) {
        return s_.error(
            "usd-version", where,
            fmt::format("found version '{}' of the text format, expected 1.0", version));
    }
    if (!is_known) {
        s_.warn(
            "usd-version", where,
            fmt::format("found version '{}' of the text format, expected 1.0; reading it as 1.0",
                        version));
    }
    s_.skip_inline();
    if (!s_.at_line_end()) return s_.fail("the end of the line after the version");
    return true;
}

bool LayerParser::layer_item() {
    const SourceLoc where = s_.loc();
    if (s_.accept_word("reorder")) {
        s_.skip_inline();
        if (!s_.accept_word("rootPrims")) return s_.fail("'rootPrims'");
        return parse_name_order(context_, layer::Path::absolute_root(), names_.prim_order, where) &&
               statement_end();
    }
    const std::string_view word = s_.peek_identifier();
    if (word == "def" || word == "over" || word == "class") {
        return prim(layer::Path::absolute_root()) && line_end("a prim");
    }
    return s_.fail("'def', 'over', 'class' or 'reorder'");
}

bool LayerParser::statement_end() {
    s_.skip_inline();
    return s_.accept(';') || s_.at_line_end() || s_.fail("';' or the end of the line");
}

bool LayerParser::line_end(std::string_view after) {
    s_.skip_inline();
    return s_.at_line_end() || s_.fail(fmt::format("the end of the line after {}", after));
}

// The heads are functions of their own to keep the frames of the recursion small
bool LayerParser::prim(layer::Path parent) {
    layer::Path path;
    return prim_head(parent, path) && block(path);
}

bool LayerParser::prim_head(layer::Path parent, layer::Path& path) {
    const SourceLoc where = s_.loc();
    const std::string_view word = s_.accept_identifier();
    const layer::Specifier specifier = word == "def"    ? layer::Specifier::Def
                                       : word == "over" ? layer::Specifier::Over
                                                        : layer::Specifier::Class;
    s_.skip_inline();
    std::string type_name;
    const SourceLoc type_loc = s_.loc();
    if (!s_.at_string() && !s_.type_identifier(type_name)) return false;
    s_.skip_inline();
    const SourceLoc name_loc = s_.loc();
    std::string name;
    if (!s_.string(name)) return false;
    if (!layer::is_identifier(name)) {
        return s_.error("usd-prim-name", name_loc,
                        fmt::format("found prim name \"{}\", expected an identifier", name));
    }
    path = parent.append_child(name);
    if (path.is_empty()) return s_.fail("fewer levels of prims");
    if (layer_.has_spec(path)) {
        return s_.error(
            "usd-duplicate-prim", name_loc,
            fmt::format("found a second prim <{}> in this layer, expected one", path.to_string()));
    }
    layer::Spec& spec = layer_.create_spec(path, layer::SpecKind::Prim, where);
    spec.set_field(names_.specifier, layer::Value(specifier), where);
    // Sdf's stand-in for "any type"
    if (!type_name.empty() && type_name != "__AnyType__") {
        spec.set_field(names_.type_name, layer::Value(layer::Token(type_name)), type_loc);
    }
    s_.skip_lines();
    return s_.peek() != '(' || metadata_.block(path, spec);
}

bool LayerParser::block(layer::Path owner) {
    s_.skip_lines();
    if (!s_.expect('{')) return false;
    if (prim_depth_ >= max_prim_depth) return s_.too_deep("nested prims", max_prim_depth);
    ++prim_depth_;
    contents(owner);
    --prim_depth_;
    if (s_.expect('}')) return true;
    // One brace too few leaves every block around open
    if (s_.at_end()) s_.stop();
    return false;
}

void LayerParser::contents(layer::Path owner) {
    while (s_.error_count() < max_errors) {
        s_.skip_lines();
        if (s_.at_end() || s_.peek() == '}') return;
        const Scanner::Mark item = s_.mark();
        if (!contents_item(owner)) s_.recover(item);
    }
}

bool LayerParser::contents_item(layer::Path owner) {
    const std::string_view word = s_.peek_identifier();
    if (word == "def" || word == "over" || word == "class")
        return prim(owner) && line_end("a prim");
    if (word == "variantSet") return variant_set(owner) && line_end("a variant set");
    return properties_.parse(owner) && statement_end();
}

bool LayerParser::variant_set(layer::Path owner) {
    const SourceLoc where = s_.loc();
    s_.accept_identifier();
    s_.skip_inline();
    const SourceLoc name_loc = s_.loc();
    std::string name;
    if (!s_.string(name)) return false;
    if (!layer::is_identifier(name)) {
        return s_.error("usd-variant-set-name", name_loc,
                        fmt::format("found variant set name \"{}\", expected an identifier", name));
    }
    if (!s_.expect_assignment()) return false;
    s_.skip_lines();
    const layer::Token set(name);
    const layer::Path path = owner.append_variant_selection(set, {});
    if (path.is_empty()) return s_.fail("fewer levels of prims");
    layer_.create_spec(path, layer::SpecKind::VariantSet, where);
    if (!s_.expect('{')) return false;
    s_.skip_lines();
    while (s_.peek() != '}' || s_.at_end()) {
        layer::Path variant;
        if (!variant_head(owner, set, variant) || !block(variant)) return false;
        s_.skip_lines();
    }
    return s_.expect('}');
}

bool LayerParser::variant_head(layer::Path owner, layer::Token set, layer::Path& path) {
    const SourceLoc where = s_.loc();
    std::string name;
    if (!s_.string(name)) return false;
    if (!layer::is_variant_name(name)) {
        return s_.error(
            "usd-variant-name", where,
            fmt::format(
                "found variant name \"{}\", expected letters, digits, '_', '-' and '|' after "
                "an optional '.'",
                name));
    }
    path = owner.append_variant_selection(set, layer::Token(name));
    layer::Spec& spec = layer_.create_spec(path, layer::SpecKind::Variant, where);
    s_.skip_lines();
    return s_.peek() != '(' || metadata_.block(path, spec);
}

}  // namespace velatura::usd::text
