// SPDX-License-Identifier: Apache-2.0
#include "usd/compose/composer.h"
#include "usd/compose/prim_indexer.h"

#include <fmt/format.h>

namespace velatura::usd::compose {

using layer::Path;

bool PrimIndexer::drop_if_prohibited() {
    int source = -1;
    graph().visit(0, [&](int i) {
        const Node& n = node(i);
        if (n.culled || source >= 0) return false;
        if (!n.inert && n.stack->has_relocates() && n.stack->relocations().is_source(n.path))
            source = i;
        return true;
    });
    if (source < 0) return false;
    if (frame_) {
        composer_.errors().add(
            {ErrorKind::ArcToProhibitedChild, stage_path_, node(0).stack->identifier(),
             frame_->requested,
             fmt::format("{} arc to @{}@<{}> leads to a prim that is relocated away from "
                         "@{}@<{}>",
                         arc_name(frame_->arc), node(0).stack->identifier(),
                         frame_->requested.to_string(), node(source).stack->identifier(),
                         node(source).path.to_string()),
             site_loc(*frame_->indexer->node(frame_->parent).stack,
                      frame_->indexer->node(frame_->parent).path)});
    }
    graph().set_inert(0, true);
    for (const int c : graph().children(0)) cull_subtree(c);
    return true;
}

void PrimIndexer::cull_subtree(int top) {
    graph().visit(top, [this](int i) {
        graph().set_culled(i);
        graph().edit(i).restricted_depth = 1;
        return true;
    });
}

void PrimIndexer::cull_relocated(int top) {
    for (const int c : graph().children(top)) {
        const Node& n = node(c);
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

void PrimIndexer::eval_relocates(int i) {
    if (!node(i).contributes() && graph().depth_below_introduction(i) == 0) return;
    const Path source = node(i).stack->relocations().source(node(i).path);
    if (source.is_empty()) return;

    // What ancestors' arcs bring to the place of a relocated prim gives way to that prim; only
    // variants may say something about it
    for (const int c : graph().children(i)) {
        if (node(c).arc != ArcType::Variant) cull_subtree(c);
    }

    // The source's own opinions are errors; the arcs of its ancestors count. Its map is the
    // identity: arcs that bring prims in know the relocations at their end.
    ArcRequest request;
    request.arc = ArcType::Relocate;
    request.parent = request.origin = i;
    request.stack = node(i).stack;
    request.path = source;
    request.map = composer_.maps().identity();
    request.contributes = false;
    request.ancestral = true;
    const int added = add_arc(request);
    if (added < 0) return;
    for (const StackLayer& entry : node(added).stack->layers()) {
        const layer::Spec* spec = entry.layer->spec(node(added).path);
        if (!spec) continue;
        report(ErrorKind::OpinionAtRelocationSource, added, spec->loc(),
               fmt::format("opinion at <{}> is ignored: the prim is relocated to <{}>",
                           source.to_string(), node(i).path.to_string()));
    }
    cull_relocated(added);
}

void PrimIndexer::eval_implied_relocates(int i) {
    const Node& n = node(i);
    if (n.arc != ArcType::Relocate || n.due_to_ancestor || n.parent < 0) return;
    const int above = node(n.parent).parent;
    if (above < 0) return;
    const Path source = node(n.parent).to_parent->to_target(n.path.strip_variant_selections());
    if (source.is_empty()) return;
    for (const int c : graph().children(above)) {
        if (node(c).path == source && node(c).arc == ArcType::Relocate) return;
    }
    ArcRequest request;
    request.arc = ArcType::Relocate;
    request.parent = above;
    request.origin = i;
    request.stack = node(above).stack;
    request.path = source;
    request.map = composer_.maps().identity();
    request.contributes = false;
    add_arc(request);
}

}  // namespace velatura::usd::compose
