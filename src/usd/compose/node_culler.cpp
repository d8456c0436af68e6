// SPDX-License-Identifier: Apache-2.0
#include "usd/compose/node_culler.h"

#include <algorithm>

namespace velatura::usd::compose {

void NodeCuller::run() {
    if (graph_.size() < 2) return;
    // A specializes node stands in the graph twice: at the root, where it speaks, and where it was
    // introduced. Weakest first, what is dropped there is dropped here too.
    std::vector<int> top = graph_.children(0);
    for (auto c = top.rbegin(); c != top.rend(); ++c) {
        if (!graph_.is_propagated_specialize(*c)) continue;
        std::vector<int> culled;
        cull_empty(*c, &culled);
        cull_matching(graph_[*c].origin, culled);
    }
    for (const int c : top) {
        if (!graph_.is_propagated_specialize(c)) cull_empty(c, nullptr);
    }
    graph_.finalize();
}

bool NodeCuller::can_be_culled(int i) const {
    const Node& n = graph_[i];
    if (n.culled) return true;
    if (n.parent < 0 || graph_.depth_below_introduction(i) == 0) return false;
    if (n.arc == ArcType::Inherit && n.stack == root_stack_) {
        // Which prims a prim inherits from is a fact of the stage, opinions or not
        int origin = i;
        if (n.origin != n.parent) {
            while (graph_[origin].origin != graph_[origin].parent) origin = graph_[origin].origin;
        }
        if (!graph_.path_at_introduction(origin).is_root_prim()) return false;
    }
    for (int c = n.first_child; c >= 0; c = graph_[c].next_sibling) {
        if (!graph_[c].culled) return false;
    }
    return !(n.has_specs && n.contributes());
}

void NodeCuller::cull_empty(int i, std::vector<int>* culled) {
    for (int c = graph_[i].first_child; c >= 0; c = graph_[c].next_sibling) {
        if (graph_[c].arc != ArcType::Specialize) cull_empty(c, culled);
    }
    if (!can_be_culled(i)) return;
    graph_.set_culled(i);
    if (culled) culled->push_back(i);
}

bool NodeCuller::cull_matching(int i, const std::vector<int>& culled) {
    bool all = true;
    for (int c = graph_[i].first_child; c >= 0; c = graph_[c].next_sibling)
        all = cull_matching(c, culled) && all;
    const auto is_same = [&](int other) {
        return graph_[other].stack == graph_[i].stack && graph_[other].path == graph_[i].path;
    };
    if (all && std::any_of(culled.begin(), culled.end(), is_same)) graph_.set_culled(i);
    return graph_[i].culled;
}

}  // namespace velatura::usd::compose
