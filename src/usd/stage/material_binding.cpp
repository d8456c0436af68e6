// SPDX-License-Identifier: Apache-2.0
#include "usd/stage/material_binding.h"

#include "usd/stage/collection.h"

#include <fmt/format.h>

namespace velatura::usd::stage {

using layer::Path;
using layer::Token;

namespace {

constexpr std::string_view binding_name = "material:binding";
constexpr std::string_view collection_start = "material:binding:collection";

Prim prim_in_stage(const Prim& from, const Path& path) {
    Prim at = from;
    while (at && !at.is_pseudo_root()) at = at.parent();
    for (const Path& step : path.prim_path().prefixes()) {
        if (at) at = at.child(step.name().view());
    }
    return at;
}

bool is_stronger_than_descendants(const Relationship& binding) {
    const auto strength = binding.metadata("bindMaterialAs");
    const Token* word = strength ? strength->get_if<Token>() : nullptr;
    return word && *word == "strongerThanDescendants";
}

MaterialBinding make_binding(const Relationship& relation, const Path& material_path) {
    MaterialBinding binding{{}, relation};
    const Prim material = prim_in_stage(relation.prim(), material_path);
    if (material && material.is_a("Material")) {
        binding.material = material;
        return binding;
    }
    relation.prim().diagnostics().warn(
        "usd-binding-target", relation.loc(), relation.prim().path_string(),
        fmt::format("{} targets <{}>, which is not a Material; the prim gets no material",
                    relation.name().str(), material_path.to_string()));
    return binding;
}

/// "material:binding:collection[:purpose]:name" of the purpose asked for.
bool is_collection_binding(const Token& name, std::string_view purpose) {
    std::string_view rest = name.view();
    if (!rest.starts_with(collection_start)) return false;
    rest.remove_prefix(collection_start.size());
    if (rest.empty() || rest.front() != ':') return false;
    rest.remove_prefix(1);
    const size_t colon = rest.find(':');
    const std::string_view found =
        colon == std::string_view::npos ? std::string_view() : rest.substr(0, colon);
    return found == purpose;
}

/// The binding that `owner` makes for `target` under one purpose: a collection that holds it, else
/// the direct one.
MaterialBinding binding_on(const Prim& owner, const Prim& target, std::string_view purpose) {
    for (const Token& name : owner.property_names()) {
        if (!is_collection_binding(name, purpose)) continue;
        const Relationship relation = owner.relationship(name.view());
        const std::vector<Path> targets = relation.targets();
        Path collection, material;
        for (const Path& path : targets) (path.is_property() ? collection : material) = path;
        if (targets.size() != 2 || collection.is_empty() || material.is_empty()) continue;
        const std::string property = collection.name().str();
        const Prim holder = prim_in_stage(owner, collection);
        if (!holder || !property.starts_with("collection:")) continue;
        const CollectionQuery query(holder, std::string_view(property).substr(11));
        if (query.includes(target.path())) return make_binding(relation, material);
    }
    const std::string direct =
        purpose.empty() ? std::string(binding_name) : fmt::format("{}:{}", binding_name, purpose);
    const Relationship relation = owner.relationship(direct);
    if (!relation.is_valid()) return {};
    const std::vector<Path> targets = relation.targets();
    if (targets.empty()) return {};
    return make_binding(relation, targets.front());
}

/// The binding that reaches the prim under one purpose alone.
MaterialBinding resolve_one(const Prim& prim, std::string_view purpose) {
    MaterialBinding winner;
    for (Prim owner = prim; owner && !owner.is_pseudo_root(); owner = owner.parent()) {
        const MaterialBinding binding = binding_on(owner, prim, purpose);
        if (!binding.is_bound()) continue;
        if (!winner.is_bound() || is_stronger_than_descendants(binding.relation)) winner = binding;
    }
    return winner;
}

}  // namespace

MaterialBinding resolve_material(Prim prim, std::string_view purpose) {
    if (!purpose.empty()) {
        const MaterialBinding binding = resolve_one(prim, purpose);
        if (binding.is_bound()) return binding;
    }
    return resolve_one(prim, "");
}

MaterialBinding resolve_material(Prim prim, std::span<const std::string> purposes) {
    for (const std::string& purpose : purposes) {
        const MaterialBinding binding = resolve_one(prim, purpose);
        if (binding.is_bound()) return binding;
    }
    return resolve_one(prim, "");
}

std::vector<Prim> material_subsets(Prim mesh) {
    std::vector<Prim> subsets;
    for (const Prim& child : mesh.children()) {
        if (child.type_name() != "GeomSubset") continue;
        if (child.attribute("familyName").get<std::string>().value_or("") != "materialBind")
            continue;
        if (child.attribute("elementType").get<std::string>().value_or("face") != "face") continue;
        subsets.push_back(child);
    }
    return subsets;
}

}  // namespace velatura::usd::stage
