// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/compose/arc_adder.h"
#include "usd/compose/class_arcs.h"
#include "usd/compose/implied_specializes.h"
#include "usd/compose/index_build.h"
#include "usd/compose/reference_arcs.h"
#include "usd/compose/relocate_arcs.h"
#include "usd/compose/task_finder.h"
#include "usd/compose/variant_arcs.h"

namespace velatura::usd::compose {

/// Follows the arcs of one prim: starts from the graph of its parent prim with the child's name
/// appended to all sites, and runs tasks in a fixed order of kinds until none is left.
/// Ref: AOUSD Core Specification 1.0.1, §10; the kinds of tasks and their order follow Pixar's Pcp.
class PrimIndexer {
  public:
    PrimIndexer(Composer& composer,
                PrimIndex& index,
                layer::Path stage_path,
                const IndexFrame* frame);
    PrimIndexer(const PrimIndexer&) = delete;
    PrimIndexer& operator=(const PrimIndexer&) = delete;

    /// Makes the graph of one site without arcs.
    void start(LayerStack* stack, layer::Path path);
    /// Steps down to a child prim. `root_contributes`: the site itself may hold opinions.
    void descend(layer::Token name, bool parent_is_instance, bool root_contributes = true);
    /// Follows every arc of the nodes.
    void run();
    /// Drops what contributes nothing, and puts the nodes in order. Of a stage's prim only.
    void finish();

  private:
    bool run_next();
    void run_task(Task task, int node);

    IndexBuild build_;
    PrimGraph& graph_;
    TaskFinder finder_;
    ArcAdder arcs_;
    RelocateArcs relocates_;
    ReferenceArcs references_;
    ClassArcs classes_;
    ImpliedSpecializes specializes_;
    VariantArcs variants_;
};

}  // namespace velatura::usd::compose
