// SPDX-License-Identifier: Apache-2.0
#include "usd/compose/arc_adder.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace velatura::usd::compose {

using layer::Path;

MapPtr ArcAdder::arc_map(int parent, Path source, TimeOffset offset, bool root_identity) const {
    const Path target = graph_[parent].path.strip_variant_selections();
    MapFunction map({{source, target}}, offset);
    const LayerStack& stack = *graph_[parent].stack;
    if (stack.has_relocates()) map = stack.relocations().map_below(target).after(map);
    return composer_.maps().intern(root_identity ? map.with_root_identity() : std::move(map));
}

int ArcAdder::matching_child(int parent, const ArcRequest& request, size_t depth) const {
    // Below relocated sites the sites of classes mean little: their maps tell them apart
    const bool is_relocate = build_.climb(parent).arc() == ArcType::Relocate;
    for (int c = graph_[parent].first_child; c >= 0; c = graph_[c].next_sibling) {
        const Node& n = graph_[c];
        const bool matches = is_relocate ? n.arc == request.arc && n.to_parent == request.map &&
                                               graph_.depth_below_introduction(n.origin) == depth
                                         : n.stack == request.stack && n.path == request.path;
        if (matches) return c;
    }
    return -1;
}

int ArcAdder::add(ArcRequest request) {
    if (!is_within_limits(request)) return -1;
    if (makes_cycle(request)) {
        build_.report(ErrorKind::ArcCycle, request.parent, request.loc,
                      fmt::format("{} arc to @{}@<{}> makes a cycle with {}", arc_name(request.arc),
                                  request.stack->identifier(), request.path.to_string(),
                                  describe_cycle(request)));
        return -1;
    }
    request.skip_duplicates =
        request.skip_duplicates || (build_.frame && build_.frame->skip_duplicates);
    if (request.skip_duplicates && is_duplicate(request)) return -1;
    const int added = request.ancestral ? add_graph(request) : add_node(request);
    if (added < 0) return -1;

    // The arcs of a composed site have been followed already, but for its variants
    const bool can_add_variants = build_.frame == nullptr;
    tasks_.add(added,
               {request.skip_authored_arcs || request.ancestral, request.skip_implied_specializes,
                build_.frame == nullptr, can_add_variants && request.ancestral});
    return added;
}

bool ArcAdder::is_within_limits(const ArcRequest& request) {
    if (overflow_) return false;
    const ComposeOptions& options = composer_.options();
    size_t depth = 0;
    for (AncestorWalk at = build_.climb(request.parent); at; at.up()) ++depth;
    overflow_ = graph_.size() >= options.max_nodes_per_prim || depth >= options.max_arc_depth ||
                !composer_.spend(1);
    if (overflow_ && !composer_.is_exhausted()) {
        build_.report(ErrorKind::CapacityExceeded, request.parent, request.loc,
                      fmt::format("limit of {} nodes or {} nested arcs reached at {} arc to <{}>",
                                  options.max_nodes_per_prim, options.max_arc_depth,
                                  arc_name(request.arc), request.path.to_string()));
    }
    return !overflow_;
}

bool ArcAdder::makes_cycle(const ArcRequest& request) const {
    // A variant is another page of the same prim's opinions
    if (request.arc == ArcType::Variant) return false;
    if (is_class_arc(request.arc) && request.parent != request.origin) {
        // Implied classes below relocated sites are place holders and need not exist
        AncestorWalk at = build_.climb(request.parent);
        while (at && is_class_arc(at.arc())) at.up();
        if (at && at.arc() == ArcType::Relocate) return false;
    }
    Path path = request.path;
    for (AncestorWalk at = build_.climb(request.parent); at; at.next_frame()) {
        for (int i = at.node; i >= 0; i = (*at.graph)[i].parent) {
            const Node& n = (*at.graph)[i];
            if (n.stack == request.stack && (n.path.has_prefix(path) || path.has_prefix(n.path)))
                return true;
        }
        if (!at.frame) break;
        // The waiting graph stands deeper in namespace than the ancestor built here
        const Path current = (*at.graph)[0].path;
        path = current == path ? at.frame->requested
                               : at.frame->requested.replace_prefix(current, path, false);
    }
    return false;
}

std::string ArcAdder::describe_cycle(const ArcRequest& request) const {
    std::string text;
    for (AncestorWalk at = build_.climb(request.parent); at; at.up()) {
        const ArcType arc = at.arc();
        text = fmt::format("<{}>{}{}", at.here().path.to_string(),
                           arc == ArcType::Root ? "" : fmt::format(" ({})", arc_name(arc)),
                           text.empty() ? "" : " → " + text);
    }
    return text;
}

bool ArcAdder::is_duplicate(const ArcRequest& request) const {
    Path path = request.path;
    for (AncestorWalk at = build_.climb(request.parent); at; at.next_frame()) {
        if (at.graph->has_site(request.stack, path)) return true;
        if (!at.frame) break;
        path = at.frame->requested.replace_prefix((*at.graph)[0].path, path, false);
    }
    return false;
}

Node ArcAdder::arc_node(const ArcRequest& request) const {
    Node n;
    n.parent = request.parent;
    n.origin = request.origin;
    n.arc = request.arc;
    n.sibling_number = uint16_t(std::min(request.number, 0xffff));
    n.namespace_depth =
        uint16_t(request.namespace_depth.value_or(prim_depth(graph_[request.parent].path)));
    n.to_parent = request.map;
    return n;
}

int ArcAdder::add_node(const ArcRequest& request) {
    Node n = arc_node(request);
    n.stack = request.stack;
    n.path = request.path;
    n.has_specs = n.stack->has_spec(n.path);
    const int added = graph_.insert(n, composer_.maps());
    if (!request.contributes) {
        graph_.set_inert(added, true);
        graph_.edit(added).restricted_depth = 1;
        graph_.edit(added).only_implies = true;
    }
    return added;
}

int ArcAdder::add_graph(const ArcRequest& request) {
    const IndexFrame frame{&graph_,     build_.frame, request.parent,         request.arc,
                           request.map, request.path, request.skip_duplicates};
    const PrimIndex sub = composer_.site_index(request.stack, request.path, build_.stage_path,
                                               request.contributes, &frame);
    // Where a limit was reached on the way the site was not
    if (sub.path() != request.path) return -1;
    composer_.spend(sub.nodes().size());
    if (graph_.size() + sub.nodes().size() > composer_.options().max_nodes_per_prim) {
        overflow_ = true;
        build_.report(ErrorKind::CapacityExceeded, request.parent, request.loc,
                      fmt::format("limit of {} nodes reached at {} arc to <{}>",
                                  composer_.options().max_nodes_per_prim, arc_name(request.arc),
                                  request.path.to_string()));
        return -1;
    }
    build_.note_payloads(sub.has_payloads(), sub.payloads_included());
    return graph_.insert_graph(sub.graph(), arc_node(request), composer_.maps());
}

}  // namespace velatura::usd::compose
