// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/compose/arc_adder.h"
#include "usd/compose/index_build.h"

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace velatura::usd::compose {

/// Follows variant sets: chooses a variant of each, the strongest node first, and waits with those
/// that have no selection for opinions that select.
class VariantArcs {
  public:
    VariantArcs(IndexBuild& build, ArcAdder& arcs)
        : build_(build), composer_(build.composer), graph_(build.graph), arcs_(arcs) {}

    /// Lets the variant sets of a node's site wait for their turn.
    void eval_sets(int node);
    /// The same of its ancestors' variant sets.
    void eval_ancestral_sets(int node);
    /// Chooses the variant of the next set that waits for a kind of task; false when none does.
    bool run(Task task);

    /// Sets without a selection have had their last chance.
    void drop_unselected(bool ancestral) { unselected_[ancestral ? 1 : 0].clear(); }

  private:
    struct Set {
        int node;
        layer::Path site;  ///< that has the variant set: the node's, or an ancestor of it
        std::string name;
        int number;  ///< of the set at its site
    };

    void add_sets(int node, layer::Path site, bool ancestral);
    void eval(const Set& set, bool ancestral, bool use_fallback);
    void add(const Set& set, const std::string& selection, bool ancestral);
    /// Lets all that wait be chosen again.
    void retry();
    std::optional<std::string> variant_selection(int node,
                                                 layer::Path site,
                                                 const std::string& set);
    std::string variant_fallback(const Set& set) const;
    /// False where a node has lost its say, at its own site or an ancestor's.
    bool can_have_opinions_at(int node, layer::Path path) const;

    IndexBuild& build_;
    Composer& composer_;
    PrimGraph& graph_;
    ArcAdder& arcs_;
    std::array<std::vector<Set>, 4> pending_;  ///< ancestral: authored, fallback; plain: the same
    std::array<std::vector<Set>, 2> unselected_;  ///< plain, ancestral
};

}  // namespace velatura::usd::compose
