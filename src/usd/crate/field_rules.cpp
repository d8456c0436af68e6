// SPDX-License-Identifier: Apache-2.0
#include "usd/crate/field_rules.h"

#include "usd/layer/fields.h"
#include "usd/layer/type_name.h"

#include <algorithm>
#include <unordered_map>
#include <unordered_set>

namespace velatura::usd::crate {

using layer::SpecKind;
using layer::Token;
using layer::Value;
using layer::ValueType;

namespace {

FieldUse keep_if(bool is_right) {
    return is_right ? FieldUse::Keep : FieldUse::Wrong;
}

FieldUse convert_type_name(SpecKind kind, Value& value) {
    const Token* name = value.get_if<Token>();
    if (!name) return FieldUse::Wrong;
    if (kind != SpecKind::Attribute) {
        // Sdf's stand-in for "any type"
        const bool says_nothing = name->empty() || *name == std::string_view("__AnyType__");
        return says_nothing ? FieldUse::Drop : FieldUse::Keep;
    }
    const layer::TypeInfo* type = layer::find_type(*name);
    if (type && type->name != *name) value = Value(type->name);
    return FieldUse::Keep;
}

FieldUse convert_variability(SpecKind kind, const Value& value) {
    const auto* v = value.get_if<layer::Variability>();
    if (!v) return FieldUse::Wrong;
    const auto usual =
        kind == SpecKind::Relationship ? layer::Variability::Uniform : layer::Variability::Varying;
    return *v == usual ? FieldUse::Drop : FieldUse::Keep;
}

FieldUse convert_custom(const Value& value) {
    const bool* custom = value.get_if<bool>();
    if (!custom) return FieldUse::Wrong;
    return *custom ? FieldUse::Keep : FieldUse::Drop;
}

FieldUse convert_default(SpecKind kind, const Value& value) {
    if (kind == SpecKind::Relationship) return keep_if(value.holds<layer::Path>());
    return keep_if(layer::is_attribute_type(value.type()) || value.is_block() ||
                   value.is_animation_block() || value.holds<layer::UnregisteredValue>());
}

FieldUse convert_payload(Value& value) {
    const auto* single = value.get_if<layer::Payload>();
    if (!single) return keep_if(value.holds<layer::PayloadListOp>());
    // Before 0.8 there was one payload, or with neither asset nor prim the statement of none
    std::vector<layer::Payload> items;
    if (!single->asset.empty() || !single->prim_path.is_empty()) items.push_back(*single);
    value = Value(layer::PayloadListOp::make_explicit(std::move(items)));
    return FieldUse::Keep;
}

FieldUse convert_paths(Value& value) {
    const auto* op = value.get_if<layer::PathListOp>();
    if (!op) return FieldUse::Wrong;
    layer::PathListOp result = *op;
    for (auto* list : {&result.explicit_items, &result.added, &result.prepended, &result.appended,
                       &result.deleted, &result.ordered}) {
        // An empty path is no target
        std::erase_if(*list, [](layer::Path p) { return p.is_empty(); });
    }
    value = Value(std::move(result));
    return FieldUse::Keep;
}

FieldUse convert_selections(Value& value) {
    const auto* selections = value.get_if<layer::VariantSelections>();
    if (!selections) return FieldUse::Wrong;
    std::map<std::string, std::string> sorted;
    for (const auto& [set, variant] : *selections) sorted[set] = variant;
    value = Value(layer::VariantSelections(sorted.begin(), sorted.end()));
    return FieldUse::Keep;
}

using Convert = FieldUse (*)(SpecKind, Value&);

template <class T>
FieldUse only(SpecKind, Value& value) {
    return keep_if(value.holds<T>());
}

template <class T>
FieldUse only_array(SpecKind, Value& value) {
    return keep_if(value.holds_array<T>());
}

const std::unordered_map<Token, Convert>& rules() {
    static const auto* const table = [] {
        const layer::FieldNames& names = layer::fields();
        auto* t = new std::unordered_map<Token, Convert>;
        (*t)[names.type_name] = [](SpecKind k, Value& v) { return convert_type_name(k, v); };
        (*t)[names.variability] = [](SpecKind k, Value& v) { return convert_variability(k, v); };
        (*t)[names.custom] = [](SpecKind, Value& v) { return convert_custom(v); };
        (*t)[names.default_value] = [](SpecKind k, Value& v) { return convert_default(k, v); };
        (*t)[names.payload] = [](SpecKind, Value& v) { return convert_payload(v); };
        (*t)[names.variant_selection] = [](SpecKind, Value& v) { return convert_selections(v); };
        for (const Token name :
             {names.connection_paths, names.target_paths, names.inherit_paths, names.specializes}) {
            (*t)[name] = [](SpecKind, Value& v) { return convert_paths(v); };
        }
        (*t)[names.specifier] = only<layer::Specifier>;
        (*t)[names.permission] = only<layer::Permission>;
        (*t)[names.references] = only<layer::ReferenceListOp>;
        (*t)[names.variant_set_names] = only<layer::StringListOp>;
        (*t)[names.api_schemas] = only<layer::TokenListOp>;
        (*t)[names.relocates] = only<layer::Relocates>;
        (*t)[names.layer_relocates] = only<layer::Relocates>;
        (*t)[names.time_samples] = only<layer::TimeSamples>;
        (*t)[names.spline] = only<layer::SplineValue>;
        (*t)[names.sub_layers] = only_array<std::string>;
        (*t)[names.sub_layer_offsets] = only<std::vector<layer::LayerOffset>>;
        (*t)[names.prim_order] = only_array<Token>;
        (*t)[names.property_order] = only_array<Token>;
        return t;
    }();
    return *table;
}

}  // namespace

const ChildFields& child_fields() {
    static const ChildFields names;
    return names;
}

bool is_inert_child_field(Token field) {
    static const std::unordered_set<Token> names = {
        Token("connectionChildren"), Token("targetChildren"), Token("mapperChildren"),
        Token("mapperArgChildren"), Token("expressionChildren")};
    return names.count(field) != 0;
}

FieldUse convert_field(SpecKind kind, Token name, Value& value) {
    const auto rule = rules().find(name);
    if (rule != rules().end()) return rule->second(kind, value);
    // Metadata may be of any other type
    switch (value.type()) {
        case ValueType::TimeSamples:
        case ValueType::Spline:
        case ValueType::Empty:
            return FieldUse::Wrong;
        default:
            return FieldUse::Keep;
    }
}

void complete_fields(layer::Spec& spec, SourceLoc loc) {
    const layer::FieldNames& names = layer::fields();
    if (spec.kind() == SpecKind::Prim && !spec.has_field(names.specifier)) {
        spec.set_field(names.specifier, Value(layer::Specifier::Over), loc);
    }
    const Value* layers =
        spec.kind() == SpecKind::PseudoRoot ? spec.field(names.sub_layers) : nullptr;
    if (!layers) return;
    const auto* offsets = spec.field_as<std::vector<layer::LayerOffset>>(names.sub_layer_offsets);
    if (offsets && offsets->size() == layers->array_size()) return;
    std::vector<layer::LayerOffset> all = offsets ? *offsets : std::vector<layer::LayerOffset>();
    all.resize(layers->array_size());
    spec.set_field(names.sub_layer_offsets, Value(std::move(all)), loc);
}

}  // namespace velatura::usd::crate
