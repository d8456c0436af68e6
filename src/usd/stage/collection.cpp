// SPDX-License-Identifier: Apache-2.0
#include "usd/stage/collection.h"

#include <fmt/format.h>

namespace velatura::usd::stage {

using layer::Path;

namespace {

constexpr std::string_view collection_prefix = "collection:";
constexpr int max_nesting = 100;

/// "/Prim.collection:name" → "name"; empty when the path is no collection.
std::string collection_name(const Path& path) {
    if (!path.is_property()) return {};
    const std::string& property = path.name().str();
    return property.starts_with(collection_prefix) ? property.substr(collection_prefix.size())
                                                   : std::string();
}

}  // namespace

CollectionQuery::CollectionQuery(Prim prim, std::string_view name) {
    add_collection(prim, name, 0);
}

void CollectionQuery::add_collection(Prim prim, std::string_view name, int depth) {
    const std::string base = std::string(collection_prefix) + std::string(name) + ":";
    if (depth > max_nesting) {
        prim.diagnostics().error("usd-collection-cycle", prim.loc(), prim.path_string(),
                                 fmt::format("collection {} includes itself", name));
        return;
    }
    const Relationship includes = prim.relationship(base + "includes");
    const Relationship excludes = prim.relationship(base + "excludes");
    const auto include_root = prim.attribute(base + "includeRoot").get<bool>().value_or(false);
    const std::string expansion =
        prim.attribute(base + "expansionRule").get<std::string>().value_or("expandPrims");
    const Rule rule = expansion == "explicitOnly" ? Rule::ExplicitOnly : Rule::ExpandPrims;
    const Attribute expression = prim.attribute(base + "membershipExpression");
    const std::vector<Path> members = includes.targets();
    if (members.empty() && !include_root && expression.has_authored_value()) {
        prim.diagnostics().warn(
            "usd-membership-expression", expression.loc(), prim.path_string(),
            fmt::format("membershipExpression of collection {} is not evaluated", name));
    }
    if (include_root) rules_["/"] = Rule::ExpandPrims;
    for (const Path& path : members) {
        const std::string nested = collection_name(path);
        if (nested.empty()) {
            rules_[path.to_string()] = rule;
            continue;
        }
        // A nested collection contributes with its own rules
        Prim owner = prim;
        while (!owner.is_pseudo_root()) owner = owner.parent();
        for (const Path& step : path.prim_path().prefixes()) {
            if (owner) owner = owner.child(step.name().view());
        }
        if (owner) add_collection(owner, nested, depth + 1);
    }
    for (const Path& path : excludes.targets()) rules_[path.to_string()] = Rule::Exclude;
}

bool CollectionQuery::includes(const Path& path) const {
    for (Path at = path; !at.is_empty(); at = at.parent()) {
        const auto rule = rules_.find(at.to_string());
        if (rule == rules_.end()) continue;
        if (rule->second == Rule::Exclude) return false;
        return rule->second == Rule::ExpandPrims || at == path;
    }
    return false;
}

}  // namespace velatura::usd::stage
