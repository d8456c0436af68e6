// SPDX-License-Identifier: Apache-2.0
#include "usd/compose/reference_arcs.h"

#include <fmt/format.h>

namespace velatura::usd::compose {

using layer::Path;

namespace {

/// Image of a path for the question whose payloads are meant: internal arcs map everything else to
/// itself, which says nothing here.
Path map_for_payloads(MapPtr map, ArcType arc, Path path) {
    const bool is_reference = arc == ArcType::Reference || arc == ArcType::Payload;
    return is_reference && map->has_root_identity() ? map->without_root_identity().to_target(path)
                                                    : map->to_target(path);
}

Path map_for_payloads_to_root(const PrimGraph& graph, int i, Path path) {
    const MapPtr to_root = graph[i].to_root;
    Path mapped = to_root->to_target(path);
    if (mapped != path || !to_root->has_root_identity()) return mapped;
    for (; !mapped.is_empty() && graph[i].parent >= 0; i = graph[i].parent)
        mapped = map_for_payloads(graph[i].to_parent, graph[i].arc, mapped);
    return mapped;
}

}  // namespace

bool ReferenceArcs::includes_payloads(int i) {
    // The payloads of a prim of the stage are chosen there; others, of ancestors of a site that an
    // arc leads to, have to be there
    Path path = map_for_payloads_to_root(graph_, i, graph_[i].path.strip_variant_selections());
    const IndexFrame* frame = build_.frame;
    while (frame && !path.is_empty()) {
        path = map_for_payloads(frame->to_parent, frame->arc, path);
        if (!path.is_empty()) path = map_for_payloads_to_root(*frame->graph, frame->parent, path);
        frame = frame->outer;
    }
    if (path.is_empty()) return true;
    const ComposeOptions& options = composer_.options();
    const bool included = options.load_payloads ? options.load_payloads(path)
                                                : options.payloads == PayloadPolicy::LoadAll;
    if (included) build_.note_payloads(false, true);
    return included;
}

void ReferenceArcs::eval(int i, bool payloads) {
    if (!graph_[i].contributes()) return;
    std::vector<CompositionError> errors;
    const std::vector<SiteReference> references =
        site_references(*graph_[i].stack, graph_[i].path, payloads, composer_.registry(), &errors);
    build_.report_all(errors, i);
    if (references.empty()) return;
    if (payloads) {
        build_.note_payloads(true, false);
        if (!includes_payloads(i)) return;
    }
    int number = 0;
    for (const SiteReference& reference : references)
        eval_reference(i, reference, number++, payloads ? ArcType::Payload : ArcType::Reference);
}

void ReferenceArcs::eval_reference(int i, const SiteReference& reference, int number, ArcType arc) {
    const Path wanted = reference.prim_path;
    if (!wanted.is_empty() &&
        (!wanted.is_prim() || !wanted.is_absolute() || wanted.has_variant_selection())) {
        build_.report(ErrorKind::InvalidPrimPath, i, reference.loc,
                      fmt::format("{} to <{}> is invalid: expected an absolute prim path",
                                  arc_name(arc), wanted.to_string()));
        return;
    }
    TimeOffset offset = reference.offset;
    if (is_usable(offset)) {
        offset = reference.layer->to_root.after(offset);
    } else {
        build_.report(
            ErrorKind::InvalidReferenceOffset, i, reference.loc,
            fmt::format("offset of {} @{}@ is {} and its scale {}, expected finite numbers and "
                        "a scale above 0",
                        arc_name(arc), reference.asset, offset.offset, offset.scale));
        offset = {};
    }

    // Find the layer stack, and retime: the layer that speaks may count time at another rate
    LayerStack* stack = graph_[i].stack;
    const bool is_internal = reference.asset.empty();
    if (!is_internal) {
        Result<LayerStack*> opened = composer_.layer_stack(reference.file, *stack);
        if (!opened) {
            build_.report(ErrorKind::InvalidAssetPath, i, reference.loc,
                          fmt::format("cannot open {} @{}@: {}", arc_name(arc), reference.asset,
                                      opened.error().message));
            return;
        }
        stack = *opened;
        offset.scale *= reference.layer->rate / stack->time_codes_per_second();
    }
    Path target = wanted;
    if (target.is_empty()) target = stack->root_layer().default_prim();
    if (target.is_empty()) {
        build_.report(ErrorKind::UnresolvedPrimPath, i, reference.loc,
                      fmt::format("{} @{}@ names no prim and the layer has no defaultPrim",
                                  arc_name(arc), reference.asset),
                      "usd-unresolved-default-prim");
        return;
    }

    ArcRequest request;
    request.arc = arc;
    request.parent = request.origin = i;
    request.stack = stack;
    request.path = target;
    // An internal arc stays in one namespace: what it does not move is seen as it is
    request.map = arcs_.arc_map(i, target, offset, is_internal);
    request.number = number;
    request.ancestral = !target.is_root_prim();
    request.loc = reference.loc;
    arcs_.add(request);
}

void ReferenceArcs::check_resolved(int i) {
    const size_t below = graph_.depth_below_introduction(i);
    bool found = false;
    graph_.visit(i, [&](int at) {
        found = found || (below == 0 ? graph_[at].has_specs
                                     : graph_[at].stack->has_spec(graph_.path_at_introduction(at)));
        return !found;
    });
    if (found) return;

    const Path target = graph_.path_at_introduction(i);
    const int parent = graph_[i].parent;
    Path site = graph_[i].to_parent->to_target(target.strip_variant_selections());
    const Path parent_path = graph_[parent].path;
    if (parent_path.has_variant_selection())
        site = site.replace_prefix(parent_path.strip_variant_selections(), parent_path, false);
    const std::vector<SiteReference> said = site_references(
        *graph_[parent].stack, site, graph_[i].arc == ArcType::Payload, composer_.registry());
    const size_t number = graph_[i].sibling_number;
    const bool is_known = number < said.size();
    build_.report(ErrorKind::UnresolvedPrimPath, parent, is_known ? said[number].loc : SourceLoc{},
                  fmt::format("{} target @{}@<{}> not found", arc_name(graph_[i].arc),
                              is_known ? said[number].asset : graph_[i].stack->identifier(),
                              target.to_string()));
}

}  // namespace velatura::usd::compose
