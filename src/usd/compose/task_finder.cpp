// SPDX-License-Identifier: Apache-2.0
#include "usd/compose/task_finder.h"

#include "usd/compose/site.h"
#include "usd/layer/fields.h"

namespace velatura::usd::compose {

using layer::Path;

void TaskFinder::add(int i, const TaskFilter& filter) {
    if (!filter.skip_implied_specializes) {
        // New arcs may carry classes that are implied further up
        if (is_class_arc(graph_[i].arc)) {
            build_.tasks.add(Task::ImpliedClasses, implied_class_start(i));
        } else if (graph_.has_class_child(i)) {
            build_.tasks.add(Task::ImpliedClasses, i);
        }
        if (!build_.frame) {
            const int specialize = specialize_start(i);
            if (specialize >= 0) {
                build_.tasks.add(Task::ImpliedSpecializes, specialize);
            } else if (graph_.has_specialize_below(i)) {
                build_.tasks.add(Task::ImpliedSpecializes, i);
            }
        }
    }
    add_below(i, filter);
}

void TaskFinder::add_below(int top, const TaskFilter& filter) {
    graph_.visit(top, [&](int i) {
        const Node& n = graph_[i];
        const bool is_reference = n.arc == ArcType::Reference || n.arc == ArcType::Payload;
        if (filter.with_unresolved_paths && is_reference)
            build_.tasks.add(Task::UnresolvedPaths, i);
        SiteArcs arcs;
        if (n.contributes() && n.has_specs) arcs = site_arcs(*n.stack, n.path);
        if (arcs.variants && !build_.frame) build_.tasks.add(Task::VariantSets, i);
        if (arcs.prim_relocates) {
            composer_.diagnostics().warn(
                "usd-relocates-on-prim",
                site_field_loc(*n.stack, n.path, layer::fields().relocates), n.path.to_string(),
                "relocates of a prim are ignored, expected in a layer's metadata");
        }
        if (filter.skip_implied_specializes) return true;
        if (filter.with_ancestral_variants) scan_ancestral_variants(i);
        if (!filter.skip_authored_arcs) {
            if (arcs.specializes) build_.tasks.add(Task::Specializes, i);
            if (arcs.inherits) build_.tasks.add(Task::Inherits, i);
            if (arcs.payloads) build_.tasks.add(Task::Payloads, i);
            if (arcs.references) build_.tasks.add(Task::References, i);
            if (n.contributes() && n.stack->has_relocates()) build_.tasks.add(Task::Relocates, i);
        }
        if (n.arc == ArcType::Relocate) build_.tasks.add(Task::ImpliedRelocates, i);
        return true;
    });
}

void TaskFinder::scan_ancestral_variants(int i) {
    const Node& n = graph_[i];
    Path path = n.path.parent();
    while (n.restricted_depth != 0 && path.element_count() >= n.restricted_depth)
        path = path.parent();
    for (; path.element_count() > 0; path = path.parent()) {
        if (site_arcs(*n.stack, path).variants)
            return build_.tasks.add(Task::AncestralVariantSets, i);
    }
}

int TaskFinder::implied_class_start(int class_node) const {
    // A hierarchy of classes is implied as a whole, from its instance on. Where that instance is
    // itself a class, reached by an ancestor's arc, go on from there, unless the hierarchy belongs
    // to the inside of that class.
    int start = class_node;
    while (is_class_arc(graph_[start].arc)) {
        const auto [instance, top_class] = graph_.class_hierarchy_start(start);
        start = instance;
        if (is_class_arc(graph_[instance].arc) &&
            graph_[top_class].path.has_prefix(graph_.path_at_introduction(instance))) {
            break;
        }
    }
    return start;
}

int TaskFinder::specialize_start(int i) const {
    int start = -1;
    for (; i > 0; i = graph_[i].parent) {
        if (graph_[i].arc == ArcType::Specialize) start = i;
    }
    return start;
}

}  // namespace velatura::usd::compose
