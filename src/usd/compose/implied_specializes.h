// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/compose/arc_adder.h"
#include "usd/compose/index_build.h"

namespace velatura::usd::compose {

/// Moves what specializes arcs bring to where it is weakest. That is weaker than everything else
/// about a prim, so its subtree is moved to the root of the graph, where its strength is the last,
/// and an inert copy stays where the arc is. When arcs are found below the moved subtree, they are
/// copied back to that place, from where classes are implied as usual, and moved again.
class ImpliedSpecializes {
  public:
    ImpliedSpecializes(IndexBuild& build, ArcAdder& arcs)
        : build_(build), graph_(build.graph), arcs_(arcs) {}

    /// Moves what is at or below a node; copies back what is below a node that was moved.
    void eval(int node);

  private:
    /// Moves the specializes nodes at and below a node.
    void find(int node);
    void propagate_to_root(int parent, int source, MapPtr map, int tree);
    void propagate_to_origin(int parent, int source, MapPtr map, int tree);
    /// The copy of `source` below `parent`, new or known; -1 when there can be none. `tree`: root
    /// of the subtree under way.
    int propagate_node(int parent, int source, MapPtr map, int tree, bool to_root);

    IndexBuild& build_;
    PrimGraph& graph_;
    ArcAdder& arcs_;
};

}  // namespace velatura::usd::compose
