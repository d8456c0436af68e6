// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/diagnostics.h"
#include "usd/compose/composition_error.h"
#include "usd/compose/index_frame.h"
#include "usd/compose/prim_index.h"
#include "usd/compose/task_queue.h"
#include "usd/layer/path.h"

#include <string>
#include <vector>

namespace velatura::usd::compose {

class Composer;

/// One prim index under construction: what the types that follow its arcs share.
class IndexBuild {
  public:
    IndexBuild(Composer& owner, PrimIndex& target, layer::Path prim, const IndexFrame* waiting)
        : composer(owner), index(target), graph(target.graph_), stage_path(prim), frame(waiting) {}

    AncestorWalk climb(int node) const { return {&graph, node, frame}; }

    /// Adds an error at a node.
    void report(
        ErrorKind kind, int node, SourceLoc loc, std::string message, const char* code = "");
    /// Adds errors about a node's site, and clears the list.
    void report_all(std::vector<CompositionError>& errors, int node);

    /// Remembers that the index, or one it was built from, has payloads, or includes them.
    void note_payloads(bool has, bool included);
    void forget_payloads();

    Composer& composer;
    PrimIndex& index;
    PrimGraph& graph;         ///< of the index
    layer::Path stage_path;   ///< prim of the stage in whose service this runs
    const IndexFrame* frame;  ///< nullptr: the index of a stage's prim
    TaskQueue tasks;
};

}  // namespace velatura::usd::compose
