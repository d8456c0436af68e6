// SPDX-License-Identifier: Apache-2.0
#include "usd/text/property_parser.h"

#include "usd/text/spline_text.h"

#include <fmt/format.h>

#include <cmath>
#include <unordered_set>

namespace velatura::usd::text {

bool PropertyParser::parse(layer::Path owner) {
    Declaration d;
    d.where = s_.loc();
    d.edit = accept_list_edit(s_);
    s_.skip_inline();
    if (d.edit == ListEdit::Reorder) {
        if (s_.accept_word("nameChildren"))
            return parse_name_order(context_, owner, names_.prim_order, d.where);
        if (s_.accept_word("properties") || s_.accept_word("propertyChildren")) {
            return parse_name_order(context_, owner, names_.property_order, d.where);
        }
    }
    std::string_view word = s_.peek_identifier();
    const auto next_word = [&] {
        s_.accept_identifier();
        s_.skip_inline();
        word = s_.peek_identifier();
    };
    d.is_custom = word == "custom";
    if (d.is_custom) next_word();
    const bool is_varying = word == "varying";
    if (word == "uniform" || word == "config") d.variability = layer::Variability::Uniform;
    if (is_varying || d.variability == layer::Variability::Uniform) next_word();
    if (word == "rel") {
        s_.accept_identifier();
        // Relationships are uniform unless they say otherwise
        d.variability = is_varying ? layer::Variability::Varying : layer::Variability::Uniform;
        return relationship(owner, d);
    }
    if (word.empty()) return s_.fail("a prim, a property or '}'");
    return attribute(owner, d);
}

layer::Spec* PropertyParser::spec_of(layer::Path owner,
                                     layer::SpecKind kind,
                                     const Declaration& d) {
    const layer::Path path = owner.append_property(d.name);
    if (path.is_empty()) {
        s_.fail("fewer levels of prims");
        return nullptr;
    }
    const size_t count = context_.layer.spec_count();
    layer::Spec* const old = &context_.layer.create_spec(path, kind, d.where);
    const bool is_attribute = kind == layer::SpecKind::Attribute;
    if (context_.layer.spec_count() != count) {
        layer::Spec& spec = *old;
        if (is_attribute) {
            const layer::Token type = d.type ? d.type->name : layer::Token(d.type_name);
            spec.set_field(names_.type_name, layer::Value(type), d.where);
        }
        const layer::Variability usual =
            is_attribute ? layer::Variability::Varying : layer::Variability::Uniform;
        if (d.variability != usual)
            spec.set_field(names_.variability, layer::Value(d.variability), d.where);
        if (d.is_custom) spec.set_field(names_.custom, layer::Value(true), d.where);
        return &spec;
    }
    if (old->kind() != kind) {
        s_.error("usd-duplicate-property", d.where,
                 fmt::format("found <{}> as {} and before as {}, expected one of them",
                             path.to_string(), is_attribute ? "an attribute" : "a relationship",
                             is_attribute ? "a relationship" : "an attribute"));
        return nullptr;
    }
    if (is_attribute) {
        const layer::Token type = d.type ? d.type->name : layer::Token(d.type_name);
        if (old->type_name() != type) {
            s_.error("usd-type-change", d.where,
                     fmt::format("found type '{}' of <{}>, expected its earlier type '{}'",
                                 type.str(), path.to_string(), old->type_name().str()));
            return nullptr;
        }
        if (old->variability() != d.variability) {
            s_.error("usd-variability-change", d.where,
                     fmt::format("found another variability of <{}>, expected its earlier one",
                                 path.to_string()));
            return nullptr;
        }
    } else if (d.variability == layer::Variability::Varying) {
        old->set_field(names_.variability, layer::Value(d.variability), d.where);
    }
    if (d.is_custom) old->set_field(names_.custom, layer::Value(true), d.where);
    return old;
}

bool PropertyParser::attribute(layer::Path owner, Declaration& d) {
    if (!s_.type_identifier(d.type_name)) return false;
    s_.skip_inline();
    if (s_.accept('[')) {
        s_.skip_inline();
        if (!s_.expect(']')) return false;
        d.type_name += "[]";
        s_.skip_inline();
    }
    d.type = layer::find_type(d.type_name);
    if (!s_.namespaced_identifier(d.name)) return false;
    layer::Spec* spec = spec_of(owner, layer::SpecKind::Attribute, d);
    if (!spec) return false;
    s_.skip_inline();
    if (s_.accept('.')) return attribute_extra(owner, *spec, d);
    if (d.edit != ListEdit::Explicit) return s_.fail("'.connect'");
    if (s_.accept('=')) {
        s_.skip_inline();
        const SourceLoc where = s_.loc();
        layer::Value value;
        if (!attribute_value(d, value)) return false;
        spec->set_field(names_.default_value, std::move(value), where);
        s_.skip_inline();
    }
    return s_.peek() != '(' || metadata_.block(owner, *spec);
}

bool PropertyParser::attribute_value(const Declaration& d, layer::Value& out) {
    if (s_.accept_word("None")) {
        out = layer::Value::block();
        return true;
    }
    if (s_.accept_word("AnimationBlock")) {
        out = layer::Value::animation_block();
        return true;
    }
    if (d.type) return values_.typed(*d.type, out);
    layer::UnregisteredValue text;
    if (!values_.untyped(text.text)) return false;
    s_.warn("usd-unknown-type", d.where,
            fmt::format("found unknown type '{}' of attribute '{}', expected a value type; its "
                        "value is kept as text",
                        d.type_name, d.name));
    out = layer::Value(std::move(text));
    return true;
}

bool PropertyParser::attribute_extra(layer::Path owner, layer::Spec& spec, const Declaration& d) {
    s_.skip_inline();
    const SourceLoc where = s_.loc();
    if (s_.accept_word("connect")) {
        if (!s_.expect_assignment()) return false;
        return target_list(owner, spec, names_.connection_paths, d.edit, where);
    }
    if (d.edit != ListEdit::Explicit) return s_.fail("'connect'");
    if (s_.accept_word("timeSamples")) return s_.expect_assignment() && attribute_samples(spec, d);
    if (s_.accept_word("spline")) return s_.expect_assignment() && spline(spec);
    return s_.fail("'timeSamples', 'connect' or 'spline'");
}

bool PropertyParser::sample_value(const Declaration& d, layer::Value& out) {
    // AOUSD's own suite gives numbers to a vector: such a sample costs itself, not the layer
    const char bracket = !d.type                                     ? '\0'
                         : d.type->is_array                          ? '['
                         : layer::shape_of(d.type->type).columns > 1 ? '('
                                                                     : '\0';
    const bool is_bare = s_.at_number() || s_.at_string();
    if (bracket == '\0' || s_.peek() == bracket || !is_bare) return attribute_value(d, out);
    const SourceLoc where = s_.loc();
    layer::UnregisteredValue text;
    if (!values_.untyped(text.text)) return false;
    s_.warn("usd-sample-type", where,
            fmt::format("found {} as a time sample of type '{}', expected '{}'; it is kept as text",
                        text.text, d.type_name, bracket));
    out = layer::Value(std::move(text));
    return true;
}

bool PropertyParser::sample_time(double& time) {
    s_.skip_inline();
    const SourceLoc where = s_.loc();
    if (!values_.element(time)) return false;
    if (std::isnan(time)) {
        s_.warn("usd-sample-time", where, "found a sample at nan, expected a time; it is skipped");
    }
    s_.skip_inline();
    if (!s_.expect(':')) return false;
    s_.skip_inline();
    return true;
}

bool PropertyParser::attribute_samples(layer::Spec& spec, const Declaration& d) {
    const SourceLoc where = s_.loc();
    std::vector<std::pair<double, layer::Value>> samples;
    const bool ok = values_.bracketed('{', '}', [&] {
        double time = 0.0;
        if (!sample_time(time)) return false;
        layer::Value value;
        if (!sample_value(d, value)) return false;
        if (!std::isnan(time)) samples.emplace_back(time, std::move(value));
        return true;
    });
    if (ok)
        spec.set_field(names_.time_samples, layer::Value(layer::TimeSamples(std::move(samples))),
                       where);
    return ok;
}

bool PropertyParser::spline(layer::Spec& spec) {
    const SourceLoc where = s_.loc();
    layer::SplineValue value;
    const std::string_view type = spec.type_name().view();
    if (type == "float") value.type = layer::SplineType::Float;
    if (type == "half") value.type = layer::SplineType::Half;
    value.is_time_valued = type == "timecode";
    if (!parse_spline(s_, values_, value)) return false;
    spec.set_field(names_.spline, layer::Value(std::move(value)), where);
    return true;
}

bool PropertyParser::relationship(layer::Path owner, Declaration& d) {
    s_.skip_inline();
    if (!s_.namespaced_identifier(d.name)) return false;
    layer::Spec* spec = spec_of(owner, layer::SpecKind::Relationship, d);
    if (!spec) return false;
    s_.skip_inline();
    if (s_.peek() == '.' || s_.peek() == '[') return relationship_extra(owner, *spec, d);
    if (s_.accept('=')) {
        s_.skip_inline();
        const SourceLoc where = s_.loc();
        if (!target_list(owner, *spec, names_.target_paths, d.edit, where)) return false;
        s_.skip_inline();
    }
    return s_.peek() != '(' || metadata_.block(owner, *spec);
}

bool PropertyParser::relationship_extra(layer::Path owner, layer::Spec& spec, Declaration& d) {
    const SourceLoc where = s_.loc();
    if (s_.accept('[')) {
        // "rel x[</target>]" declares a target without adding it to the list
        layer::Path target;
        s_.skip_inline();
        if (!target_path(owner, target)) return false;
        s_.skip_inline();
        s_.warn("usd-legacy-target", where,
                fmt::format("found a target declaration of relationship '{}', expected '= <path>'; "
                            "it is skipped",
                            d.name));
        return s_.expect(']');
    }
    s_.accept('.');
    s_.skip_inline();
    if (d.edit == ListEdit::Explicit && s_.accept_word("timeSamples")) {
        return s_.expect_assignment() && relationship_samples(owner, spec);
    }
    if (d.edit == ListEdit::Explicit && s_.accept_word("default")) {
        layer::Path target;
        if (!s_.expect_assignment() || !target_path(owner, target)) return false;
        spec.set_field(names_.default_value, layer::Value(target), where);
        return true;
    }
    return s_.fail("'timeSamples' or 'default'");
}

bool PropertyParser::relationship_samples(layer::Path owner, layer::Spec& spec) {
    const SourceLoc where = s_.loc();
    std::vector<std::pair<double, layer::Value>> samples;
    const bool ok = values_.bracketed('{', '}', [&] {
        double time = 0.0;
        if (!sample_time(time)) return false;
        layer::Path target;
        const bool is_block = s_.accept_word("None");
        if (!is_block && !target_path(owner, target)) return false;
        if (std::isnan(time)) return true;
        samples.emplace_back(time, is_block ? layer::Value::block() : layer::Value(target));
        return true;
    });
    if (ok)
        spec.set_field(names_.time_samples, layer::Value(layer::TimeSamples(std::move(samples))),
                       where);
    return ok;
}

bool PropertyParser::target_path(layer::Path owner, layer::Path& out) {
    const SourceLoc where = s_.loc();
    std::string_view text;
    if (!s_.path_text(text)) return false;
    out = {};
    if (text.empty()) return true;
    const auto parsed = layer::Path::parse(text);
    if (!parsed) return s_.error("usd-path", where, parsed.error().message);
    out = parsed->make_absolute(owner.strip_variant_selections());
    if (out.is_empty()) {
        return s_.error("usd-path", where,
                        fmt::format("found path <{}> above the root, expected a path", text));
    }
    if (out.has_variant_selection()) {
        return s_.error(
            "usd-path", where,
            fmt::format("found a variant selection in target <{}>, expected none", text));
    }
    return true;
}

bool PropertyParser::target_list(
    layer::Path owner, layer::Spec& spec, layer::Token field, ListEdit edit, SourceLoc where) {
    std::vector<layer::Path> targets;
    std::unordered_set<layer::Path> seen;
    const auto one = [&] {
        const SourceLoc at = s_.loc();
        layer::Path target;
        if (!target_path(owner, target)) return false;
        // An empty path is no target
        if (target.is_empty()) return true;
        if (!seen.insert(target).second) {
            return s_.error(
                "usd-duplicate-target", at,
                fmt::format("found <{}> twice in one list, expected it once", target.to_string()));
        }
        targets.push_back(target);
        return true;
    };
    if (!s_.accept_word("None")) {
        const bool ok = s_.peek() == '[' ? values_.bracketed('[', ']', one) : one();
        if (!ok) return false;
    }
    return store_list(context_, spec, field, edit, std::move(targets), where);
}

}  // namespace velatura::usd::text
