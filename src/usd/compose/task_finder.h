// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/compose/composer.h"
#include "usd/compose/index_build.h"

namespace velatura::usd::compose {

/// What TaskFinder leaves out, or adds, for a new part of the graph.
struct TaskFilter {
    bool skip_authored_arcs = false;
    bool skip_implied_specializes = false;
    bool with_unresolved_paths = false;
    bool with_ancestral_variants = false;
};

/// Finds what is to be done for new nodes: arcs that are authored at their sites, and classes that
/// they imply further up.
class TaskFinder {
  public:
    explicit TaskFinder(IndexBuild& build)
        : build_(build), composer_(build.composer), graph_(build.graph) {}

    /// Adds the tasks of a new subtree, and those of the nodes above that it may carry classes to.
    void add(int node, const TaskFilter& filter);
    /// Adds the tasks of a subtree alone.
    void add_below(int top, const TaskFilter& filter);

  private:
    void scan_ancestral_variants(int node);
    /// The node from which the hierarchy of classes that a class stands in is implied.
    int implied_class_start(int class_node) const;
    /// The topmost specializes node above a node or the node itself; -1 when there is none.
    int specialize_start(int node) const;

    IndexBuild& build_;
    Composer& composer_;
    PrimGraph& graph_;
};

}  // namespace velatura::usd::compose
