// SPDX-License-Identifier: Apache-2.0
#include "usd/compose/relocate_arcs.h"

#include "usd/compose/site.h"

#include <fmt/format.h>

namespace velatura::usd::compose {

using layer::Path;

bool RelocateArcs::drop_if_prohibited() {
    int source = -1;
    graph_.visit(0, [&](int i) {
        const Node& n = graph_[i];
        if (n.culled || source >= 0) return false;
        if (!n.inert && n.stack->has_relocates() && n.stack->relocations().is_source(n.path))
            source = i;
        return true;
    });
    if (source < 0) return false;
    if (const IndexFrame* frame = build_.frame) {
        const Node& above = (*frame->graph)[frame->parent];
        composer_.errors().add(
            {ErrorKind::ArcToProhibitedChild, build_.stage_path, graph_[0].stack->identifier(),
             frame->requested,
             fmt::format("{} arc to @{}@<{}> leads to a prim that is relocated away from "
                         "@{}@<{}>",
                         arc_name(frame->arc), graph_[0].stack->identifier(),
                         frame->requested.to_string(), graph_[source].stack->identifier(),
                         graph_[source].path.to_string()),
             site_loc(*above.stack, above.path)});
    }
    graph_.set_inert(0, true);
    for (const int c : graph_.children(0)) cull_subtree(c);
    return true;
}

void RelocateArcs::cull_subtree(int top) {
    graph_.visit(top, [this](int i) {
        graph_.set_culled(i);
        graph_.edit(i).restricted_depth = 1;
        return true;
    });
}

void RelocateArcs::cull_relocated(int top) {
    for (const int c : graph_.children(top)) {
        const Node& n = graph_[c];
        // Below relocates this was done when they were added
        if (n.arc == ArcType::Relocate) continue;
        if (n.contributes() && n.stack->has_relocates() &&
            n.stack->relocations().is_source(n.path)) {
            cull_subtree(c);
        } else {
            cull_relocated(c);
        }
    }
}

void RelocateArcs::eval(int i) {
    if (!graph_[i].contributes() && graph_.depth_below_introduction(i) == 0) return;
    const Path source = graph_[i].stack->relocations().source(graph_[i].path);
    if (source.is_empty()) return;

    // What ancestors' arcs bring to the place of a relocated prim gives way to that prim; only
    // variants may say something about it
    for (const int c : graph_.children(i)) {
        if (graph_[c].arc != ArcType::Variant) cull_subtree(c);
    }

    // The source's own opinions are errors; the arcs of its ancestors count. Its map is the
    // identity: arcs that bring prims in know the relocations at their end.
    ArcRequest request;
    request.arc = ArcType::Relocate;
    request.parent = request.origin = i;
    request.stack = graph_[i].stack;
    request.path = source;
    request.map = composer_.maps().identity();
    request.contributes = false;
    request.ancestral = true;
    const int added = arcs_.add(request);
    if (added < 0) return;
    for (const StackLayer& entry : graph_[added].stack->layers()) {
        const layer::Spec* spec = entry.layer->spec(graph_[added].path);
        if (!spec) continue;
        build_.report(ErrorKind::OpinionAtRelocationSource, added, spec->loc(),
                      fmt::format("opinion at <{}> is ignored: the prim is relocated to <{}>",
                                  source.to_string(), graph_[i].path.to_string()));
    }
    cull_relocated(added);
}

void RelocateArcs::eval_implied(int i) {
    const Node& n = graph_[i];
    if (n.arc != ArcType::Relocate || n.due_to_ancestor || n.parent < 0) return;
    const int above = graph_[n.parent].parent;
    if (above < 0) return;
    const Path source = graph_[n.parent].to_parent->to_target(n.path.strip_variant_selections());
    if (source.is_empty()) return;
    for (const int c : graph_.children(above)) {
        if (graph_[c].path == source && graph_[c].arc == ArcType::Relocate) return;
    }
    ArcRequest request;
    request.arc = ArcType::Relocate;
    request.parent = above;
    request.origin = i;
    request.stack = graph_[above].stack;
    request.path = source;
    request.map = composer_.maps().identity();
    request.contributes = false;
    arcs_.add(request);
}

}  // namespace velatura::usd::compose
