// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/compose/layer_stack.h"
#include "usd/compose/prim_graph.h"

#include <vector>

namespace velatura::usd::compose {

/// Drops the nodes of a finished graph that contribute nothing, and puts the rest in order.
class NodeCuller {
  public:
    /// `root_stack`: of the stage.
    NodeCuller(PrimGraph& graph, const LayerStack* root_stack)
        : graph_(graph), root_stack_(root_stack) {}

    void run();

  private:
    bool can_be_culled(int node) const;
    /// Culls a subtree's nodes without opinions, and lists them in `culled` where it is given.
    void cull_empty(int node, std::vector<int>* culled);
    /// Culls the nodes of a subtree whose sites are among those of `culled`; true when all of it is
    /// culled.
    bool cull_matching(int node, const std::vector<int>& culled);

    PrimGraph& graph_;
    const LayerStack* root_stack_;
};

}  // namespace velatura::usd::compose
