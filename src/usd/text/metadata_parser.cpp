// SPDX-License-Identifier: Apache-2.0
#include "usd/text/metadata_parser.h"

#include "usd/text/metadata_schema.h"

#include <fmt/format.h>

#include <charconv>
#include <limits>
#include <system_error>

namespace velatura::usd::text {

namespace {

constexpr std::string_view unit_names[] = {"mm", "cm", "dm",  "m",   "km", "in",     "ft",
                                           "yd", "mi", "deg", "rad", "%",  "default"};

}  // namespace

bool MetadataParser::block(layer::Path owner, layer::Spec& spec) {
    if (!s_.expect('(')) return false;
    s_.skip_lines();
    bool is_broken = false;
    while (s_.peek() != ')' || s_.at_end()) {
        const Scanner::Mark item = s_.mark();
        if (next_item(owner, spec) && item_end()) {
            is_broken = false;
        } else {
            // Two in a row: rather the block itself is broken, and what follows is no metadata
            if (is_broken || s_.at_end()) return false;
            is_broken = true;
            s_.recover(item, ')');
        }
        s_.skip_lines();
    }
    return s_.expect(')');
}

bool MetadataParser::item_end() {
    s_.skip_inline();
    if (s_.peek() == ')' || s_.accept(';') || (s_.at_line_end() && !s_.at_end())) return true;
    return s_.fail("';', ')' or the end of the line");
}

bool MetadataParser::next_item(layer::Path owner, layer::Spec& spec) {
    const SourceLoc where = s_.loc();
    if (s_.at_string()) return string_field(spec, names_.comment, where);
    const ListEdit edit = accept_list_edit(s_);
    if (edit != ListEdit::Explicit) s_.skip_inline();
    const std::string key(s_.accept_identifier());
    if (key.empty()) return s_.fail("the name of a metadata field or ')'");
    if (!s_.expect_assignment()) return false;
    bool is_special = true;
    if (!special_item(owner, spec, key, edit, where, is_special)) return false;
    return is_special || plain_item(spec, key, edit, where);
}

bool MetadataParser::special_item(layer::Path owner,
                                  layer::Spec& spec,
                                  const std::string& key,
                                  ListEdit edit,
                                  SourceLoc where,
                                  bool& is_special) {
    using layer::SpecKind;
    is_special = true;
    const SpecKind kind = spec.kind();
    const bool is_plain = edit == ListEdit::Explicit;
    if (key == "doc" && is_plain) return string_field(spec, names_.documentation, where);
    if (key == "permission" && is_plain) {
        const SourceLoc at = s_.loc();
        const std::string_view word = s_.peek_identifier();
        if (word != "public" && word != "private") return s_.fail("public or private");
        s_.accept_identifier();
        const auto value =
            word == "public" ? layer::Permission::Public : layer::Permission::Private;
        spec.set_field(names_.permission, layer::Value(value), at);
        return true;
    }
    if (key == "symmetryFunction" && is_plain) return word_field(spec, layer::Token(key), where);
    if (kind == SpecKind::Attribute && key == "displayUnit" && is_plain) {
        const SourceLoc at = s_.loc();
        if (!word_field(spec, layer::Token(key), where)) return false;
        const layer::Token* unit = spec.field_as<layer::Token>(layer::Token(key));
        for (const std::string_view name : unit_names) {
            if (unit && unit->view() == name) return true;
        }
        return s_.error(
            "usd-value", at,
            fmt::format(
                "found unit '{}', expected one of mm cm dm m km in ft yd mi deg rad % default",
                unit ? unit->str() : ""));
    }
    if (kind == SpecKind::PseudoRoot && key == "subLayers" && is_plain)
        return arcs_.sub_layers(spec, where);
    if (kind == SpecKind::PseudoRoot && key == "relocates" && is_plain) {
        return arcs_.relocates(owner, spec, names_.layer_relocates, where);
    }
    if (kind == SpecKind::Prim || kind == SpecKind::Variant) {
        return prim_item(owner, spec, key, edit, where, is_special);
    }
    is_special = false;
    return true;
}

bool MetadataParser::prim_item(layer::Path owner,
                               layer::Spec& spec,
                               const std::string& key,
                               ListEdit edit,
                               SourceLoc where,
                               bool& is_special) {
    if (key == "references") return arcs_.references(owner, spec, edit, where);
    if (key == "payload") return arcs_.payloads(owner, spec, edit, where);
    if (key == "inherits") return arcs_.paths(owner, spec, names_.inherit_paths, edit, where);
    if (key == "specializes") return arcs_.paths(owner, spec, names_.specializes, edit, where);
    if (key == "variantSets") return variant_set_names(spec, edit, where);
    if (edit == ListEdit::Explicit) {
        if (key == "variants") return variant_selections(spec, where);
        if (key == "relocates") return arcs_.relocates(owner, spec, names_.relocates, where);
        if (key == "prefixSubstitutions" || key == "suffixSubstitutions") {
            layer::Dictionary strings;
            if (!values_.string_dictionary(strings)) return false;
            spec.set_field(layer::Token(key), layer::Value(std::move(strings)), where);
            return true;
        }
    }
    is_special = false;
    return true;
}

bool MetadataParser::string_field(layer::Spec& spec, layer::Token field, SourceLoc where) {
    std::string text;
    if (!s_.string(text)) return false;
    spec.set_field(field, layer::Value(std::move(text)), where);
    return true;
}

bool MetadataParser::word_field(layer::Spec& spec, layer::Token field, SourceLoc where) {
    // "symmetryFunction = " may be empty
    std::string word(s_.accept_identifier());
    if (word.empty() && s_.accept('%')) word = "%";
    spec.set_field(field, layer::Value(layer::Token(word)), where);
    return true;
}

template <class T>
bool MetadataParser::list_op_field(layer::Spec& spec,
                                   layer::Token field,
                                   ListEdit edit,
                                   SourceLoc where) {
    std::vector<T> items;
    const auto one = [&] {
        T item{};
        if (!values_.element(item)) return false;
        items.push_back(std::move(item));
        return true;
    };
    if (!s_.accept_word("None")) {
        const bool ok = s_.peek() == '[' ? values_.bracketed('[', ']', one) : one();
        if (!ok) return false;
    }
    return store_list(context_, spec, field, edit, std::move(items), where);
}

template <class T>
bool MetadataParser::integer_list_field(layer::Spec& spec,
                                        layer::Token field,
                                        ListEdit edit,
                                        SourceLoc where) {
    std::vector<layer::UnregisteredValue> texts;
    std::vector<T> items;
    bool all_fit = true;
    const auto one = [&] {
        layer::UnregisteredValue text;
        if (!values_.untyped(text.text)) return false;
        T item{};
        const char* end = text.text.data() + text.text.size();
        const auto [at, problem] = std::from_chars(text.text.data(), end, item);
        all_fit = all_fit && at == end && problem == std::errc();
        items.push_back(item);
        texts.push_back(std::move(text));
        return true;
    };
    if (!s_.accept_word("None")) {
        const bool ok = s_.peek() == '[' ? values_.bracketed('[', ']', one) : one();
        if (!ok) return false;
    }
    if (all_fit) return store_list(context_, spec, field, edit, std::move(items), where);
    // Declared by Sdf's tests: elsewhere it is an unknown field, which may hold anything
    s_.warn("usd-value", where,
            fmt::format("expected an integer of {} to {} in {}; the field is kept as text",
                        int64_t(std::numeric_limits<T>::min()),
                        uint64_t(std::numeric_limits<T>::max()), field.str()));
    return store_list(context_, spec, field, edit, std::move(texts), where);
}

bool MetadataParser::plain_item(layer::Spec& spec,
                                const std::string& key,
                                ListEdit edit,
                                SourceLoc where) {
    const layer::Token field(key);
    const MetadataType type = metadata_type(key);
    switch (type.kind) {
        case MetadataKind::Unknown:
            return unknown_item(spec, field, edit, where);
        case MetadataKind::TokenList:
            return list_op_field<layer::Token>(spec, field, edit, where);
        case MetadataKind::StringList:
            return list_op_field<std::string>(spec, field, edit, where);
        case MetadataKind::IntList:
            return integer_list_field<int32_t>(spec, field, edit, where);
        case MetadataKind::Int64List:
            // The only one that USD itself declares
            if (key == "inactiveIds") return list_op_field<int64_t>(spec, field, edit, where);
            return integer_list_field<int64_t>(spec, field, edit, where);
        case MetadataKind::UIntList:
            return integer_list_field<uint32_t>(spec, field, edit, where);
        case MetadataKind::UInt64List:
            return integer_list_field<uint64_t>(spec, field, edit, where);
        case MetadataKind::Typed:
        case MetadataKind::Dictionary:
            break;
    }
    if (edit != ListEdit::Explicit) {
        return s_.error(
            "usd-metadata", where,
            fmt::format(
                "found a list edit of '{}', expected a plain value: the field is not a list op",
                key));
    }
    if (s_.accept_word("None")) {
        spec.set_field(field, layer::Value::block(), where);
        return true;
    }
    layer::Value value;
    if (type.kind == MetadataKind::Dictionary) {
        layer::Dictionary dictionary;
        if (!values_.dictionary(dictionary)) return false;
        value = layer::Value(std::move(dictionary));
    } else if (!values_.typed(*type.type, value)) {
        return false;
    }
    spec.set_field(field, std::move(value), where);
    return true;
}

bool MetadataParser::unknown_item(layer::Spec& spec,
                                  layer::Token field,
                                  ListEdit edit,
                                  SourceLoc where) {
    if (edit != ListEdit::Explicit) {
        std::vector<layer::UnregisteredValue> items;
        const auto one = [&] {
            layer::UnregisteredValue item;
            if (!values_.untyped(item.text)) return false;
            items.push_back(std::move(item));
            return true;
        };
        if (!s_.accept_word("None") && !values_.bracketed('[', ']', one)) return false;
        return store_list(context_, spec, field, edit, std::move(items), where);
    }
    if (s_.peek() == '{') {
        layer::Dictionary dictionary;
        if (!values_.dictionary(dictionary)) return false;
        spec.set_field(field, layer::Value(std::move(dictionary)), where);
        return true;
    }
    if (s_.accept_word("None")) {
        spec.set_field(field, layer::Value::block(), where);
        return true;
    }
    layer::UnregisteredValue text;
    if (!values_.untyped(text.text)) return false;
    spec.set_field(field, layer::Value(std::move(text)), where);
    return true;
}

bool MetadataParser::variant_set_names(layer::Spec& spec, ListEdit edit, SourceLoc where) {
    std::vector<std::string> names;
    if (!s_.accept_word("None") && !values_.names(names)) return false;
    return store_list(context_, spec, names_.variant_set_names, edit, std::move(names), where);
}

bool MetadataParser::variant_selections(layer::Spec& spec, SourceLoc where) {
    layer::Dictionary dictionary;
    if (!values_.dictionary(dictionary)) return false;
    layer::VariantSelections selections;
    for (const auto& [set, value] : dictionary.entries) {
        const std::string* variant = value.get_if<std::string>();
        if (!variant) {
            return s_.error(
                "usd-variant-selection", where,
                fmt::format(
                    "found another type for the selection of variant set '{}', expected a string",
                    set));
        }
        const bool is_expression =
            variant->size() >= 2 && variant->front() == '`' && variant->back() == '`';
        if (!variant->empty() && !is_expression && !layer::is_variant_name(*variant)) {
            return s_.error(
                "usd-variant-selection", where,
                fmt::format("found variant \"{}\" selected in set '{}', expected a variant name",
                            *variant, set));
        }
        selections.emplace_back(set, *variant);
    }
    spec.set_field(names_.variant_selection, layer::Value(std::move(selections)), where);
    return true;
}

}  // namespace velatura::usd::text
