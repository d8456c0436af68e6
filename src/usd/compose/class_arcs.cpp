// SPDX-License-Identifier: Apache-2.0
#include "usd/compose/class_arcs.h"

#include "usd/compose/site.h"

#include <fmt/format.h>

namespace velatura::usd::compose {

using layer::Path;

namespace {

/// The class a prim at `parent` inherits by a map: not the path that the arc was authored with, so
/// that relocations on the way count. Inside a variant the class is sought in that variant.
Path class_path(Path parent, const MapFunction& map) {
    if (!parent.has_variant_selection()) return map.to_source(parent);
    Path variant = parent;
    while (!variant.is_variant_selection()) variant = variant.parent();
    const Path path = map.to_source(parent.strip_variant_selections());
    return path.is_empty()
               ? path
               : path.replace_prefix(variant.strip_variant_selections(), variant, false);
}

}  // namespace

void ClassArcs::eval(int i, ArcType arc) {
    if (!graph_[i].contributes()) return;
    const std::vector<SiteClass> classes =
        site_classes(*graph_[i].stack, graph_[i].path, arc == ArcType::Specialize);
    int number = 0;
    for (const SiteClass& target : classes) {
        ArcRequest request;
        request.arc = arc;
        request.parent = request.origin = i;
        request.number = number++;
        request.loc = target.loc;
        if (!target.path.is_prim() || !target.path.is_absolute() ||
            target.path.has_variant_selection()) {
            build_.report(ErrorKind::InvalidPrimPath, i, target.loc,
                          fmt::format("{} arc to <{}> is invalid: expected an absolute prim path",
                                      arc_name(arc), target.path.to_string()));
            continue;
        }
        request.map = arcs_.arc_map(i, target.path, {}, true);
        add(request, nullptr, {});
    }
}

int ClassArcs::add(ArcRequest request, const LayerStack* same_stack, Path same_path) {
    const Path parent_path = graph_[request.parent].path;
    request.stack = graph_[request.parent].stack;
    request.path = class_path(parent_path, *request.map);
    // A class outside of what the parent can see is no error; it is only not there
    if (request.path.is_empty()) return -1;
    const int known = arcs_.matching_child(request.parent, request,
                                           graph_.depth_below_introduction(request.origin));
    if (known >= 0) {
        // Of several arcs that imply one class the strongest counts
        if (request.arc == ArcType::Specialize && request.parent != request.origin &&
            graph_.is_implied_class(known) && graph_[known].arc == request.arc) {
            graph_.strengthen_origin(known, request.origin, uint16_t(request.number));
        }
        return known;
    }

    // A class that is implied unchanged stays as a place holder, so that it goes on further up, but
    // must not speak twice
    request.contributes =
        request.path != parent_path && !(request.stack == same_stack && request.path == same_path);
    request.skip_duplicates = request.contributes;
    request.ancestral = request.contributes && !request.path.is_root_prim();
    return arcs_.add(request);
}

void ClassArcs::eval_implied(int i) {
    // Below a specializes node at the root classes are implied from where it came
    if (graph_[i].parent < 0 || graph_.is_propagated_specialize(i) || !graph_.has_class_child(i))
        return;
    imply_tree(graph_[i].parent, i, graph_[i].to_parent->with_root_identity(), true);
}

void ClassArcs::imply_tree(int dest, int source, const MapFunction& transfer, bool is_start) {
    if (graph_[dest].arc == ArcType::Relocate) {
        // Relocated sites only stand for others: pass on to the parent, then see to the classes
        // that hang here by ancestors' arcs
        const MapFunction further = graph_[dest].to_parent->with_root_identity().after(transfer);
        imply_tree(graph_[dest].parent, source, further, is_start);
        build_.tasks.add(Task::ImpliedClasses, dest);
        return;
    }
    for (const int c : graph_.children(source)) {
        if (!is_class_arc(graph_[c].arc)) continue;
        // What continues the chain of classes is no class of the destination's own
        if (is_start && is_class_arc(graph_[source].arc) &&
            graph_.depth_below_introduction(source) == graph_.depth_below_introduction(c)) {
            continue;
        }
        const MapFunction& class_map = *graph_[c].to_parent;
        const MapPtr map = composer_.maps().intern(
            transfer.is_identity()
                ? class_map
                : transfer.after(class_map.after(transfer.inverse())).with_root_identity());
        int image = -1;
        for (int d = graph_[dest].first_child; d >= 0 && image < 0; d = graph_[d].next_sibling) {
            if (graph_[d].origin == c && graph_[d].to_parent == map) image = d;
        }
        if (image < 0) {
            ArcRequest request;
            request.arc = graph_[c].arc;
            request.parent = dest;
            request.origin = c;
            request.map = map;
            request.number = graph_[c].sibling_number;
            image = add(request, graph_[c].stack, graph_[c].path);
        }
        if (image >= 0 && graph_.has_class_child(c)) {
            imply_tree(image, c, map->inverse().after(transfer.after(*graph_[c].to_parent)), false);
        }
    }
}

}  // namespace velatura::usd::compose
