// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/diagnostics.h"
#include "usd/compose/composer.h"
#include "usd/compose/index_build.h"
#include "usd/compose/task_finder.h"

#include <cstddef>
#include <optional>
#include <string>

namespace velatura::usd::compose {

/// An arc that is to be added to a graph.
struct ArcRequest {
    ArcType arc = ArcType::Reference;
    int parent = -1;
    int origin = -1;
    LayerStack* stack = nullptr;
    layer::Path path;
    MapPtr map = nullptr;
    int number = 0;                              ///< place in its list
    std::optional<size_t> namespace_depth = {};  ///< of the parent's path when not given
    bool contributes = true;
    bool ancestral = false;  ///< bring the opinions that the site's ancestors imply
    bool skip_duplicates = false;
    bool skip_implied_specializes = false;
    bool skip_authored_arcs = false;
    SourceLoc loc = {};
};

/// Adds arcs to the graph under construction: checks limits, cycles and duplicates, composes the
/// site that an arc leads to where its ancestors count, and adds the tasks that come of it.
class ArcAdder {
  public:
    ArcAdder(IndexBuild& build, TaskFinder& tasks)
        : build_(build), composer_(build.composer), graph_(build.graph), tasks_(tasks) {}

    /// The new node; -1 when there is none, after an error if one is due.
    int add(ArcRequest request);

    /// The map of an arc from `parent` to a source prim. `root_identity`: what the arc does not
    /// move is seen as it is.
    MapPtr arc_map(int parent, layer::Path source, TimeOffset offset, bool root_identity) const;
    /// The child that a request would add again, its arc made `depth` levels of namespace above; -1
    /// when there is none.
    int matching_child(int parent, const ArcRequest& request, size_t depth) const;

  private:
    bool is_within_limits(const ArcRequest& request);
    bool makes_cycle(const ArcRequest& request) const;
    std::string describe_cycle(const ArcRequest& request) const;
    bool is_duplicate(const ArcRequest& request) const;
    Node arc_node(const ArcRequest& request) const;
    int add_node(const ArcRequest& request);
    int add_graph(const ArcRequest& request);

    IndexBuild& build_;
    Composer& composer_;
    PrimGraph& graph_;
    TaskFinder& tasks_;
    bool overflow_ = false;
};

}  // namespace velatura::usd::compose
