// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/compose/arc_adder.h"
#include "usd/compose/index_build.h"

namespace velatura::usd::compose {

/// Follows relocations: a prim that was moved gets the opinions on its source, and nothing stays at
/// the source.
class RelocateArcs {
  public:
    RelocateArcs(IndexBuild& build, ArcAdder& arcs)
        : build_(build), composer_(build.composer), graph_(build.graph), arcs_(arcs) {}

    /// Empties the graph, with an error where an arc leads here, when the prim is relocated away;
    /// false when it is not.
    bool drop_if_prohibited();
    /// Adds the source of a node's site, if it is the target of a relocation.
    void eval(int node);
    /// Adds the source of a relocation to the graph further up, as a place holder for classes.
    void eval_implied(int node);

  private:
    void cull_subtree(int top);
    void cull_relocated(int top);

    IndexBuild& build_;
    Composer& composer_;
    PrimGraph& graph_;
    ArcAdder& arcs_;
};

}  // namespace velatura::usd::compose
