// SPDX-License-Identifier: Apache-2.0
#include "usd/compose/prim_indexer.h"

#include "usd/compose/node_culler.h"

#include <vector>

namespace velatura::usd::compose {

using layer::Path;
using layer::Token;

PrimIndexer::PrimIndexer(Composer& composer,
                         PrimIndex& index,
                         Path stage_path,
                         const IndexFrame* frame)
    : build_(composer, index, stage_path, frame),
      graph_(build_.graph),
      finder_(build_),
      arcs_(build_, finder_),
      relocates_(build_, arcs_),
      references_(build_, arcs_),
      classes_(build_, arcs_),
      specializes_(build_, arcs_),
      variants_(build_, arcs_) {}

void PrimIndexer::start(LayerStack* stack, Path path) {
    graph_.reset(stack, path, build_.composer.maps());
    graph_.edit(0).has_specs = stack->has_spec(path);
}

void PrimIndexer::descend(Token name, bool parent_is_instance, bool root_contributes) {
    if (parent_is_instance) {
        // Only what the instance's direct arcs bring in may speak about what is below it
        std::vector<int> silent;
        graph_.visit(0, [&](int i) {
            if (graph_[i].culled || build_.index.is_instance_node(i)) return false;
            silent.push_back(i);
            return true;
        });
        for (const int i : silent) graph_.set_inert(i, true);
    }
    graph_.append_child(name);
    for (int i = 0; i < int(graph_.size()); ++i) {
        Node& n = graph_.edit(i);
        n.has_specs = n.has_specs && n.stack->has_spec(n.path);
        n.due_to_ancestor = i > 0;
    }
    build_.forget_payloads();
    if (!root_contributes) graph_.set_inert(0, true);
}

void PrimIndexer::run_task(Task task, int i) {
    switch (task) {
        case Task::Relocates:
            return relocates_.eval(i);
        case Task::ImpliedRelocates:
            return relocates_.eval_implied(i);
        case Task::References:
            return references_.eval(i, false);
        case Task::Payloads:
            return references_.eval(i, true);
        case Task::Inherits:
            return classes_.eval(i, ArcType::Inherit);
        case Task::ImpliedClasses:
            return classes_.eval_implied(i);
        case Task::Specializes:
            return classes_.eval(i, ArcType::Specialize);
        case Task::AncestralVariantSets:
            return variants_.eval_ancestral_sets(i);
        case Task::ImpliedSpecializes:
            return specializes_.eval(i);
        case Task::VariantSets:
            return variants_.eval_sets(i);
        case Task::UnresolvedPaths:
            return references_.check_resolved(i);
        case Task::AncestralVariants:
        case Task::AncestralFallbacks:
        case Task::Variants:
        case Task::Fallbacks:
            return;
    }
}

bool PrimIndexer::run_next() {
    for (size_t kind = 0; kind < task_count; ++kind) {
        const Task task = Task(kind);
        // Sets without a selection have had their last chance
        if (task == Task::ImpliedSpecializes) variants_.drop_unselected(true);
        if (task == Task::UnresolvedPaths) variants_.drop_unselected(false);
        if (variants_.run(task)) return true;
        const int i = build_.tasks.take(task);
        if (i < 0) continue;
        run_task(task, i);
        return true;
    }
    return false;
}

void PrimIndexer::run() {
    if (relocates_.drop_if_prohibited()) return;
    finder_.add_below(0, {});
    while (run_next()) {
    }
}

void PrimIndexer::finish() {
    if (graph_.size() >= 2) NodeCuller(graph_, build_.composer.root_stack()).run();
}

}  // namespace velatura::usd::compose
