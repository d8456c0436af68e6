// SPDX-License-Identifier: Apache-2.0
#include "usd/compose/targets.h"
#include "usd/layer/fields.h"
#include "usd/stage/asset_expression.h"
#include "usd/stage/prim_data.h"
#include "usd/stage/resolve.h"
#include "usd/stage/schema_fallbacks.h"
#include "usd/stage/value_cast.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <unordered_set>
#include <utility>

namespace velatura::usd::stage {

using layer::Path;
using layer::Token;
using layer::Value;

std::vector<PropertySpec> property_specs(const PrimData& prim, Token name) {
    std::vector<PropertySpec> result;
    for (const SpecRef& ref : prim.specs) {
        const auto own = ref.spec->properties();
        if (std::find(own.begin(), own.end(), name) == own.end()) continue;
        const compose::Node& node = prim.index.nodes()[size_t(ref.node)];
        const layer::Spec* spec = ref.layer->layer->spec(node.path.append_property(name));
        if (!spec) continue;
        if (result.empty() || result.front().spec->kind() == spec->kind()) {
            result.push_back({spec, &ref, offset_to_stage(node, *ref.layer)});
        } else {
            const bool is_attribute = spec->kind() == layer::SpecKind::Attribute;
            prim.stage->diagnostics().warn(
                "usd-inconsistent-property", spec->loc(), prim.path.to_string(),
                fmt::format("{} {} is ignored: a stronger layer has {} of that name",
                            is_attribute ? "attribute" : "relationship", name.str(),
                            is_attribute ? "a relationship" : "an attribute"));
        }
    }
    return result;
}

namespace {

/// Composed targets of a relationship or connections of an attribute, mapped to the stage; paths
/// that point outside of an arc's scope are dropped. None of a property of the other kind.
std::vector<Path> composed_paths(const Prim& prim, Token property, layer::SpecKind kind) {
    std::vector<compose::PropertySite> stack;
    for (const PropertySpec& s : property_specs(*prim.data(), property))
        stack.push_back({s.spec, s.prim_spec->layer, s.prim_spec->node});
    if (stack.empty() || stack.front().spec->kind() != kind) return {};
    compose::ComposedTargets targets =
        compose::compose_targets(prim.data()->index, property, stack);
    for (compose::CompositionError& error : targets.errors)
        prim.diagnostics().warn("usd-target-out-of-scope", error.loc, prim.path_string(),
                                std::move(error.message));
    return std::move(targets.paths);
}

std::optional<Value> composed_metadata(const Prim& prim, Token property, std::string_view key) {
    std::vector<Value> values;
    for (const PropertySpec& s : property_specs(*prim.data(), property)) {
        if (const Value* value = s.spec->field(Token(key)))
            values.push_back(stage_value(*prim.data(), *s.prim_spec, *value));
    }
    return compose_values(values);
}

std::vector<std::string> composed_metadata_keys(const Prim& prim, Token property) {
    std::set<std::string> keys;
    for (const PropertySpec& s : property_specs(*prim.data(), property)) {
        for (const layer::Field& field : s.spec->fields()) {
            if (!is_property_field(field.name)) keys.insert(field.name.str());
        }
    }
    return {keys.begin(), keys.end()};
}

bool is_attribute(const std::vector<PropertySpec>& specs) {
    return !specs.empty() && specs.front().spec->kind() == layer::SpecKind::Attribute;
}

const SchemaAttribute* find_schema_declaration(const Prim& prim, Token name) {
    const std::string_view type = prim.type_name().view();
    if (const SchemaAttribute* found = find_schema_attribute(type, name.view())) return found;
    for (const std::string_view api : schema_builtin_apis(type)) {
        if (const SchemaAttribute* found = find_schema_attribute(api, name.view())) return found;
    }
    for (const Token& api : prim.applied_schemas()) {
        const std::string_view base = api.view().substr(0, api.view().find(':'));
        if (const SchemaAttribute* found = find_schema_attribute(base, name.view())) return found;
        for (const std::string_view inner : schema_builtin_apis(base)) {
            if (const SchemaAttribute* found = find_schema_attribute(inner, name.view()))
                return found;
        }
    }
    return nullptr;
}

/// The same, and the inputs of a shader node, whose identifier declares them.
const SchemaAttribute* find_declaration(const Prim& prim, Token name) {
    if (const SchemaAttribute* found = find_schema_declaration(prim, name)) return found;
    if (prim.type_name() != "Shader" || !name.view().starts_with("inputs:")) return nullptr;
    const auto id = prim.attribute("info:id").get<std::string>();
    return id ? find_schema_attribute(*id, name.view()) : nullptr;
}

}  // namespace

// ---- Attribute ----

bool Attribute::is_authored() const {
    return prim_ && is_attribute(property_specs(*prim_.data(), name_));
}

bool Attribute::is_valid() const {
    return prim_ && (is_authored() || find_declaration(prim_, name_));
}

std::string Attribute::path_string() const {
    return prim_.path_string() + "." + name_.str();
}

Token Attribute::type_name() const {
    // The schema decides, whatever the layers declare
    if (const SchemaAttribute* declared = find_schema_declaration(prim_, name_))
        return Token(declared->type);
    for (const PropertySpec& s : property_specs(*prim_.data(), name_)) {
        if (!s.spec->type_name().empty()) return s.spec->type_name();
    }
    const SchemaAttribute* input = find_declaration(prim_, name_);
    return input ? Token(input->type) : Token();
}

bool Attribute::is_custom() const {
    if (find_schema_declaration(prim_, name_)) return false;
    const auto specs = property_specs(*prim_.data(), name_);
    return std::any_of(specs.begin(), specs.end(),
                       [](const PropertySpec& s) { return s.spec->is_custom(); });
}

bool Attribute::is_uniform() const {
    // The schema decides, else the weakest opinion
    if (const auto* declared = find_schema_declaration(prim_, name_)) return declared->uniform;
    const auto specs = property_specs(*prim_.data(), name_);
    return !specs.empty() && specs.back().spec->variability() == layer::Variability::Uniform;
}

ValueSource Attribute::value_source() const {
    const ValueSource source = find_value_opinion(*prim_.data(), name_, false).source;
    if (source != ValueSource::None) return source;
    return fallback() ? ValueSource::Fallback : ValueSource::None;
}

bool Attribute::has_authored_value() const {
    if (!prim_) return false;
    const ValueSource source = find_value_opinion(*prim_.data(), name_, false).source;
    return source != ValueSource::None && source != ValueSource::Blocked;
}

std::optional<Value> Attribute::fallback() const {
    const SchemaAttribute* declared = find_declaration(prim_, name_);
    return declared ? schema_fallback(*declared) : std::nullopt;
}

std::optional<Value> Attribute::authored_default() const {
    for (const PropertySpec& s : property_specs(*prim_.data(), name_)) {
        const Value* value = s.spec->field(layer::fields().default_value);
        // An animation block says nothing about defaults
        if (value && !value->is_animation_block())
            return stage_value(*prim_.data(), *s.prim_spec, *value);
    }
    return std::nullopt;
}

Value Attribute::value(TimeCode time) const {
    if (!prim_) return {};
    const ValueOpinion winner = find_value_opinion(*prim_.data(), name_, time.is_default());
    Value result = winner.value(time);
    if (result.type() == layer::ValueType::PathExpression && winner.spec.prim_spec)
        result = with_stage_paths(*prim_.data(), *winner.spec.prim_spec, result);
    if (result.is_block() || result.is_empty()) return fallback().value_or(Value());
    return result;
}

std::vector<double> Attribute::time_samples() const {
    if (!prim_) return {};
    return find_value_opinion(*prim_.data(), name_, false).sample_times();
}

Value Attribute::sample_at(double time) const {
    const ValueOpinion opinion = find_value_opinion(*prim_.data(), name_, false);
    if (opinion.source == ValueSource::Clips)
        return opinion.clips->value_at_sample(opinion.clip_attribute, time);
    if (opinion.source != ValueSource::TimeSamples) return {};
    const auto& samples = *opinion.field->value.get_if<layer::TimeSamples>();
    for (size_t i = 0; i < samples.size(); ++i) {
        if (opinion.spec.to_stage.apply(samples.times()[i]) == time)
            return retime_value(samples.value(i), opinion.spec.to_stage);
    }
    return {};
}

bool Attribute::might_be_time_varying() const {
    if (!prim_) return false;
    const ValueOpinion opinion = find_value_opinion(*prim_.data(), name_, false);
    return opinion.source == ValueSource::Spline || opinion.sample_times().size() > 1;
}

std::vector<Path> Attribute::connections() const {
    return prim_ ? composed_paths(prim_, name_, layer::SpecKind::Attribute) : std::vector<Path>();
}

bool Attribute::has_authored_connections() const {
    if (!prim_) return false;
    const auto specs = property_specs(*prim_.data(), name_);
    return std::any_of(specs.begin(), specs.end(), [](const PropertySpec& s) {
        return s.spec->has_field(layer::fields().connection_paths);
    });
}

std::vector<std::string> Attribute::resolved_asset_paths(TimeCode time) const {
    if (!prim_) return {};
    const Value resolved = value(time);
    std::vector<std::string> assets;
    if (const auto* one = resolved.get_if<layer::AssetPath>()) assets.push_back(one->path);
    for (const layer::AssetPath& asset : resolved.as_array<layer::AssetPath>())
        assets.push_back(asset.path);
    const ValueOpinion winner = find_value_opinion(*prim_.data(), name_, time.is_default());
    const AssetAnchor anchor = asset_anchor(*prim_.data(), winner, time);
    if (!anchor.layer) return assets;
    for (std::string& asset : assets) {
        asset = evaluate_asset(asset, anchor, prim_.path_string(), loc(), prim_.diagnostics());
        if (!asset.empty()) asset = prim_.data()->stage->resolve_asset(asset, *anchor.layer);
    }
    return assets;
}

std::string Attribute::resolved_asset_path(TimeCode time) const {
    if (!prim_ || value(time).is_array()) return {};
    const std::vector<std::string> all = resolved_asset_paths(time);
    return all.empty() ? std::string() : all.front();
}

std::optional<Value> Attribute::metadata(std::string_view key) const {
    return prim_ ? composed_metadata(prim_, name_, key) : std::nullopt;
}

std::vector<std::string> Attribute::metadata_keys() const {
    return composed_metadata_keys(prim_, name_);
}

SourceLoc Attribute::loc() const {
    if (!prim_) return {};
    const auto specs = property_specs(*prim_.data(), name_);
    if (specs.empty()) return prim_.loc();
    const SourceLoc place = find_value_opinion(*prim_.data(), name_, false).loc();
    return place.is_known() ? place : specs.front().spec->loc();
}

template <class T>
std::optional<T> Attribute::get(TimeCode time) const {
    return value_cast<T>(value(time));
}

#define VELATURA_INSTANTIATE_GET(T)                           \
    template std::optional<T> Attribute::get(TimeCode) const; \
    template std::optional<std::vector<T>> Attribute::get(TimeCode) const;
VELATURA_CAST_TYPES(VELATURA_INSTANTIATE_GET)
#undef VELATURA_INSTANTIATE_GET

// ---- Relationship ----

bool Relationship::is_valid() const {
    if (!prim_) return false;
    const auto specs = property_specs(*prim_.data(), name_);
    return !specs.empty() && specs.front().spec->kind() == layer::SpecKind::Relationship;
}

std::string Relationship::path_string() const {
    return prim_.path_string() + "." + name_.str();
}

bool Relationship::is_custom() const {
    const auto specs = property_specs(*prim_.data(), name_);
    return std::any_of(specs.begin(), specs.end(),
                       [](const PropertySpec& s) { return s.spec->is_custom(); });
}

bool Relationship::has_authored_targets() const {
    if (!prim_) return false;
    const auto specs = property_specs(*prim_.data(), name_);
    return std::any_of(specs.begin(), specs.end(), [](const PropertySpec& s) {
        return s.spec->has_field(layer::fields().target_paths);
    });
}

std::vector<Path> Relationship::targets() const {
    return prim_ ? composed_paths(prim_, name_, layer::SpecKind::Relationship)
                 : std::vector<Path>();
}

std::vector<Path> Relationship::forwarded_targets() const {
    if (!prim_) return {};
    std::vector<Path> result;
    std::unordered_set<Path> seen;
    // Depth first in target order; a relationship that was visited is not followed again
    std::vector<Path> pending = targets();
    std::reverse(pending.begin(), pending.end());
    while (!pending.empty()) {
        const Path target = pending.back();
        pending.pop_back();
        if (!seen.insert(target).second) continue;
        const PrimData* owner =
            target.is_property() ? prim_.data()->stage->find(target.prim_path()) : nullptr;
        const Relationship next = owner ? Relationship(Prim(owner), target.name()) : Relationship();
        if (!next.is_valid()) {
            result.push_back(target);
            continue;
        }
        const std::vector<Path> further = next.targets();
        pending.insert(pending.end(), further.rbegin(), further.rend());
    }
    return result;
}

std::optional<Value> Relationship::metadata(std::string_view key) const {
    return prim_ ? composed_metadata(prim_, name_, key) : std::nullopt;
}

std::vector<std::string> Relationship::metadata_keys() const {
    return composed_metadata_keys(prim_, name_);
}

SourceLoc Relationship::loc() const {
    if (!prim_) return {};
    const auto specs = property_specs(*prim_.data(), name_);
    return specs.empty() ? prim_.loc()
                         : specs.front().spec->field_loc(layer::fields().target_paths);
}

}  // namespace velatura::usd::stage
