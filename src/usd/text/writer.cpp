// SPDX-License-Identifier: Apache-2.0
#include "usd/text/writer.h"

#include "base/characters.h"
#include "usd/text/layer_writer.h"
#include "usd/text/number_text.h"
#include "usd/text/spline_text.h"
#include "usd/text/value_writer.h"

#include <algorithm>
#include <utility>

namespace velatura::usd::text {

namespace {

using layer::Path;
using layer::Spec;
using layer::Token;

char lower(char c) {
    return c >= 'A' && c <= 'Z' ? char(c - 'A' + 'a') : c;
}

std::string_view digits_at(std::string_view text, size_t at) {
    size_t end = at;
    while (end < text.size() && is_digit(text[end])) ++end;
    return text.substr(at, end - at);
}

std::vector<Token> sorted(std::span<const Token> names) {
    std::vector<Token> result(names.begin(), names.end());
    std::stable_sort(result.begin(), result.end(),
                     [](Token a, Token b) { return dictionary_less(a.view(), b.view()); });
    return result;
}

}  // namespace

bool dictionary_less(std::string_view a, std::string_view b) {
    size_t i = 0;
    size_t j = 0;
    while (i < a.size() && j < b.size()) {
        if (is_digit(a[i]) && is_digit(b[j])) {
            std::string_view x = digits_at(a, i);
            std::string_view y = digits_at(b, j);
            i += x.size();
            j += y.size();
            while (x.size() > 1 && x.front() == '0') x.remove_prefix(1);
            while (y.size() > 1 && y.front() == '0') y.remove_prefix(1);
            if (x.size() != y.size()) return x.size() < y.size();
            if (x != y) return x < y;
            continue;
        }
        const auto x = static_cast<unsigned char>(lower(a[i++]));
        const auto y = static_cast<unsigned char>(lower(b[j++]));
        if (x != y) return x < y;
    }
    if (i < a.size() || j < b.size()) return j < b.size();
    return a < b;
}

std::string write_text_layer(const layer::Layer& layer, std::string_view header) {
    std::string out;
    LayerWriter(layer, out).write(header);
    return out;
}

LayerWriter::LayerWriter(const layer::Layer& layer, std::string& out)
    : layer_(layer), names_(layer::fields()), out_(out) {}

void LayerWriter::line(int indent, std::string_view text) {
    start(indent);
    out_.append(text).append("\n");
}

void LayerWriter::write(std::string_view header) {
    const Spec& root = layer_.pseudo_root();
    line(0, header);
    if (has_metadata(root)) {
        line(0, "(");
        metadata_fields(root, 1);
        line(0, ")");
    }
    out_ += '\n';
    if (root.has_field(names_.prim_order)) {
        reorder("rootPrims", root, names_.prim_order, 0);
        out_ += '\n';
    }
    for (const Token name : root.prim_children()) {
        prim(Path::absolute_root().append_child(name), 0);
        out_ += '\n';
    }
}

void LayerWriter::reorder(std::string_view what, const Spec& spec, Token field, int indent) {
    const layer::Value* order = spec.field(field);
    if (!order) return;
    start(indent);
    out_.append("reorder ").append(what).append(" = ");
    append_value(out_, *order);
    out_ += '\n';
}

void LayerWriter::prim(Path path, int indent) {
    const Spec& spec = *layer_.spec(path);
    start(indent);
    const layer::Specifier s = spec.specifier();
    out_ += s == layer::Specifier::Def ? "def " : s == layer::Specifier::Over ? "over " : "class ";
    if (!spec.type_name().empty()) out_ += spec.type_name().str() + ' ';
    append_quoted(out_, path.name().view());
    metadata(spec, indent);
    out_ += '\n';
    line(indent, "{");
    body(path, spec, indent + 1);
    line(indent, "}");
}

void LayerWriter::body(Path path, const Spec& spec, int indent) {
    const size_t before = out_.size();
    reorder("nameChildren", spec, names_.prim_order, indent);
    reorder("properties", spec, names_.property_order, indent);
    for (const Token name : sorted(spec.properties())) {
        const Path property = path.append_property(name);
        const Spec& p = *layer_.spec(property);
        if (p.kind() == layer::SpecKind::Attribute) {
            attribute(property, p, indent);
        } else {
            relationship(property, p, indent);
        }
    }
    for (const Token name : spec.prim_children()) {
        if (out_.size() > before) out_ += '\n';
        prim(path.append_child(name), indent);
    }
    if (spec.kind() != layer::SpecKind::VariantSet && !spec.variant_sets().empty()) {
        if (!spec.prim_children().empty()) out_ += '\n';
        variant_sets(path, spec, indent);
    }
}

void LayerWriter::variant_sets(Path path, const Spec& spec, int indent) {
    for (const Token set : sorted(spec.variant_sets())) {
        const Spec& set_spec = *layer_.spec(path.append_variant_selection(set, {}));
        start(indent);
        out_ += "variantSet ";
        append_quoted(out_, set.view());
        out_ += " = {\n";
        for (const Token name : sorted(set_spec.variants())) {
            const Path variant = path.append_variant_selection(set, name);
            const Spec& variant_spec = *layer_.spec(variant);
            start(indent + 1);
            append_quoted(out_, name.view());
            metadata(variant_spec, indent + 1);
            out_ += " {\n";
            body(variant, variant_spec, indent + 2);
            out_ += '\n';
            line(indent + 1, "}");
        }
        line(indent, "}");
    }
}

void LayerWriter::samples(const layer::TimeSamples& samples, int indent) {
    out_ += "{\n";
    for (size_t i = 0; i < samples.size(); ++i) {
        start(indent + 1);
        append_number(out_, samples.times()[i]);
        out_ += ": ";
        append_value(out_, samples.value(i));
        out_ += ",\n";
    }
    line(indent, "}");
}

void LayerWriter::target_list(std::string_view declaration,
                              std::string_view suffix,
                              const layer::PathListOp& op,
                              int indent) {
    for_each_edit(op, [&](std::string_view edit, const std::vector<Path>& items) {
        start(indent);
        out_.append(edit).append(declaration).append(suffix).append(" = ");
        if (items.empty()) {
            out_ += "None\n";
        } else if (items.size() == 1) {
            out_ += '<' + items[0].to_string() + ">\n";
        } else {
            out_ += "[\n";
            for (const Path item : items) line(indent + 1, '<' + item.to_string() + ">,");
            line(indent, "]");
        }
    });
}

void LayerWriter::attribute(Path path, const Spec& spec, int indent) {
    const bool is_uniform = spec.variability() == layer::Variability::Uniform;
    const std::string declaration =
        (is_uniform ? "uniform " : "") + spec.type_name().str() + ' ' + path.name().str();
    const layer::Value* value = spec.field(names_.default_value);
    const auto* times = spec.field_as<layer::TimeSamples>(names_.time_samples);
    const auto* connections = spec.field_as<layer::PathListOp>(names_.connection_paths);
    const auto* spline = spec.field_as<layer::SplineValue>(names_.spline);
    const bool has_more = times || spline || (connections && connections->has_opinion());
    if (value || !has_more || spec.is_custom() || has_metadata(spec)) {
        start(indent);
        if (spec.is_custom()) out_ += "custom ";
        out_ += declaration;
        if (value) {
            out_ += " = ";
            append_value(out_, *value);
        }
        metadata(spec, indent);
        out_ += '\n';
    }
    if (times) {
        start(indent);
        out_ += declaration + ".timeSamples = ";
        samples(*times, indent);
    }
    if (spline) {
        start(indent);
        out_ += declaration + ".spline = {\n";
        append_spline(out_, *spline, indent + 1,
                      [&](const layer::Dictionary& d) { dictionary(d, indent + 1); });
        line(indent, "}");
    }
    if (connections) target_list(declaration, ".connect", *connections, indent);
}

void LayerWriter::relationship(Path path, const Spec& spec, int indent) {
    const bool is_varying = spec.variability() == layer::Variability::Varying;
    const std::string declaration = (is_varying ? "varying rel " : "rel ") + path.name().str();
    const auto* targets = spec.field_as<layer::PathListOp>(names_.target_paths);
    const auto* times = spec.field_as<layer::TimeSamples>(names_.time_samples);
    const auto* value = spec.field_as<Path>(names_.default_value);
    // One statement holds the declaration, an explicit list and the metadata
    const bool is_explicit = targets && targets->is_explicit;
    const bool has_edits = targets && !is_explicit && targets->has_opinion();
    if (!has_edits || spec.is_custom() || has_metadata(spec)) {
        std::string full = (spec.is_custom() ? "custom " : "") + declaration;
        if (is_explicit) {
            target_list(full, "", *targets, indent);
            out_.pop_back();
        } else {
            start(indent);
            out_ += full;
        }
        metadata(spec, indent);
        out_ += '\n';
    }
    if (has_edits) target_list(declaration, "", *targets, indent);
    if (times) {
        start(indent);
        out_ += declaration + ".timeSamples = ";
        samples(*times, indent);
    }
    if (value) line(indent, declaration + ".default = <" + value->to_string() + '>');
}

}  // namespace velatura::usd::text
