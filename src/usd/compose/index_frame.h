// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/compose/map_function.h"
#include "usd/compose/prim_graph.h"
#include "usd/layer/path.h"

namespace velatura::usd::compose {

/// The index under construction for whose sake another index is built: an arc from `parent` of that
/// graph leads to `requested`, whose ancestors are being composed first.
struct IndexFrame {
    const PrimGraph* graph = nullptr;   ///< the graph that waits
    const IndexFrame* outer = nullptr;  ///< for whose sake that graph is built
    int parent = -1;                    ///< node of that graph the arc starts from
    ArcType arc = ArcType::Root;        ///< the arc
    MapPtr to_parent = nullptr;         ///< requested namespace → parent's namespace
    layer::Path requested;              ///< site the arc leads to
    bool skip_duplicates = false;       ///< leave out sites that the waiting graph has already
};

/// Steps from a node of a graph to the roots of it and of the graphs that wait.
struct AncestorWalk {
    const PrimGraph* graph;  ///< nullptr: above the last root
    int node;
    const IndexFrame* frame;

    explicit operator bool() const { return graph != nullptr; }

    const Node& here() const { return (*graph)[node]; }

    ArcType arc() const {
        const ArcType own = here().arc;
        return own == ArcType::Root && frame ? frame->arc : own;
    }

    void up() {
        if (here().parent >= 0) {
            node = here().parent;
        } else {
            next_frame();
        }
    }

    void next_frame() {
        if (!frame) {
            graph = nullptr;
            return;
        }
        node = frame->parent;
        graph = frame->graph;
        frame = frame->outer;
    }
};

}  // namespace velatura::usd::compose
