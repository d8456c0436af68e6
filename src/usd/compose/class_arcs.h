// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/compose/arc_adder.h"
#include "usd/compose/index_build.h"

namespace velatura::usd::compose {

/// Follows inherits and specializes arcs to their classes, and implies classes further up: a class
/// of a referenced prim is a class of the referencing prim too.
class ClassArcs {
  public:
    ClassArcs(IndexBuild& build, ArcAdder& arcs)
        : build_(build), composer_(build.composer), graph_(build.graph), arcs_(arcs) {}

    /// Adds the classes of a node's site. `arc`: Inherit or Specialize.
    void eval(int node, ArcType arc);
    /// Adds the classes below a node to its parent.
    void eval_implied(int node);

  private:
    /// The node of a class, new or known. `same_stack`, `same_path`: the site that implies it.
    int add(ArcRequest request, const LayerStack* same_stack, layer::Path same_path);
    void imply_tree(int dest, int source, const MapFunction& transfer, bool is_start);

    IndexBuild& build_;
    Composer& composer_;
    PrimGraph& graph_;
    ArcAdder& arcs_;
};

}  // namespace velatura::usd::compose
