// SPDX-License-Identifier: Apache-2.0
#include "usd/stage/collection.h"

#include <fmt/format.h>

#include <algorithm>

namespace velatura::usd::stage {

using layer::Path;

namespace {

constexpr std::string_view collection_prefix = "collection:";
constexpr size_t max_nesting = 100;
constexpr size_t max_weight = 10000;

/// "/Prim.collection:name" → "name"; empty when the path is no collection.
std::string collection_name(const Path& path) {
    if (!path.is_property()) return {};
    const std::string& property = path.name().str();
    return property.starts_with(collection_prefix) ? property.substr(collection_prefix.size())
                                                   : std::string();
}

std::string collection_key(const Path& prim, const std::string& name) {
    return prim.to_string() + ":" + name;
}

Prim prim_below(Prim root, const Path& path) {
    for (const Path& step : path.prefixes()) {
        if (root) root = root.child(step.name().view());
    }
    return root;
}

}  // namespace

CollectionQuery::CollectionQuery(Prim prim, std::string_view name) : root_(prim) {
    Reading reading;
    *this = CollectionQuery(prim, name, reading);
}

CollectionQuery::CollectionQuery(Prim prim, std::string_view name, Reading& reading) : root_(prim) {
    while (!root_.is_pseudo_root()) root_ = root_.parent();
    std::set<std::string> open;
    add_collection(prim, name, open);
    const std::string key = collection_key(prim.path(), std::string(name));
    reading.open.insert(key);
    if (rules_.empty()) read_expression(prim, name, reading);
    reading.open.erase(key);
}

void CollectionQuery::read_expression(Prim prim, std::string_view name, Reading& reading) {
    const std::string attribute =
        std::string(collection_prefix) + std::string(name) + ":membershipExpression";
    if (!prim.attribute(attribute).has_authored_value()) return;
    expression_ =
        std::make_shared<const PathExpressionNode>(membership_expression(prim, attribute));
    find_referenced(*expression_, reading);
    if (weight_ <= max_weight) return;
    prim.diagnostics().error(
        "usd-collection-size", prim.loc(), prim.path_string(),
        fmt::format("collection {} refers to more than {} collections", name, max_weight));
    expression_ = std::make_shared<const PathExpressionNode>();
    weight_ = 1;
}

void CollectionQuery::find_referenced(const PathExpressionNode& node, Reading& reading) {
    for (const PathExpressionNode& operand : node.operands) find_referenced(operand, reading);
    if (node.op != PathExpressionNode::Op::Collection) return;
    const std::string key = collection_key(node.collection_prim, node.collection_name);
    const Prim owner = prim_below(root_, node.collection_prim);
    if (!owner) return;
    if (reading.open.count(key) != 0 || reading.open.size() > max_nesting) {
        owner.diagnostics().error(
            "usd-collection-cycle", owner.loc(), owner.path_string(),
            fmt::format("collection {} refers to itself", node.collection_name));
        return;
    }
    auto& query = reading.done[key];
    if (!query) {
        query = std::shared_ptr<const CollectionQuery>(
            new CollectionQuery(owner, node.collection_name, reading));
    }
    referenced_[key] = query;
    weight_ = std::min(weight_ + query->weight_, 2 * max_weight);
}

void CollectionQuery::add_collection(Prim prim,
                                     std::string_view name,
                                     std::set<std::string>& open) {
    const std::string base = std::string(collection_prefix) + std::string(name) + ":";
    const std::string key = collection_key(prim.path(), std::string(name));
    // What was added before adds nothing new
    if (!open.insert(key).second) return;
    const Relationship includes = prim.relationship(base + "includes");
    const Relationship excludes = prim.relationship(base + "excludes");
    // Filters of renderers whose schemas are not known here derive from UsdLuxLightFilter, whose
    // filterLink has the root
    const bool has_root = name == "filterLink";
    const auto include_root = prim.attribute(base + "includeRoot").get<bool>().value_or(has_root);
    const std::string expansion =
        prim.attribute(base + "expansionRule").get<std::string>().value_or("expandPrims");
    const Rule rule = expansion == "explicitOnly" ? Rule::ExplicitOnly : Rule::ExpandPrims;
    const std::vector<Path> members = includes.targets();
    if (include_root) rules_["/"] = Rule::ExpandPrims;
    for (const Path& path : members) {
        const std::string nested = collection_name(path);
        if (nested.empty()) {
            rules_[path.to_string()] = rule;
            continue;
        }
        // A nested collection contributes with its own rules
        const Prim owner = prim_below(root_, path.prim_path());
        if (owner) add_collection(owner, nested, open);
    }
    for (const Path& path : excludes.targets()) rules_[path.to_string()] = Rule::Exclude;
}

bool CollectionQuery::includes(const Path& path) const {
    if (expression_) {
        return matches(*expression_, path, root_,
                       [&](const Path& prim, const std::string& name, const Path& member) {
                           const auto found = referenced_.find(collection_key(prim, name));
                           return found != referenced_.end() && found->second->includes(member);
                       });
    }
    return ruling(path, true).value_or(false);
}

std::optional<bool> CollectionQuery::ruling(const Path& path, bool with_root) const {
    for (Path at = path; !at.is_empty(); at = at.parent()) {
        if (at.is_absolute_root() && !with_root) break;
        const auto rule = rules_.find(at.to_string());
        if (rule == rules_.end()) continue;
        if (rule->second == Rule::Exclude) return false;
        return rule->second == Rule::ExpandPrims || at == path;
    }
    return std::nullopt;
}

bool CollectionQuery::includes_first(const std::vector<Path>& paths) const {
    if (expression_)
        return std::any_of(paths.begin(), paths.end(),
                           [&](const Path& path) { return includes(path); });
    for (const Path& path : paths) {
        if (const std::optional<bool> found = ruling(path, false)) return *found;
    }
    return ruling(Path::absolute_root(), true).value_or(false);
}

std::optional<bool> CollectionQuery::ruling_at(const Path& path) const {
    if (expression_) return includes(path) ? std::optional<bool>(true) : std::nullopt;
    const auto rule = rules_.find(path.to_string());
    if (rule == rules_.end()) return std::nullopt;
    return rule->second != Rule::Exclude;
}

std::vector<Path> CollectionQuery::rule_paths() const {
    std::vector<Path> paths;
    for (const auto& [path, rule] : rules_) paths.push_back(Path::from(path));
    return paths;
}

std::string CollectionQuery::rule_text() const {
    std::string text;
    for (const auto& [path, rule] : rules_) text += fmt::format("{} {}\n", int(rule), path);
    return text;
}

}  // namespace velatura::usd::stage
