// SPDX-License-Identifier: Apache-2.0
#include "usd/compose/composer.h"
#include "usd/layer/fields.h"
#include "usd/stage/path_expression.h"
#include "usd/stage/prim_data.h"
#include "usd/stage/value_cast.h"

#include <algorithm>
#include <array>

namespace velatura::usd::stage {

using layer::Token;
using layer::Value;

namespace {

/// Composes list-ops of one item type over the specs; nullopt when the strongest opinion is of
/// another type.
template <class Op>
std::optional<Value> compose_list_op(const std::vector<const Value*>& values) {
    if (!values.front()->get_if<Op>()) return std::nullopt;
    Op result = *values.front()->get_if<Op>();
    for (size_t i = 1; i < values.size() && !result.is_explicit; ++i) {
        const Op* weaker = values[i]->get_if<Op>();
        if (!weaker) continue;
        if (auto composed = result.composed_over(*weaker)) {
            result = *std::move(composed);
            continue;
        }
        // Legacy edits over edits: apply everything from the weakest up
        auto items = weaker->applied();
        items.clear();
        for (size_t j = values.size(); j-- > 0;) {
            if (const Op* op = values[j]->get_if<Op>()) op->apply_to(items);
        }
        return Value(Op::make_explicit(std::move(items)));
    }
    return Value(std::move(result));
}

bool is_any_of(Token name, std::span<const Token> names) {
    return std::find(names.begin(), names.end(), name) != names.end();
}

std::optional<Value> compose(const std::vector<const Value*>& values) {
    if (values.empty()) return std::nullopt;
    if (values.front()->get_if<layer::Dictionary>()) {
        layer::Dictionary merged;
        for (size_t i = values.size(); i-- > 0;) {
            if (const auto* d = values[i]->get_if<layer::Dictionary>())
                merged = d->merged_over(merged);
        }
        return Value(std::move(merged));
    }
    if (auto v = compose_list_op<layer::TokenListOp>(values)) return v;
    if (auto v = compose_list_op<layer::StringListOp>(values)) return v;
    if (auto v = compose_list_op<layer::ListOp<int32_t>>(values)) return v;
    if (auto v = compose_list_op<layer::ListOp<int64_t>>(values)) return v;
    if (auto v = compose_list_op<layer::ListOp<uint32_t>>(values)) return v;
    if (auto v = compose_list_op<layer::ListOp<uint64_t>>(values)) return v;
    return *values.front();
}

}  // namespace

Value with_stage_paths(const PrimData& prim, const SpecRef& ref, const Value& value) {
    const compose::Node& node = prim.index.nodes()[size_t(ref.node)];
    if (node.to_root->is_identity()) return value;
    const auto mapped = [&](const layer::PathExpression& expression) {
        return layer::PathExpression{
            path_expression_text(expression.text, node.path.strip_variant_selections(),
                                 [&](layer::Path path) { return map_to_root(node, path); })};
    };
    if (const auto* one = value.get_if<layer::PathExpression>()) return Value(mapped(*one));
    if (value.holds_array<layer::PathExpression>()) {
        std::vector<layer::PathExpression> all;
        for (const auto& expression : value.as_array<layer::PathExpression>())
            all.push_back(mapped(expression));
        return Value::array(std::move(all));
    }
    if (const auto* dictionary = value.get_if<layer::Dictionary>()) {
        layer::Dictionary result = *dictionary;
        for (auto& entry : result.entries) entry.second = with_stage_paths(prim, ref, entry.second);
        return Value(std::move(result));
    }
    return value;
}

Value stage_value(const PrimData& prim, const SpecRef& ref, const Value& value) {
    const compose::Node& node = prim.index.nodes()[size_t(ref.node)];
    const Value retimed = retime_value(value, offset_to_stage(node, *ref.layer));
    return with_stage_paths(prim, ref, retimed);
}

std::optional<Value> compose_field(const std::vector<const layer::Spec*>& specs, Token name) {
    std::vector<const Value*> values;
    for (const layer::Spec* spec : specs) {
        if (const Value* value = spec->field(name)) values.push_back(value);
    }
    return compose(values);
}

std::optional<Value> compose_values(const std::vector<Value>& strongest_first) {
    std::vector<const Value*> values;
    for (const Value& value : strongest_first) values.push_back(&value);
    return compose(values);
}

bool is_composition_field(Token name) {
    const layer::FieldNames& f = layer::fields();
    static const std::array<Token, 12> names = {
        f.references,        f.payload,           f.inherit_paths,   f.specializes,
        f.sub_layers,        f.sub_layer_offsets, f.layer_relocates, f.relocates,
        f.variant_set_names, f.variant_selection, f.clips,           f.clip_sets};
    return is_any_of(name, names);
}

bool is_prim_field(Token name) {
    const layer::FieldNames& f = layer::fields();
    static const std::array<Token, 4> names = {f.specifier, f.type_name, f.api_schemas, f.active};
    return is_any_of(name, names);
}

bool is_property_field(Token name) {
    const layer::FieldNames& f = layer::fields();
    static const std::array<Token, 8> names = {f.type_name,     f.custom,       f.variability,
                                               f.default_value, f.time_samples, f.connection_paths,
                                               f.target_paths,  f.spline};
    return is_any_of(name, names);
}

}  // namespace velatura::usd::stage
