// SPDX-License-Identifier: Apache-2.0
#include "usd/layer/type_name.h"
#include "usd/text/layer_writer.h"
#include "usd/text/number_text.h"
#include "usd/text/value_writer.h"
#include "usd/text/writer.h"

#include <algorithm>
#include <type_traits>

namespace velatura::usd::text {

namespace {

using layer::Field;
using layer::Spec;
using layer::SpecKind;
using layer::Token;

/// Fields that are written as structure, not as metadata.
bool is_structure(const layer::FieldNames& names, const Spec& spec, Token field) {
    const bool is_property =
        spec.kind() == SpecKind::Attribute || spec.kind() == SpecKind::Relationship;
    if (is_property) {
        return field == names.type_name || field == names.default_value || field == names.custom ||
               field == names.variability || field == names.time_samples || field == names.spline ||
               field == names.connection_paths || field == names.target_paths;
    }
    return field == names.specifier || field == names.type_name || field == names.prim_order ||
           field == names.property_order || field == names.sub_layer_offsets;
}

/// An empty list of sub-layers says nothing.
bool is_empty_list(const layer::FieldNames& names, const Field& field) {
    return field.name == names.sub_layers && field.value.array_size() == 0;
}

std::string written_key(const layer::FieldNames& names, Token field) {
    if (field == names.documentation) return "doc";
    if (field == names.inherit_paths) return "inherits";
    if (field == names.variant_set_names) return "variantSets";
    if (field == names.variant_selection) return "variants";
    if (field == names.layer_relocates) return "relocates";
    return field.str();
}

bool is_word(std::string_view field) {
    return field == "symmetryFunction" || field == "displayUnit";
}

void append_offset(std::string& out, const layer::LayerOffset& offset, std::string_view separator) {
    if (offset.offset != 0.0) {
        out += "offset = ";
        append_number(out, offset.offset);
    }
    if (offset.scale != 1.0) {
        if (offset.offset != 0.0) out += separator;
        out += "scale = ";
        append_number(out, offset.scale);
    }
}

bool is_plain_key(std::string_view key) {
    if (key.empty() || (key[0] >= '0' && key[0] <= '9')) return false;
    return std::all_of(key.begin(), key.end(), [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
               c == '_';
    });
}

void append_item(std::string& out, const Token& v) {
    append_quoted(out, v.view());
}

void append_item(std::string& out, const std::string& v) {
    append_quoted(out, v);
}

void append_item(std::string& out, const layer::UnregisteredValue& v) {
    out += v.text;
}

template <class T>
void append_item(std::string& out, T v) {
    out += std::to_string(v);
}

}  // namespace

bool LayerWriter::has_metadata(const Spec& spec) const {
    return std::any_of(spec.fields().begin(), spec.fields().end(), [&](const Field& f) {
        return !is_structure(names_, spec, f.name) && !is_empty_list(names_, f);
    });
}

void LayerWriter::metadata(const Spec& spec, int indent) {
    if (!has_metadata(spec)) return;
    out_ += " (\n";
    metadata_fields(spec, indent + 1);
    start(indent);
    out_ += ')';
}

void LayerWriter::metadata_fields(const Spec& spec, int indent) {
    std::vector<const Field*> order;
    for (const Field& f : spec.fields()) {
        if (!is_structure(names_, spec, f.name) && !is_empty_list(names_, f)) order.push_back(&f);
    }
    // The comment first, then by name
    std::stable_sort(order.begin(), order.end(), [&](const Field* a, const Field* b) {
        const bool a_first = a->name == names_.comment;
        const bool b_first = b->name == names_.comment;
        if (a_first != b_first) return a_first;
        return dictionary_less(a->name.view(), b->name.view());
    });
    for (const Field* f : order) {
        if (f->name == names_.sub_layers) {
            sub_layers(indent);
        } else {
            field(*f, indent);
        }
    }
}

void LayerWriter::field(const Field& f, int indent) {
    const std::string key = written_key(names_, f.name);
    if (list_op_field(key, f.value, indent)) return;
    start(indent);
    if (f.name == names_.comment && f.value.holds<std::string>()) {
        append_value(out_, f.value);
        out_ += '\n';
        return;
    }
    out_ += key + " = ";
    if (const auto* d = f.value.get_if<layer::Dictionary>()) {
        if (key == "prefixSubstitutions" || key == "suffixSubstitutions") {
            out_ += "{\n";
            for (const auto& [name, value] : d->entries) {
                start(indent + 1);
                append_quoted(out_, name);
                out_ += ": ";
                append_value(out_, value);
                out_ += ",\n";
            }
            start(indent);
            out_ += '}';
        } else {
            dictionary(*d, indent);
        }
    } else if (const auto* selections = f.value.get_if<layer::VariantSelections>()) {
        layer::Dictionary strings;
        for (const auto& [set, variant] : *selections) strings.entries[set] = layer::Value(variant);
        dictionary(strings, indent);
    } else if (const auto* relocates = f.value.get_if<layer::Relocates>()) {
        out_ += "{\n";
        for (size_t i = 0; i < relocates->size(); ++i) {
            const auto& [source, target] = (*relocates)[i];
            const char* const end = i + 1 < relocates->size() ? ">," : ">";
            line(indent + 1, '<' + source.to_string() + ">: <" + target.to_string() + end);
        }
        start(indent);
        out_ += '}';
    } else if (const bool* flag = f.value.get_if<bool>()) {
        out_ += *flag ? "true" : "false";
    } else if (const Token* word = f.value.get_if<Token>(); word && is_word(f.name.view())) {
        out_ += word->str();
    } else {
        append_value(out_, f.value);
    }
    out_ += '\n';
}

void LayerWriter::dictionary(const layer::Dictionary& d, int indent) {
    std::vector<const layer::Dictionary::Entries::value_type*> order;
    for (const auto& entry : d.entries) order.push_back(&entry);
    std::stable_sort(order.begin(), order.end(), [](const auto* a, const auto* b) {
        return dictionary_less(a->first, b->first);
    });
    out_ += "{\n";
    for (const auto* entry : order) {
        const layer::Value& value = entry->second;
        start(indent + 1);
        const std::string_view type = layer::plain_type_name(value);
        out_.append(type.empty() ? "string" : type).append(" ");
        if (is_plain_key(entry->first)) {
            out_ += entry->first;
        } else {
            append_quoted(out_, entry->first);
        }
        out_ += " = ";
        if (const auto* inner = value.get_if<layer::Dictionary>()) {
            dictionary(*inner, indent + 1);
        } else if (const auto* text = value.get_if<layer::UnregisteredValue>()) {
            append_quoted(out_, text->text);
        } else {
            append_value(out_, value);
        }
        out_ += '\n';
    }
    start(indent);
    out_ += '}';
}

void LayerWriter::sub_layers(int indent) {
    line(indent, "subLayers = [");
    const std::vector<layer::SubLayer> layers = layer_.sub_layers();
    for (size_t i = 0; i < layers.size(); ++i) {
        start(indent + 1);
        append_asset(out_, layers[i].asset);
        if (!layers[i].offset.is_identity()) {
            out_ += " (";
            append_offset(out_, layers[i].offset, "; ");
            out_ += ')';
        }
        out_ += i + 1 < layers.size() ? ",\n" : "\n";
    }
    line(indent, "]");
}

template <class Arc>
void LayerWriter::arc(const Arc& a, int indent) {
    if (!a.asset.empty()) append_asset(out_, a.asset);
    if (a.asset.empty() || !a.prim_path.is_empty()) out_ += '<' + a.prim_path.to_string() + '>';
    if constexpr (std::is_same_v<Arc, layer::Reference>) {
        if (!a.custom_data.empty()) {
            out_ += " (\n";
            if (!a.offset.is_identity()) {
                std::string separator = "\n" + std::string(size_t(indent + 1) * 4, ' ');
                start(indent + 1);
                append_offset(out_, a.offset, separator);
                out_ += '\n';
            }
            start(indent + 1);
            out_ += "customData = ";
            dictionary(a.custom_data, indent + 1);
            out_ += '\n';
            start(indent);
            out_ += ')';
            return;
        }
    }
    if (a.offset.is_identity()) return;
    out_ += " (";
    append_offset(out_, a.offset, "; ");
    out_ += ')';
}

template <class Arc>
void LayerWriter::arcs(const std::string& key, const std::vector<Arc>& items, int indent) {
    start(indent);
    out_ += key + " = ";
    bool is_simple = items.size() == 1;
    if constexpr (std::is_same_v<Arc, layer::Reference>) {
        is_simple = is_simple && items[0].custom_data.empty();
    }
    if (items.empty()) {
        out_ += "None\n";
    } else if (is_simple) {
        arc(items[0], indent);
        out_ += '\n';
    } else {
        out_ += "[\n";
        for (size_t i = 0; i < items.size(); ++i) {
            start(indent + 1);
            arc(items[i], indent + 1);
            out_ += i + 1 < items.size() ? ",\n" : "\n";
        }
        line(indent, "]");
    }
}

void LayerWriter::paths(const std::string& key, const std::vector<layer::Path>& items, int indent) {
    start(indent);
    out_ += key + " = ";
    if (items.empty()) {
        out_ += "None\n";
    } else if (items.size() == 1) {
        out_ += '<' + items[0].to_string() + ">\n";
    } else {
        out_ += "[\n";
        for (size_t i = 0; i < items.size(); ++i) {
            line(indent + 1, '<' + items[i].to_string() + (i + 1 < items.size() ? ">," : ">"));
        }
        line(indent, "]");
    }
}

template <class T>
void LayerWriter::words(const std::string& key,
                        const std::vector<T>& items,
                        bool is_bare_when_single,
                        int indent) {
    start(indent);
    out_ += key + " = ";
    if (items.empty()) {
        out_ += "None\n";
        return;
    }
    const bool is_bare = is_bare_when_single && items.size() == 1;
    if (!is_bare) out_ += '[';
    for (size_t i = 0; i < items.size(); ++i) {
        if (i > 0) out_ += ", ";
        append_item(out_, items[i]);
    }
    out_ += is_bare ? "\n" : "]\n";
}

bool LayerWriter::list_op_field(const std::string& key, const layer::Value& value, int indent) {
    const auto edit_words = [&](const auto* op) {
        const bool is_bare = key == "variantSets";
        for_each_edit(*op, [&](const std::string& edit, const auto& items) {
            words(edit + key, items, is_bare, indent);
        });
        return true;
    };
    if (const auto* op = value.get_if<layer::ReferenceListOp>()) {
        for_each_edit(*op, [&](const std::string& edit, const auto& items) {
            arcs(edit + key, items, indent);
        });
        return true;
    }
    if (const auto* op = value.get_if<layer::PayloadListOp>()) {
        for_each_edit(*op, [&](const std::string& edit, const auto& items) {
            arcs(edit + key, items, indent);
        });
        return true;
    }
    if (const auto* op = value.get_if<layer::PathListOp>()) {
        for_each_edit(*op, [&](const std::string& edit, const auto& items) {
            paths(edit + key, items, indent);
        });
        return true;
    }
    if (const auto* op = value.get_if<layer::TokenListOp>()) return edit_words(op);
    if (const auto* op = value.get_if<layer::StringListOp>()) return edit_words(op);
    if (const auto* op = value.get_if<layer::ListOp<int32_t>>()) return edit_words(op);
    if (const auto* op = value.get_if<layer::ListOp<uint32_t>>()) return edit_words(op);
    if (const auto* op = value.get_if<layer::ListOp<int64_t>>()) return edit_words(op);
    if (const auto* op = value.get_if<layer::ListOp<uint64_t>>()) return edit_words(op);
    if (const auto* op = value.get_if<layer::ListOp<layer::UnregisteredValue>>())
        return edit_words(op);
    return false;
}

}  // namespace velatura::usd::text
