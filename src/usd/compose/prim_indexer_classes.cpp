// SPDX-License-Identifier: Apache-2.0
#include "usd/compose/composer.h"
#include "usd/compose/prim_indexer.h"
#include "usd/layer/fields.h"

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

void PrimIndexer::eval_classes(int i, ArcType arc) {
    if (!node(i).contributes()) return;
    const std::vector<SiteClass> classes =
        site_classes(*node(i).stack, node(i).path, arc == ArcType::Specialize);
    int number = 0;
    for (const SiteClass& target : classes) {
        ArcRequest request;
        request.arc = arc;
        request.parent = request.origin = i;
        request.number = number++;
        request.loc = target.loc;
        if (!target.path.is_prim() || !target.path.is_absolute() ||
            target.path.has_variant_selection()) {
            report(ErrorKind::InvalidPrimPath, i, target.loc,
                   fmt::format("{} arc to <{}> is invalid: expected an absolute prim path",
                               arc_name(arc), target.path.to_string()));
            continue;
        }
        request.map = arc_map(i, target.path, {}, true);
        add_class_arc(request, nullptr, {});
    }
}

int PrimIndexer::matching_child(int parent, const ArcRequest& request, size_t depth) const {
    // Below relocated sites the sites of classes mean little: their maps tell them apart
    const bool is_relocate = climb(parent).arc() == ArcType::Relocate;
    for (int c = node(parent).first_child; c >= 0; c = node(c).next_sibling) {
        const Node& n = node(c);
        const bool matches = is_relocate ? n.arc == request.arc && n.to_parent == request.map &&
                                               graph().depth_below_introduction(n.origin) == depth
                                         : n.stack == request.stack && n.path == request.path;
        if (matches) return c;
    }
    return -1;
}

int PrimIndexer::add_class_arc(ArcRequest request, const LayerStack* same_stack, Path same_path) {
    const Path parent_path = node(request.parent).path;
    request.stack = node(request.parent).stack;
    request.path = class_path(parent_path, *request.map);
    // A class outside of what the parent can see is no error; it is only not there
    if (request.path.is_empty()) return -1;
    const int known =
        matching_child(request.parent, request, graph().depth_below_introduction(request.origin));
    if (known >= 0) {
        // Of several arcs that imply one class the strongest counts
        if (request.arc == ArcType::Specialize && request.parent != request.origin &&
            graph().is_implied_class(known) && node(known).arc == request.arc) {
            graph().strengthen_origin(known, request.origin, uint16_t(request.number));
        }
        return known;
    }

    // A class that is implied unchanged stays as a place holder, so that it goes on further up, but
    // must not speak twice
    request.contributes =
        request.path != parent_path && !(request.stack == same_stack && request.path == same_path);
    request.skip_duplicates = request.contributes;
    request.ancestral = request.contributes && !request.path.is_root_prim();
    return add_arc(request);
}

int PrimIndexer::implied_class_start(int class_node) const {
    // A hierarchy of classes is implied as a whole, from its instance on. Where that instance is
    // itself a class, reached by an ancestor's arc, go on from there, unless the hierarchy belongs
    // to the inside of that class.
    int start = class_node;
    while (is_class_arc(node(start).arc)) {
        const auto [instance, top_class] = graph().class_hierarchy_start(start);
        start = instance;
        if (is_class_arc(node(instance).arc) &&
            node(top_class).path.has_prefix(graph().path_at_introduction(instance))) {
            break;
        }
    }
    return start;
}

void PrimIndexer::eval_implied_classes(int i) {
    // Below a specializes node at the root classes are implied from where it came
    if (node(i).parent < 0 || graph().is_propagated_specialize(i) || !graph().has_class_child(i))
        return;
    imply_class_tree(node(i).parent, i, node(i).to_parent->with_root_identity(), true);
}

void PrimIndexer::imply_class_tree(int dest,
                                   int source,
                                   const MapFunction& transfer,
                                   bool is_start) {
    if (node(dest).arc == ArcType::Relocate) {
        // Relocated sites only stand for others: pass on to the parent, then see to the classes
        // that hang here by ancestors' arcs
        const MapFunction further = node(dest).to_parent->with_root_identity().after(transfer);
        imply_class_tree(node(dest).parent, source, further, is_start);
        add_task(ImpliedClasses, dest);
        return;
    }
    for (const int c : graph().children(source)) {
        if (!is_class_arc(node(c).arc)) continue;
        // What continues the chain of classes is no class of the destination's own
        if (is_start && is_class_arc(node(source).arc) &&
            graph().depth_below_introduction(source) == graph().depth_below_introduction(c)) {
            continue;
        }
        const MapFunction& class_map = *node(c).to_parent;
        const MapPtr map = composer_.maps().intern(
            transfer.is_identity()
                ? class_map
                : transfer.after(class_map.after(transfer.inverse())).with_root_identity());
        int image = -1;
        for (int d = node(dest).first_child; d >= 0 && image < 0; d = node(d).next_sibling) {
            if (node(d).origin == c && node(d).to_parent == map) image = d;
        }
        if (image < 0) {
            ArcRequest request;
            request.arc = node(c).arc;
            request.parent = dest;
            request.origin = c;
            request.map = map;
            request.number = node(c).sibling_number;
            image = add_class_arc(request, node(c).stack, node(c).path);
        }
        if (image >= 0 && graph().has_class_child(c)) {
            imply_class_tree(image, c, map->inverse().after(transfer.after(*node(c).to_parent)),
                             false);
        }
    }
}

// ---- Specializes ----
//
// What a specializes arc brings is weaker than everything else about a prim. So its subtree is
// moved to the root of the graph, where its strength is the last, and an inert copy stays where the
// arc is. When arcs are found below the moved subtree, they are copied back to that place, from
// where classes are implied as usual, and moved again.

int PrimIndexer::specialize_start(int i) const {
    int start = -1;
    for (; i > 0; i = node(i).parent) {
        if (node(i).arc == ArcType::Specialize) start = i;
    }
    return start;
}

void PrimIndexer::eval_implied_specializes(int i) {
    if (node(i).parent < 0) return;
    if (!graph().is_propagated_specialize(i)) {
        find_specializes(i);
        return;
    }
    const int origin = node(i).origin;
    for (const int c : graph().children(i)) propagate_to_origin(origin, c, node(c).to_parent, i);
}

int PrimIndexer::propagate_node(int parent, int source, MapPtr map, int tree, bool to_root) {
    if (node(source).parent == parent) return source;
    ArcRequest request;
    request.arc = node(source).arc;
    request.parent = parent;
    request.stack = node(source).stack;
    request.path = node(source).path;
    request.map = map;
    const bool is_implied = graph().is_implied_class(source);
    int copy = matching_child(parent, request, graph().depth_below_introduction(source));
    // Classes implied within the subtree will be implied there again
    if (copy < 0 && !(is_implied && graph().is_in_subtree(node(source).origin, tree))) {
        request.origin = source == tree || is_implied ? source : parent;
        request.number = node(source).sibling_number;
        request.namespace_depth =
            source == tree ? prim_depth(node(parent).path) : size_t(node(source).namespace_depth);
        request.contributes = node(source).contributes();
        request.skip_implied_specializes = to_root;
        request.skip_authored_arcs = !to_root;
        copy = add_arc(request);
    }
    if (copy < 0) {
        graph().make_subtree_inert(source);
        return -1;
    }
    if (node(copy).only_implies && node(source).contributes()) {
        // It speaks from now on: its variants have not been looked at
        graph().edit(copy).only_implies = false;
        if (site_arcs(*node(copy).stack, node(copy).path).variants) add_task(VariantSets, copy);
    }
    // Remember in the source how deep the copy had lost its say, for the way back
    const uint16_t restricted = node(copy).restricted_depth;
    if (!node(source).moved) graph().set_inert(copy, !node(source).contributes());
    if (node(source).contributes()) {
        graph().edit(copy).moved = false;
        graph().edit(source).moved = true;
    }
    graph().set_inert(source, true);
    if (restricted != 0) graph().edit(source).restricted_depth = restricted;
    return copy;
}

void PrimIndexer::propagate_to_root(int parent, int source, MapPtr map, int tree) {
    const int copy = propagate_node(parent, source, map, tree, true);
    if (copy < 0) return;
    for (const int c : graph().children(source)) {
        if (node(c).arc != ArcType::Specialize) propagate_to_root(copy, c, node(c).to_parent, tree);
    }
}

void PrimIndexer::propagate_to_origin(int parent, int source, MapPtr map, int tree) {
    const int copy = propagate_node(parent, source, map, tree, false);
    if (copy < 0) return;
    for (const int c : graph().children(source))
        propagate_to_origin(copy, c, node(c).to_parent, tree);
}

void PrimIndexer::find_specializes(int i) {
    // Place holders below relocated sites have no opinions to move
    const int parent = node(i).parent;
    if (parent >= 0 && parent != node(i).origin && node(parent).arc == ArcType::Relocate &&
        node(parent).stack == node(i).stack && node(parent).path == node(i).path) {
        return;
    }
    if (node(i).arc == ArcType::Specialize) {
        const bool was_inert = !node(i).contributes();
        const uint16_t restricted = node(i).restricted_depth;
        graph().set_inert(i, false);
        graph().edit(i).moved = false;
        propagate_to_root(0, i, node(i).to_root, i);
        if (was_inert) graph().edit(i).restricted_depth = restricted;
    }
    for (const int c : graph().children(i)) find_specializes(c);
}

}  // namespace velatura::usd::compose
