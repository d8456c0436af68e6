// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/stage/path_expression.h"
#include "usd/stage/stage.h"

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace velatura::usd::stage {

/// Membership rule of one UsdCollectionAPI instance, evaluated once and queried for many paths.
/// The deepest rule that covers a path wins. Where no path is included or excluded and the root is
/// not, the path expression `membershipExpression` decides instead.
class CollectionQuery {
  public:
    /// The collection `name` on `prim`; an absent collection has no members.
    CollectionQuery(Prim prim, std::string_view name);

    bool includes(const layer::Path& path) const;

    /// Of something that goes by several paths: the first of them decides that a rule deeper than
    /// the root covers, else the root does. An expression must match one.
    bool includes_first(const std::vector<layer::Path>& paths) const;

    /// What a rule for this very path says, or an expression that matches it.
    std::optional<bool> ruling_at(const layer::Path& path) const;

    /// The paths that rules are for; none of an expression.
    std::vector<layer::Path> rule_paths() const;

    bool has_expression() const { return expression_ != nullptr; }

    /// The same for collections with the same members, by rules; empty: no rules, an expression or
    /// nothing decides.
    std::string rule_text() const;

    bool is_empty() const { return rules_.empty() && !expression_; }

  private:
    enum class Rule : unsigned char { Exclude, ExplicitOnly, ExpandPrims };

    /// Collections on the way, and those that are read already.
    struct Reading {
        std::set<std::string> open;
        std::map<std::string, std::shared_ptr<const CollectionQuery>> done;
    };

    /// What the deepest rule that covers the path says; the root's counts when `with_root`.
    std::optional<bool> ruling(const layer::Path& path, bool with_root) const;
    CollectionQuery(Prim prim, std::string_view name, Reading& reading);
    void add_collection(Prim prim, std::string_view name, std::set<std::string>& open);
    void read_expression(Prim prim, std::string_view name, Reading& reading);
    void find_referenced(const PathExpressionNode& node, Reading& reading);

    std::map<std::string, Rule> rules_;
    std::shared_ptr<const PathExpressionNode> expression_;
    Prim root_;
    /// Collections that the expression refers to, by "/Prim:name".
    std::map<std::string, std::shared_ptr<const CollectionQuery>> referenced_;
    size_t weight_ = 1;  ///< collections that one question may ask, this one included
};

}  // namespace velatura::usd::stage
