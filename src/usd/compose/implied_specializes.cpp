// SPDX-License-Identifier: Apache-2.0
#include "usd/compose/implied_specializes.h"

#include "usd/compose/site.h"

namespace velatura::usd::compose {

void ImpliedSpecializes::eval(int i) {
    if (graph_[i].parent < 0) return;
    if (!graph_.is_propagated_specialize(i)) {
        find(i);
        return;
    }
    const int origin = graph_[i].origin;
    for (const int c : graph_.children(i)) propagate_to_origin(origin, c, graph_[c].to_parent, i);
}

int ImpliedSpecializes::propagate_node(int parent, int source, MapPtr map, int tree, bool to_root) {
    if (graph_[source].parent == parent) return source;
    ArcRequest request;
    request.arc = graph_[source].arc;
    request.parent = parent;
    request.stack = graph_[source].stack;
    request.path = graph_[source].path;
    request.map = map;
    const bool is_implied = graph_.is_implied_class(source);
    int copy = arcs_.matching_child(parent, request, graph_.depth_below_introduction(source));
    // Classes implied within the subtree will be implied there again
    if (copy < 0 && !(is_implied && graph_.is_in_subtree(graph_[source].origin, tree))) {
        request.origin = source == tree || is_implied ? source : parent;
        request.number = graph_[source].sibling_number;
        request.namespace_depth = source == tree ? prim_depth(graph_[parent].path)
                                                 : size_t(graph_[source].namespace_depth);
        request.contributes = graph_[source].contributes();
        request.skip_implied_specializes = to_root;
        request.skip_authored_arcs = !to_root;
        copy = arcs_.add(request);
    }
    if (copy < 0) {
        graph_.make_subtree_inert(source);
        return -1;
    }
    if (graph_[copy].only_implies && graph_[source].contributes()) {
        // It speaks from now on: its variants have not been looked at
        graph_.edit(copy).only_implies = false;
        if (site_arcs(*graph_[copy].stack, graph_[copy].path).variants)
            build_.tasks.add(Task::VariantSets, copy);
    }
    // Remember in the source how deep the copy had lost its say, for the way back
    const uint16_t restricted = graph_[copy].restricted_depth;
    if (!graph_[source].moved) graph_.set_inert(copy, !graph_[source].contributes());
    if (graph_[source].contributes()) {
        graph_.edit(copy).moved = false;
        graph_.edit(source).moved = true;
    }
    graph_.set_inert(source, true);
    if (restricted != 0) graph_.edit(source).restricted_depth = restricted;
    return copy;
}

void ImpliedSpecializes::propagate_to_root(int parent, int source, MapPtr map, int tree) {
    const int copy = propagate_node(parent, source, map, tree, true);
    if (copy < 0) return;
    for (const int c : graph_.children(source)) {
        if (graph_[c].arc != ArcType::Specialize)
            propagate_to_root(copy, c, graph_[c].to_parent, tree);
    }
}

void ImpliedSpecializes::propagate_to_origin(int parent, int source, MapPtr map, int tree) {
    const int copy = propagate_node(parent, source, map, tree, false);
    if (copy < 0) return;
    for (const int c : graph_.children(source))
        propagate_to_origin(copy, c, graph_[c].to_parent, tree);
}

void ImpliedSpecializes::find(int i) {
    // Place holders below relocated sites have no opinions to move
    const int parent = graph_[i].parent;
    if (parent >= 0 && parent != graph_[i].origin && graph_[parent].arc == ArcType::Relocate &&
        graph_[parent].stack == graph_[i].stack && graph_[parent].path == graph_[i].path) {
        return;
    }
    if (graph_[i].arc == ArcType::Specialize) {
        const bool was_inert = !graph_[i].contributes();
        const uint16_t restricted = graph_[i].restricted_depth;
        graph_.set_inert(i, false);
        graph_.edit(i).moved = false;
        propagate_to_root(0, i, graph_[i].to_root, i);
        if (was_inert) graph_.edit(i).restricted_depth = restricted;
    }
    for (const int c : graph_.children(i)) find(c);
}

}  // namespace velatura::usd::compose
