// SPDX-License-Identifier: Apache-2.0
#include "base/check.h"
#include "usd/compose/site.h"
#include "usd/layer/fields.h"
#include "usd/stage/prim_data.h"
#include "usd/stage/schema_fallbacks.h"

#include <algorithm>
#include <set>

namespace velatura::usd::stage {

using layer::Path;
using layer::Token;
using layer::Value;

namespace {

bool is_rendered(const PrimData& prim) {
    return prim.is_active && prim.is_defined && !prim.is_abstract && prim.is_loaded;
}

}  // namespace

const Path& Prim::path() const {
    return data_->path;
}

std::string Prim::path_string() const {
    return data_->path.to_string();
}

Token Prim::name() const {
    return data_->parent ? data_->path.name() : Token();
}

Token Prim::type_name() const {
    return data_->type_name;
}

layer::Specifier Prim::specifier() const {
    return data_->specifier;
}

bool Prim::is_pseudo_root() const {
    return data_->parent == nullptr;
}

bool Prim::is_active() const {
    return data_->is_active;
}

bool Prim::is_defined() const {
    return data_->is_defined;
}

bool Prim::is_abstract() const {
    return data_->is_abstract;
}

bool Prim::is_loaded() const {
    return data_->is_loaded;
}

bool Prim::is_model() const {
    return data_->is_model;
}

bool Prim::is_instanceable() const {
    return data_->is_instanceable;
}

bool Prim::is_instance() const {
    return data_->is_instance;
}

bool Prim::is_instance_proxy() const {
    return data_->is_instance_proxy;
}

bool Prim::is_a(std::string_view type) const {
    return schema_is_a(data_->type_name.view(), type);
}

std::string Prim::kind() const {
    const auto value = metadata("kind");
    const Token* kind = value ? value->get_if<Token>() : nullptr;
    return kind ? kind->str() : std::string();
}

Prim Prim::parent() const {
    return Prim(data_->parent);
}

std::vector<Prim> Prim::children() const {
    data_->stage->ensure_children(*data_);
    std::vector<Prim> result;
    for (const auto& child : data_->children) {
        if (is_rendered(*child)) result.emplace_back(child.get());
    }
    return result;
}

std::vector<Prim> Prim::all_children() const {
    data_->stage->ensure_children(*data_);
    std::vector<Prim> result;
    for (const auto& child : data_->children) result.emplace_back(child.get());
    return result;
}

Prim Prim::child(std::string_view name) const {
    data_->stage->ensure_children(*data_);
    for (const auto& child : data_->children) {
        if (child->path.name() == name) return Prim(child.get());
    }
    return {};
}

Prim Prim::prototype() const {
    return Prim(data_->prototype);
}

std::vector<Token> Prim::applied_schemas() const {
    std::vector<Token> names;
    for (auto ref = data_->specs.rbegin(); ref != data_->specs.rend(); ++ref) {
        if (const auto* op = ref->spec->field_as<layer::TokenListOp>(layer::fields().api_schemas)) {
            op->apply_to(names);
        }
    }
    return names;
}

bool Prim::has_api(std::string_view schema) const {
    const auto matches = [&](std::string_view name) {
        return name == schema || (name.size() > schema.size() && name.starts_with(schema) &&
                                  name[schema.size()] == ':');
    };
    for (const Token& name : applied_schemas()) {
        if (matches(name.view())) return true;
    }
    const auto builtin = schema_builtin_apis(data_->type_name.view());
    return std::any_of(builtin.begin(), builtin.end(), matches);
}

std::vector<Token> Prim::property_names() const {
    std::vector<Token> names;
    for (const SpecRef& ref : data_->specs) {
        const auto own = ref.spec->properties();
        names.insert(names.end(), own.begin(), own.end());
    }
    std::sort(names.begin(), names.end());
    names.erase(std::unique(names.begin(), names.end()), names.end());
    return names;
}

Attribute Prim::attribute(std::string_view name) const {
    return Attribute(*this, Token(name));
}

Relationship Prim::relationship(std::string_view name) const {
    return Relationship(*this, Token(name));
}

std::optional<Value> Prim::metadata(std::string_view key) const {
    std::vector<Value> values;
    for (const SpecRef& ref : data_->specs) {
        if (const Value* value = ref.spec->field(Token(key)))
            values.push_back(stage_value(*data_, ref, *value));
    }
    return compose_values(values);
}

std::vector<std::string> Prim::metadata_keys() const {
    std::set<std::string> keys;
    for (const SpecRef& ref : data_->specs) {
        for (const layer::Field& field : ref.spec->fields()) {
            if (!is_composition_field(field.name) && !is_prim_field(field.name))
                keys.insert(field.name.str());
        }
    }
    return {keys.begin(), keys.end()};
}

std::vector<std::pair<std::string, std::string>> Prim::variant_selections() const {
    std::vector<std::pair<std::string, std::string>> result;
    const auto entry_of = [&](const std::string& set) {
        return std::find_if(result.begin(), result.end(),
                            [&](const auto& e) { return e.first == set; });
    };
    // Sets of sites that must not speak are there, too
    for (const compose::Node& node : data_->index.nodes()) {
        if (!node.has_specs) continue;
        for (const std::string& set : compose::site_variant_sets(*node.stack, node.path)) {
            if (entry_of(set) == result.end()) result.emplace_back(set, "");
        }
    }
    // What was chosen stands in the sites of the variant arcs introduced here; an authored choice
    // may lack a variant
    for (const compose::Node& node : data_->index.nodes()) {
        if (node.arc != compose::ArcType::Variant || node.due_to_ancestor) continue;
        if (!node.path.is_variant_selection()) continue;
        const auto entry = entry_of(node.path.variant_set().str());
        if (entry != result.end() && entry->second.empty())
            entry->second = node.path.variant().str();
    }
    return result;
}

std::vector<Prim::SpecSite> Prim::prim_stack() const {
    std::vector<SpecSite> result;
    for (const SpecRef& ref : data_->specs) {
        const compose::Node& node = data_->index.nodes()[size_t(ref.node)];
        result.push_back({ref.layer->layer->identifier(), node.path.to_string(), ref.spec->loc()});
    }
    return result;
}

SourceLoc Prim::loc() const {
    return data_->specs.empty() ? SourceLoc{} : data_->specs.front().spec->loc();
}

Diagnostics& Prim::diagnostics() const {
    return data_->stage->diagnostics();
}

}  // namespace velatura::usd::stage
