// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/stage/stage.h"

#include <map>
#include <string>
#include <string_view>

namespace velatura::usd::stage {

/// Membership rule of one UsdCollectionAPI instance, evaluated once and queried for many paths.
/// The deepest rule that covers a path wins. Path expressions are not evaluated; a warning says so.
class CollectionQuery {
  public:
    /// The collection `name` on `prim`; an absent collection has no members.
    CollectionQuery(Prim prim, std::string_view name);

    bool includes(const layer::Path& path) const;

    bool is_empty() const { return rules_.empty(); }

  private:
    enum class Rule : unsigned char { Exclude, ExplicitOnly, ExpandPrims };

    void add_collection(Prim prim, std::string_view name, int depth);

    std::map<std::string, Rule> rules_;
};

}  // namespace velatura::usd::stage
