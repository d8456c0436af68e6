// SPDX-License-Identifier: Apache-2.0
#include "usd/text/arc_parser.h"

#include <fmt/format.h>

#include <type_traits>
#include <unordered_set>

namespace velatura::usd::text {

bool ArcParser::accept_none(ListEdit edit, bool& is_none) {
    const SourceLoc where = s_.loc();
    is_none = s_.accept_word("None");
    if (!is_none || edit == ListEdit::Explicit) return true;
    return s_.error("usd-empty-list-edit", where,
                    "found None, expected items for an edit of a list: only a list without add, "
                    "prepend, append, delete or reorder can be None");
}

bool ArcParser::layer_offset(layer::LayerOffset& offset, layer::Dictionary* custom_data) {
    return values_.statements('(', ')', [&] {
        const SourceLoc where = s_.loc();
        const std::string_view key = s_.accept_identifier();
        if (key == "customData" && custom_data) {
            return s_.expect_assignment() && values_.dictionary(*custom_data);
        }
        if (key != "offset" && key != "scale") {
            return s_.error("usd-syntax", where,
                            fmt::format("found '{}', expected 'offset', 'scale'{} or ')'",
                                        key.empty() ? std::string(1, s_.peek()) : std::string(key),
                                        custom_data ? ", 'customData'" : ""));
        }
        return s_.expect_assignment() &&
               values_.element(key == "offset" ? offset.offset : offset.scale);
    });
}

bool ArcParser::sub_layers(layer::Spec& spec, SourceLoc where) {
    std::vector<std::string> assets;
    std::vector<layer::LayerOffset> offsets;
    const auto one = [&] {
        const SourceLoc at = s_.loc();
        std::string asset;
        if (!s_.asset(asset)) return false;
        if (asset.empty())
            return s_.error("usd-value", at, "found an empty sublayer path, expected a file");
        layer::LayerOffset offset;
        s_.skip_inline();
        if (s_.peek() == '(' && !layer_offset(offset, nullptr)) return false;
        assets.push_back(std::move(asset));
        offsets.push_back(offset);
        return true;
    };
    if (!values_.bracketed('[', ']', one)) return false;
    spec.set_field(names_.sub_layers, layer::Value::array<std::string>(std::move(assets)), where);
    spec.set_field(names_.sub_layer_offsets, layer::Value(std::move(offsets)), where);
    return true;
}

bool ArcParser::absolute_path(layer::Path owner,
                              bool can_be_empty,
                              std::string_view& text,
                              layer::Path& out) {
    const SourceLoc where = s_.loc();
    if (!s_.path_text(text)) return false;
    out = {};
    if (text.empty() && can_be_empty) return true;
    const auto parsed = layer::Path::parse(text);
    if (!parsed) return s_.error("usd-path", where, parsed.error().message);
    out = parsed->make_absolute(owner.strip_variant_selections());
    return true;
}

bool ArcParser::prim_path(layer::Path owner, bool can_be_empty, layer::Path& out) {
    const SourceLoc where = s_.loc();
    std::string_view text;
    if (!absolute_path(owner, can_be_empty, text, out)) return false;
    if (text.empty()) return true;
    if (!context_.options.allow_variants_in_arc_paths && out.has_variant_selection()) {
        return s_.error("usd-path", where,
                        fmt::format("found a variant selection in path <{}>, expected none", text));
    }
    if (!out.is_prim_or_variant()) {
        return s_.error("usd-path", where,
                        fmt::format("found path <{}>, expected the path of a prim", text));
    }
    return true;
}

template <class Arc>
bool ArcParser::arc(layer::Path owner, Arc& out) {
    if (s_.peek() == '@') {
        const SourceLoc where = s_.loc();
        if (!s_.asset(out.asset)) return false;
        if (out.asset.empty())
            return s_.error("usd-value", where,
                            "found an empty asset path, expected a file, or the path of a prim of "
                            "this layer without @@ before it");
        s_.skip_inline();
        if (s_.peek() == '<' && !prim_path(owner, true, out.prim_path)) return false;
    } else if (s_.peek() == '<') {
        if (!prim_path(owner, true, out.prim_path)) return false;
    } else {
        return s_.fail("an asset path, a prim path or ']'");
    }
    s_.skip_inline();
    if (s_.peek() != '(') return true;
    if constexpr (std::is_same_v<Arc, layer::Reference>) {
        return layer_offset(out.offset, &out.custom_data);
    } else {
        return layer_offset(out.offset, nullptr);
    }
}

template <class Item, class ReadItem>
bool ArcParser::item_list(
    layer::Spec& spec, layer::Token field, ListEdit edit, SourceLoc where, const ReadItem& read) {
    std::vector<Item> items;
    const auto one = [&] {
        Item item;
        if (!read(item)) return false;
        items.push_back(std::move(item));
        return true;
    };
    bool is_none = false;
    if (!accept_none(edit, is_none)) return false;
    if (!is_none) {
        const bool ok = s_.peek() == '[' ? values_.bracketed('[', ']', one) : one();
        if (!ok) return false;
    }
    return store_list(context_, spec, field, edit, std::move(items), where);
}

bool ArcParser::references(layer::Path owner, layer::Spec& spec, ListEdit edit, SourceLoc where) {
    return item_list<layer::Reference>(
        spec, names_.references, edit, where,
        [&](layer::Reference& reference) { return arc(owner, reference); });
}

bool ArcParser::payloads(layer::Path owner, layer::Spec& spec, ListEdit edit, SourceLoc where) {
    return item_list<layer::Payload>(spec, names_.payload, edit, where,
                                     [&](layer::Payload& payload) { return arc(owner, payload); });
}

bool ArcParser::paths(
    layer::Path owner, layer::Spec& spec, layer::Token field, ListEdit edit, SourceLoc where) {
    return item_list<layer::Path>(spec, field, edit, where,
                                  [&](layer::Path& path) { return prim_path(owner, false, path); });
}

bool ArcParser::relocate_path(layer::Path owner, bool can_be_empty, layer::Path& out) {
    const SourceLoc where = s_.loc();
    std::string_view text;
    if (!absolute_path(owner, can_be_empty, text, out)) return false;
    if (text.empty()) return true;
    if (!out.is_prim() || out.has_variant_selection()) {
        return s_.error("usd-path", where,
                        fmt::format("found relocation path <{}>, expected the path of a prim "
                                    "without variant selections",
                                    text));
    }
    return true;
}

bool ArcParser::relocates(layer::Path owner,
                          layer::Spec& spec,
                          layer::Token field,
                          SourceLoc where) {
    layer::Relocates pairs;
    const bool ok = values_.bracketed('{', '}', [&] {
        layer::Path source;
        layer::Path target;
        if (!relocate_path(owner, false, source)) return false;
        s_.skip_inline();
        if (!s_.expect(':')) return false;
        s_.skip_inline();
        if (!relocate_path(owner, true, target)) return false;
        pairs.emplace_back(source, target);
        return true;
    });
    if (ok) spec.set_field(field, layer::Value(std::move(pairs)), where);
    return ok;
}

}  // namespace velatura::usd::text
