// SPDX-License-Identifier: Apache-2.0
#include "usd/compose/prim_indexer.h"

#include "usd/compose/composer.h"
#include "usd/layer/fields.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>

namespace velatura::usd::compose {

using layer::Path;
using layer::Token;

PrimIndexer::PrimIndexer(Composer& composer,
                         PrimIndex& index,
                         Path stage_path,
                         const IndexFrame* frame)
    : composer_(composer), index_(index), stage_path_(stage_path), frame_(frame) {}

void PrimIndexer::report(
    ErrorKind kind, int i, SourceLoc loc, std::string message, const char* code) {
    composer_.errors().add(
        {kind, stage_path_, node(i).stack->identifier(), node(i).path, std::move(message), loc},
        code);
}

void PrimIndexer::report_all(std::vector<CompositionError>& errors, int i) {
    for (CompositionError& error : errors) {
        error.prim = stage_path_;
        error.layer_stack = node(i).stack->identifier();
        composer_.errors().add(std::move(error));
    }
    errors.clear();
}

void PrimIndexer::start(LayerStack* stack, Path path) {
    graph().reset(stack, path, composer_.maps());
    graph().edit(0).has_specs = stack->has_spec(path);
}

void PrimIndexer::descend(Token name, bool parent_is_instance, bool root_contributes) {
    if (parent_is_instance) {
        // Only what the instance's direct arcs bring in may speak about what is below it
        std::vector<int> silent;
        graph().visit(0, [&](int i) {
            if (node(i).culled || index_.is_instance_node(i)) return false;
            silent.push_back(i);
            return true;
        });
        for (const int i : silent) graph().set_inert(i, true);
    }
    graph().append_child(name);
    for (int i = 0; i < int(graph().size()); ++i) {
        Node& n = graph().edit(i);
        n.has_specs = n.has_specs && n.stack->has_spec(n.path);
        n.due_to_ancestor = i > 0;
    }
    index_.has_payloads_ = false;
    index_.payloads_included_ = false;
    if (!root_contributes) graph().set_inert(0, true);
}

// ---- Climbing ----

const Node& PrimIndexer::Climber::here() const {
    return indexer->node(node);
}

ArcType PrimIndexer::Climber::arc() const {
    const ArcType own = here().arc;
    return own == ArcType::Root && frame ? frame->arc : own;
}

void PrimIndexer::Climber::up() {
    if (here().parent >= 0) {
        node = here().parent;
    } else {
        next_frame();
    }
}

void PrimIndexer::Climber::next_frame() {
    if (!frame) {
        indexer = nullptr;
        return;
    }
    node = frame->parent;
    indexer = frame->indexer;
    frame = indexer->frame_;
}

// ---- Growing the graph ----

bool PrimIndexer::is_within_limits(const ArcRequest& request) {
    if (overflow_) return false;
    const ComposeOptions& options = composer_.options();
    size_t depth = 0;
    for (Climber at = climb(request.parent); at; at.up()) ++depth;
    overflow_ = graph().size() >= options.max_nodes_per_prim || depth >= options.max_arc_depth ||
                !composer_.spend(1);
    if (overflow_ && !composer_.is_exhausted()) {
        report(ErrorKind::CapacityExceeded, request.parent, request.loc,
               fmt::format("limit of {} nodes or {} nested arcs reached at {} arc to <{}>",
                           options.max_nodes_per_prim, options.max_arc_depth, arc_name(request.arc),
                           request.path.to_string()));
    }
    return !overflow_;
}

bool PrimIndexer::makes_cycle(const ArcRequest& request) const {
    // A variant is another page of the same prim's opinions
    if (request.arc == ArcType::Variant) return false;
    if (is_class_arc(request.arc) && request.parent != request.origin) {
        // Implied classes below relocated sites are place holders and need not exist
        Climber at = climb(request.parent);
        while (at && is_class_arc(at.arc())) at.up();
        if (at && at.arc() == ArcType::Relocate) return false;
    }
    Path path = request.path;
    for (Climber at = climb(request.parent); at; at.next_frame()) {
        for (int i = at.node; i >= 0; i = at.indexer->node(i).parent) {
            const Node& n = at.indexer->node(i);
            if (n.stack == request.stack && (n.path.has_prefix(path) || path.has_prefix(n.path)))
                return true;
        }
        if (!at.frame) break;
        // The waiting graph stands deeper in namespace than the ancestor built here
        const Path current = at.indexer->node(0).path;
        path = current == path ? at.frame->requested
                               : at.frame->requested.replace_prefix(current, path, false);
    }
    return false;
}

std::string PrimIndexer::describe_cycle(const ArcRequest& request) const {
    std::string text;
    for (Climber at = climb(request.parent); at; at.up()) {
        const ArcType arc = at.arc();
        text = fmt::format("<{}>{}{}", at.here().path.to_string(),
                           arc == ArcType::Root ? "" : fmt::format(" ({})", arc_name(arc)),
                           text.empty() ? "" : " → " + text);
    }
    return text;
}

bool PrimIndexer::is_duplicate(const ArcRequest& request) const {
    Path path = request.path;
    for (Climber at = climb(request.parent); at; at.next_frame()) {
        if (at.indexer->graph().has_site(request.stack, path)) return true;
        if (!at.frame) break;
        path = at.frame->requested.replace_prefix(at.indexer->node(0).path, path, false);
    }
    return false;
}

MapPtr PrimIndexer::arc_map(int parent, Path source, TimeOffset offset, bool root_identity) const {
    const Path target = node(parent).path.strip_variant_selections();
    MapFunction map({{source, target}}, offset);
    const LayerStack& stack = *node(parent).stack;
    if (stack.has_relocates()) map = stack.relocations().map_below(target).after(map);
    return composer_.maps().intern(root_identity ? map.with_root_identity() : std::move(map));
}

int PrimIndexer::add_arc(ArcRequest request) {
    if (!is_within_limits(request)) return -1;
    if (makes_cycle(request)) {
        report(ErrorKind::ArcCycle, request.parent, request.loc,
               fmt::format("{} arc to @{}@<{}> makes a cycle with {}", arc_name(request.arc),
                           request.stack->identifier(), request.path.to_string(),
                           describe_cycle(request)));
        return -1;
    }
    request.skip_duplicates = request.skip_duplicates || (frame_ && frame_->skip_duplicates);
    if (request.skip_duplicates && is_duplicate(request)) return -1;
    const int added = request.ancestral ? add_graph(request) : add_node(request);
    if (added < 0) return -1;

    // The arcs of a composed site have been followed already, but for its variants
    const bool may_add_variants = frame_ == nullptr;
    add_tasks(added,
              {request.skip_authored_arcs || request.ancestral, request.skip_implied_specializes,
               frame_ == nullptr, may_add_variants && request.ancestral});
    return added;
}

Node PrimIndexer::arc_node(const ArcRequest& request) const {
    Node n;
    n.parent = request.parent;
    n.origin = request.origin;
    n.arc = request.arc;
    n.sibling_number = uint16_t(std::min(request.number, 0xffff));
    n.namespace_depth =
        uint16_t(request.namespace_depth.value_or(prim_depth(node(request.parent).path)));
    n.to_parent = request.map;
    return n;
}

int PrimIndexer::add_node(const ArcRequest& request) {
    Node n = arc_node(request);
    n.stack = request.stack;
    n.path = request.path;
    n.has_specs = n.stack->has_spec(n.path);
    const int added = graph().insert(n, composer_.maps());
    if (!request.contributes) {
        graph().set_inert(added, true);
        graph().edit(added).restricted_depth = 1;
        graph().edit(added).only_implies = true;
    }
    return added;
}

int PrimIndexer::add_graph(const ArcRequest& request) {
    const IndexFrame frame{this,        request.parent, request.arc,
                           request.map, request.path,   request.skip_duplicates};
    const PrimIndex sub =
        composer_.site_index(request.stack, request.path, stage_path_, request.contributes, &frame);
    // Where a limit was reached on the way the site was not
    if (sub.path() != request.path) return -1;
    composer_.spend(sub.nodes().size());
    if (graph().size() + sub.nodes().size() > composer_.options().max_nodes_per_prim) {
        overflow_ = true;
        report(ErrorKind::CapacityExceeded, request.parent, request.loc,
               fmt::format("limit of {} nodes reached at {} arc to <{}>",
                           composer_.options().max_nodes_per_prim, arc_name(request.arc),
                           request.path.to_string()));
        return -1;
    }
    index_.has_payloads_ = index_.has_payloads_ || sub.has_payloads();
    index_.payloads_included_ = index_.payloads_included_ || sub.payloads_included();
    return graph().insert_graph(sub.graph(), arc_node(request), composer_.maps());
}

// ---- Tasks ----

void PrimIndexer::add_task(Task task, int i) {
    std::vector<int>& queue = tasks_[task];
    const bool is_implied = task == ImpliedClasses || task == ImpliedSpecializes;
    if (is_implied && std::find(queue.begin(), queue.end(), i) != queue.end()) return;
    queue.push_back(i);
    // Lower numbers first; of implied classes those furthest from the root
    if (task == ImpliedClasses) {
        std::push_heap(queue.begin(), queue.end(), std::less<>());
    } else {
        std::push_heap(queue.begin(), queue.end(), std::greater<>());
    }
}

void PrimIndexer::add_tasks_below(int top, const TaskFilter& filter) {
    graph().visit(top, [&](int i) {
        const Node& n = node(i);
        const bool is_reference = n.arc == ArcType::Reference || n.arc == ArcType::Payload;
        if (filter.with_unresolved_paths && is_reference) add_task(UnresolvedPaths, i);
        SiteArcs arcs;
        if (n.contributes() && n.has_specs) arcs = site_arcs(*n.stack, n.path);
        if (arcs.variants && !frame_) add_task(VariantSets, i);
        if (arcs.prim_relocates) {
            composer_.diagnostics().warn(
                "usd-relocates-on-prim",
                site_field_loc(*n.stack, n.path, layer::fields().relocates), n.path.to_string(),
                "relocates of a prim are ignored, expected in a layer's metadata");
        }
        if (filter.skip_implied_specializes) return true;
        if (filter.with_ancestral_variants) scan_ancestral_variants(i);
        if (!filter.skip_authored_arcs) {
            if (arcs.specializes) add_task(Specializes, i);
            if (arcs.inherits) add_task(Inherits, i);
            if (arcs.payloads) add_task(Payloads, i);
            if (arcs.references) add_task(References, i);
            if (n.contributes() && n.stack->has_relocates()) add_task(Relocates, i);
        }
        if (n.arc == ArcType::Relocate) add_task(ImpliedRelocates, i);
        return true;
    });
}

void PrimIndexer::add_tasks(int i, const TaskFilter& filter) {
    if (!filter.skip_implied_specializes) {
        // New arcs may carry classes that are implied further up
        if (is_class_arc(node(i).arc)) {
            add_task(ImpliedClasses, implied_class_start(i));
        } else if (graph().has_class_child(i)) {
            add_task(ImpliedClasses, i);
        }
        if (!frame_) {
            const int specialize = specialize_start(i);
            if (specialize >= 0) {
                add_task(ImpliedSpecializes, specialize);
            } else if (graph().has_specialize_below(i)) {
                add_task(ImpliedSpecializes, i);
            }
        }
    }
    add_tasks_below(i, filter);
}

void PrimIndexer::run_task(Task task, int i) {
    switch (task) {
        case Relocates:
            return eval_relocates(i);
        case ImpliedRelocates:
            return eval_implied_relocates(i);
        case References:
            return eval_references(i, false);
        case Payloads:
            return eval_references(i, true);
        case Inherits:
            return eval_classes(i, ArcType::Inherit);
        case ImpliedClasses:
            return eval_implied_classes(i);
        case Specializes:
            return eval_classes(i, ArcType::Specialize);
        case AncestralVariantSets:
            return eval_ancestral_variant_sets(i);
        case ImpliedSpecializes:
            return eval_implied_specializes(i);
        case VariantSets:
            if (node(i).contributes()) add_variant_tasks(i, node(i).path, false);
            return;
        case UnresolvedPaths:
            return check_resolved(i);
        case AncestralVariants:
        case AncestralFallbacks:
        case Variants:
        case Fallbacks:
        case TaskCount:
            return;
    }
}

bool PrimIndexer::run_next() {
    for (int kind = 0; kind < TaskCount; ++kind) {
        const Task task = Task(kind);
        // Sets without a selection have had their last chance
        if (task == ImpliedSpecializes) unselected_[1].clear();
        if (task == UnresolvedPaths) unselected_[0].clear();
        if (run_variant(task)) return true;
        std::vector<int>& queue = tasks_[task];
        if (queue.empty()) continue;
        if (task == ImpliedClasses) {
            std::pop_heap(queue.begin(), queue.end(), std::less<>());
        } else {
            std::pop_heap(queue.begin(), queue.end(), std::greater<>());
        }
        const int i = queue.back();
        queue.pop_back();
        run_task(task, i);
        return true;
    }
    return false;
}

void PrimIndexer::run() {
    if (drop_if_prohibited()) return;
    add_tasks_below(0, {});
    while (run_next()) {
    }
}

// ---- Ending ----

bool PrimIndexer::can_be_culled(int i) const {
    const Node& n = node(i);
    if (n.culled) return true;
    if (n.parent < 0 || graph().depth_below_introduction(i) == 0) return false;
    if (n.arc == ArcType::Inherit && n.stack == composer_.root_stack()) {
        // Which prims a prim inherits from is a fact of the stage, opinions or not
        int origin = i;
        if (n.origin != n.parent) {
            while (node(origin).origin != node(origin).parent) origin = node(origin).origin;
        }
        if (!graph().path_at_introduction(origin).is_root_prim()) return false;
    }
    for (int c = n.first_child; c >= 0; c = node(c).next_sibling) {
        if (!node(c).culled) return false;
    }
    return !(n.has_specs && n.contributes());
}

void PrimIndexer::cull_empty(int i, std::vector<int>* culled) {
    for (int c = node(i).first_child; c >= 0; c = node(c).next_sibling) {
        if (node(c).arc != ArcType::Specialize) cull_empty(c, culled);
    }
    if (!can_be_culled(i)) return;
    graph().set_culled(i);
    if (culled) culled->push_back(i);
}

bool PrimIndexer::cull_matching(int i, const std::vector<int>& culled) {
    bool all = true;
    for (int c = node(i).first_child; c >= 0; c = node(c).next_sibling)
        all = cull_matching(c, culled) && all;
    const auto is_same = [&](int other) {
        return node(other).stack == node(i).stack && node(other).path == node(i).path;
    };
    if (all && std::any_of(culled.begin(), culled.end(), is_same)) graph().set_culled(i);
    return node(i).culled;
}

void PrimIndexer::finish() {
    if (graph().size() < 2) return;
    // A specializes node stands in the graph twice: at the root, where it speaks, and where it was
    // introduced. Weakest first, what is dropped there is dropped here too.
    std::vector<int> top = graph().children(0);
    for (auto c = top.rbegin(); c != top.rend(); ++c) {
        if (!graph().is_propagated_specialize(*c)) continue;
        std::vector<int> culled;
        cull_empty(*c, &culled);
        cull_matching(node(*c).origin, culled);
    }
    for (const int c : top) {
        if (!graph().is_propagated_specialize(c)) cull_empty(c, nullptr);
    }
    graph().finalize();
}

}  // namespace velatura::usd::compose
