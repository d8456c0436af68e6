// SPDX-License-Identifier: Apache-2.0
#include "usd/compose/prim_indexer.h"

#include "base/check.h"
#include "usd/compose/composer.h"
#include "usd/layer/fields.h"

#include <fmt/format.h>

#include <algorithm>

namespace velatura::usd::compose {

using layer::Path;
using layer::Token;

namespace {

/// Prim elements of a path, variant selections not counted.
size_t prim_depth(Path path) {
    return path.strip_variant_selections().element_count();
}

MapPtr share(MapFunction map) {
    static const MapPtr identity = std::make_shared<const MapFunction>(MapFunction::identity());
    if (map.is_identity()) return identity;
    return std::make_shared<const MapFunction>(std::move(map));
}

}  // namespace

PrimIndexer::PrimIndexer(Composer& composer,
                         PrimIndex& index,
                         Path stage_path,
                         const IndexFrame* frame)
    : composer_(composer), index_(index), stage_path_(stage_path), frame_(frame) {}

void PrimIndexer::report(const char* code, SourceLoc loc, std::string message) const {
    composer_.diagnostics().error(code, loc, stage_path_.to_string(), std::move(message));
}

void PrimIndexer::start(LayerStack* stack, Path path) {
    Node root;
    root.stack = stack;
    root.path = path;
    root.to_parent = root.to_root = share(MapFunction::identity());
    refresh_node(root);
    nodes().assign(1, root);
}

void PrimIndexer::descend(Token name, bool parent_is_instance) {
    std::vector<bool> is_shared;
    if (parent_is_instance) {
        for (size_t i = 0; i < nodes().size(); ++i)
            is_shared.push_back(index_.is_instance_node(int(i)));
    }
    for (size_t i = 0; i < nodes().size(); ++i) {
        Node& n = nodes()[i];
        if (parent_is_instance && !is_shared[i]) n.inert = true;
        n.path = n.path.append_child(name);
        n.due_to_ancestor = n.parent >= 0;
        n.arcs_done = false;
        n.skip_duplicates = false;
        refresh_node(n);
    }
    index_.has_payloads_ = false;
    index_.payloads_included_ = false;
    index_.prohibited_children_.clear();
}

void PrimIndexer::refresh_node(Node& n) const {
    n.has_specs = n.stack->has_spec(n.path);
}

// ---- Growing the graph ----

size_t PrimIndexer::arc_depth(int i) const {
    size_t depth = 0;
    for (; i >= 0; i = node(i).parent) ++depth;
    for (const IndexFrame* f = frame_; f; f = f->indexer->frame_) {
        for (i = f->parent; i >= 0; i = f->indexer->node(i).parent) ++depth;
    }
    return depth;
}

bool PrimIndexer::precedes(int a, int b) const {
    if (a == b) return false;
    std::vector<int> line_a, line_b;
    for (int i = a; i >= 0; i = node(i).parent) line_a.push_back(i);
    for (int i = b; i >= 0; i = node(i).parent) line_b.push_back(i);
    size_t common = 0;
    while (common < line_a.size() && common < line_b.size() &&
           line_a[line_a.size() - 1 - common] == line_b[line_b.size() - 1 - common]) {
        ++common;
    }
    if (common == line_a.size()) return true;
    if (common == line_b.size()) return false;
    const int top_a = line_a[line_a.size() - 1 - common];
    const int top_b = line_b[line_b.size() - 1 - common];
    for (int i = node(node(top_a).parent).first_child; i >= 0; i = node(i).next_sibling) {
        if (i == top_a) return true;
        if (i == top_b) return false;
    }
    return false;
}

bool PrimIndexer::is_stronger_sibling(int a, int b) const {
    const Node& x = node(a);
    const Node& y = node(b);
    if (x.arc != y.arc) return x.arc < y.arc;
    if (x.namespace_depth != y.namespace_depth) return x.namespace_depth > y.namespace_depth;
    if (x.origin != y.origin) {
        // Authored here beats implied; of implied ones the stronger origin wins
        if (x.origin == x.parent) return true;
        if (y.origin == y.parent) return false;
        return precedes(x.origin, y.origin);
    }
    return x.sibling_number < y.sibling_number;
}

void PrimIndexer::link_child(int parent, int child) {
    int previous = -1;
    int next = node(parent).first_child;
    while (next >= 0 && !is_stronger_sibling(child, next)) {
        previous = next;
        next = node(next).next_sibling;
    }
    nodes()[size_t(child)].next_sibling = next;
    (previous < 0 ? nodes()[size_t(parent)].first_child : nodes()[size_t(previous)].next_sibling) =
        child;
}

int PrimIndexer::add_node(Node n) {
    const int parent = n.parent;
    n.to_root = share(node(parent).to_root->after(*n.to_parent));
    nodes().push_back(std::move(n));
    const int id = int(nodes().size()) - 1;
    link_child(parent, id);
    return id;
}

int PrimIndexer::insert_subgraph(const PrimIndex& sub, const Node& top) {
    Node head = sub.nodes().front();
    head.parent = top.parent;
    head.origin = top.origin;
    head.arc = top.arc;
    head.namespace_depth = top.namespace_depth;
    head.sibling_number = top.sibling_number;
    head.to_parent = top.to_parent;
    head.inert = top.inert;
    head.due_to_ancestor = false;
    head.first_child = -1;
    const int base = int(nodes().size());
    add_node(head);

    // The rest keeps its order; only indices and the way to the root change
    const auto shifted = [base](int i) { return i < 0 ? i : i + base; };
    nodes()[size_t(base)].first_child = shifted(sub.nodes().front().first_child);
    for (size_t i = 1; i < sub.nodes().size(); ++i) {
        Node n = sub.nodes()[i];
        n.parent = shifted(n.parent);
        n.origin = shifted(n.origin);
        n.first_child = shifted(n.first_child);
        n.next_sibling = shifted(n.next_sibling);
        nodes().push_back(std::move(n));
    }
    // Parents may stand after their children in the list: walk the tree
    std::vector<int> open = {base};
    while (!open.empty()) {
        const int at = open.back();
        open.pop_back();
        for (int c = node(at).first_child; c >= 0; c = node(c).next_sibling) {
            nodes()[size_t(c)].to_root = share(node(at).to_root->after(*node(c).to_parent));
            open.push_back(c);
        }
    }
    return base;
}

bool PrimIndexer::makes_cycle(const ArcRequest& request) const {
    if (request.arc == ArcType::Variant || request.arc == ArcType::Relocate) return false;
    const Path target = request.path.strip_variant_selections();
    const auto clashes = [&](const Node& n) {
        if (n.stack != request.stack) return false;
        // A relocated site stands for its source; the arcs of that source tell of cycles
        const Path seen = n.path.strip_variant_selections();
        return seen.has_prefix(target) || target.has_prefix(seen);
    };
    for (int i = request.parent; i >= 0; i = node(i).parent) {
        if (clashes(node(i))) return true;
    }
    for (const IndexFrame* f = frame_; f; f = f->indexer->frame_) {
        for (int i = f->parent; i >= 0; i = f->indexer->node(i).parent) {
            if (clashes(f->indexer->node(i))) return true;
        }
    }
    return false;
}

std::string PrimIndexer::describe_cycle(const ArcRequest& request) const {
    std::string text;
    for (int i = request.parent; i >= 0; i = node(i).parent) {
        const Node& n = node(i);
        text = fmt::format("<{}>{}{}", n.path.to_string(),
                           n.arc == ArcType::Root ? "" : fmt::format(" ({})", arc_name(n.arc)),
                           text.empty() ? "" : " → " + text);
    }
    return text;
}

bool PrimIndexer::is_duplicate(const ArcRequest& request) const {
    Path path = request.path;
    const PrimIndexer* at = this;
    const IndexFrame* f = frame_;
    while (true) {
        for (const Node& n : at->nodes()) {
            if (n.stack == request.stack && n.path == path) return true;
        }
        if (!f) return false;
        // The waiting graph stands deeper in namespace than the ancestor built here
        const Path here = at->index_.path();
        if (!f->requested.has_prefix(here)) return false;
        const size_t above = f->requested.element_count() - here.element_count();
        std::vector<Token> names;
        Path rest = f->requested;
        for (size_t i = 0; i < above; ++i, rest = rest.parent()) names.push_back(rest.name());
        for (auto name = names.rbegin(); name != names.rend(); ++name)
            path = path.append_child(*name);
        at = f->indexer;
        f = at->frame_;
    }
}

int PrimIndexer::add_arc(const ArcRequest& request) {
    if (overflow_) return -1;
    if (nodes().size() >= composer_.options().max_nodes_per_prim ||
        arc_depth(request.parent) >= composer_.options().max_arc_depth) {
        overflow_ = true;
        report(
            "usd-too-many-arcs", request.loc,
            fmt::format("limit of {} nodes or {} nested arcs reached at {} arc to <{}>",
                        composer_.options().max_nodes_per_prim, composer_.options().max_arc_depth,
                        arc_name(request.arc), request.path.to_string()));
        return -1;
    }
    if (makes_cycle(request)) {
        report("usd-arc-cycle", request.loc,
               fmt::format("{} arc to @{}@<{}> makes a cycle with {}", arc_name(request.arc),
                           request.stack->identifier(), request.path.to_string(),
                           describe_cycle(request)));
        return -1;
    }
    // Below an implied class at a deep site, opinions that came another way already must not come
    // twice
    const bool skip = request.skip_duplicates || node(request.parent).skip_duplicates ||
                      (frame_ && frame_->skip_duplicates);
    if (skip && request.arc != ArcType::Variant && is_duplicate(request)) return -1;

    Node n;
    n.parent = request.parent;
    n.origin = request.origin;
    n.arc = request.arc;
    n.namespace_depth = uint16_t(prim_depth(node(request.parent).path));
    n.sibling_number = uint16_t(request.number);
    n.inert = !request.contributes;
    n.stack = request.stack;
    n.path = request.path;
    n.to_parent = share(request.map);

    const bool ancestral =
        request.ancestral && request.path.element_count() > 1 && request.arc != ArcType::Variant;
    if (!ancestral) {
        refresh_node(n);
        n.skip_duplicates = node(request.parent).skip_duplicates;
        const int id = add_node(n);
        add_tasks(id);
        return id;
    }

    // Compose the ancestors of the target first; their arcs bring opinions about the target too
    const IndexFrame frame{this, request.parent, request.stack, request.path, n.to_parent, skip};
    PrimIndex sub = composer_.site_index(request.stack, request.path.parent(), stage_path_, &frame);
    PrimIndexer(composer_, sub, stage_path_, &frame).descend(request.path.name(), false);
    const int id = insert_subgraph(sub, n);
    for (size_t i = size_t(id); i < nodes().size(); ++i) {
        nodes()[i].skip_duplicates = skip;
        add_tasks(int(i));
    }
    return id;
}

void PrimIndexer::mark_inert(int i) {
    nodes()[size_t(i)].inert = true;
    for (int c = node(i).first_child; c >= 0; c = node(c).next_sibling) mark_inert(c);
}

// ---- Tasks ----

void PrimIndexer::add_tasks(int i) {
    const Node& n = node(i);
    if (is_class_arc(n.arc)) tasks_[ImpliedClasses].push_back(i);
    if (n.arcs_done || n.inert || !n.has_specs) return;
    tasks_[References].push_back(i);
    tasks_[Payloads].push_back(i);
    tasks_[Inherits].push_back(i);
    tasks_[Specializes].push_back(i);
    int number = 0;
    for (std::string& set : site_variant_sets(*n.stack, n.path))
        variants_.push_back({i, std::move(set), number++});
    nodes()[size_t(i)].arcs_done = true;
}

void PrimIndexer::run() {
    if (!stage_path_.is_absolute_root() && nodes().front().path.element_count() > 0) {
        // Ancestral arcs are there already; what is new are the opinions at this level
        for (size_t i = 0, count = nodes().size(); i < count; ++i) {
            const bool is_class = is_class_arc(nodes()[i].arc);
            const size_t implied = tasks_[ImpliedClasses].size();
            add_tasks(int(i));
            if (is_class) tasks_[ImpliedClasses].resize(implied);
        }
        bool busy = true;
        while (busy) {
            busy = false;
            for (int kind = 0; kind < TaskKinds && !busy; ++kind) {
                if (tasks_[kind].empty()) continue;
                const int i = tasks_[kind].front();
                tasks_[kind].pop_front();
                busy = true;
                if (kind == References) eval_references(i, false);
                if (kind == Payloads) eval_references(i, true);
                if (kind == Inherits) eval_classes(i, false);
                if (kind == Specializes) eval_classes(i, true);
                if (kind == ImpliedClasses) eval_implied_classes(i);
            }
            if (!busy) busy = eval_next_variant();
        }
        check_unresolved();
    }
    rank();
}

MapFunction PrimIndexer::arc_map(const Node& parent, Path source, TimeOffset offset) const {
    MapFunction map({{source, parent.path.strip_variant_selections()}}, offset);
    return map;
}

void PrimIndexer::eval_references(int i, bool payloads) {
    if (node(i).inert) return;
    const std::vector<SiteReference> references =
        site_references(*node(i).stack, node(i).path, payloads, composer_.registry());
    if (references.empty()) return;
    if (payloads) {
        index_.has_payloads_ = true;
        if (composer_.options().payloads == PayloadPolicy::LoadNone) return;
        index_.payloads_included_ = true;
    }
    int number = 0;
    for (const SiteReference& reference : references)
        eval_reference(i, reference, number++, payloads);
}

void PrimIndexer::eval_reference(int i, const SiteReference& reference, int number, bool payload) {
    const char* arc = payload ? "payload" : "reference";
    TimeOffset offset = reference.offset;
    if (!(offset.scale > 0.0)) {
        report("usd-bad-layer-offset", reference.loc,
               fmt::format("scale of {} @{}@ is {}, expected above 0", arc, reference.asset,
                           offset.scale));
        offset = {};
    }
    Path target = reference.prim_path;
    if (!target.is_empty() &&
        (!target.is_prim() || !target.is_absolute() || target.has_variant_selection())) {
        report("usd-invalid-arc-path", reference.loc,
               fmt::format("{} to <{}> is invalid: expected an absolute prim path", arc,
                           target.to_string()));
        return;
    }

    // Find the layer stack
    LayerStack* stack = node(i).stack;
    const double own_rate = reference.layer->layer->time_codes_per_second();
    if (!reference.asset.empty()) {
        Result<LayerStack*> opened = composer_.layer_stack(reference.file);
        if (!opened) {
            report("usd-unresolved-asset", reference.loc,
                   fmt::format("cannot open {} @{}@: {}", arc, reference.asset,
                               opened.error().message));
            return;
        }
        stack = *opened;
    }
    const layer::Layer& target_root =
        *std::find_if(stack->layers().begin(), stack->layers().end(), [&](const StackLayer& l) {
             return l.layer->identifier() == stack->identifier();
         })->layer;
    if (target.is_empty()) {
        target = target_root.default_prim();
        if (target.is_empty()) {
            report("usd-unresolved-default-prim", reference.loc,
                   fmt::format("{} @{}@ names no prim and the layer has no defaultPrim", arc,
                               reference.asset));
            return;
        }
    }

    // Retime: the offset of the layer that speaks, the authored one, then the two rates
    if (own_rate > 0.0) offset.scale *= own_rate / stack->time_codes_per_second();
    ArcRequest request{payload ? ArcType::Payload : ArcType::Reference, i, i, stack, target, {}};
    request.map = arc_map(node(i), target, reference.layer->to_root.after(offset));
    request.number = number;
    request.loc = reference.loc;
    const int added = add_arc(request);
    if (added >= 0) {
        const std::string name = fmt::format("@{}@<{}>", reference.asset, target.to_string());
        unresolved_.push_back({added, name, reference.loc, payload});
    }
}

void PrimIndexer::check_unresolved() {
    for (const Unresolved& entry : unresolved_) {
        std::vector<int> open = {entry.node};
        bool found = false;
        while (!open.empty() && !found) {
            const int i = open.back();
            open.pop_back();
            found = node(i).has_specs;
            for (int c = node(i).first_child; c >= 0; c = node(c).next_sibling) open.push_back(c);
        }
        if (found) continue;
        report("usd-unresolved-prim-path", entry.loc,
               fmt::format("{} target {} not found", entry.payload ? "payload" : "reference",
                           entry.target));
    }
}

void PrimIndexer::eval_classes(int i, bool specializes) {
    if (node(i).inert) return;
    const std::vector<SiteClass> classes = site_classes(*node(i).stack, node(i).path, specializes);
    int number = 0;
    for (const SiteClass& target : classes) {
        ArcRequest request{specializes ? ArcType::Specialize : ArcType::Inherit,
                           i,
                           i,
                           node(i).stack,
                           target.path,
                           {}};
        request.number = number++;
        request.loc = target.loc;
        if (!target.path.is_prim() || !target.path.is_absolute() ||
            target.path.has_variant_selection()) {
            report("usd-invalid-arc-path", target.loc,
                   fmt::format("{} arc to <{}> is invalid: expected an absolute prim path",
                               arc_name(request.arc), target.path.to_string()));
            continue;
        }
        request.map = arc_map(node(i), target.path, {}).with_root_identity();
        request.skip_duplicates = target.path.element_count() > 1;
        add_arc(request);
    }
}

int PrimIndexer::starting_node(int class_node) const {
    // Climb to the instance at the foot of the class hierarchy: classes of classes are implied as
    // one tree
    int start = class_node;
    while (is_class_arc(node(start).arc)) {
        const auto below_introduction = [&](int i) {
            return prim_depth(node(node(i).parent).path) - node(i).namespace_depth;
        };
        const size_t depth = below_introduction(start);
        int instance = start;
        int top_class = start;
        while (is_class_arc(node(instance).arc) && below_introduction(instance) == depth) {
            top_class = instance;
            instance = node(instance).parent;
        }
        start = instance;
        if (!is_class_arc(node(instance).arc)) break;
        // A class outside the namespace that the lower class arc maps repeats itself there: pass on
        // to the next
        const Path mapped =
            node(instance).to_parent->to_target(node(top_class).path.strip_variant_selections());
        if (mapped != node(top_class).path.strip_variant_selections()) break;
    }
    return start;
}

void PrimIndexer::eval_implied_classes(int i) {
    const int start = starting_node(i);
    const int parent = node(start).parent;
    if (parent < 0) return;
    implied_task_ = i;
    const MapFunction transfer =
        MapFunction(node(start).to_parent->pairs(), {}).with_root_identity();
    imply_class_tree(parent, start, transfer, transfer.inverse());
}

void PrimIndexer::imply_class_tree(int dest,
                                   int source,
                                   const MapFunction& transfer,
                                   const MapFunction& back) {
    std::vector<int> classes;
    for (int c = node(source).first_child; c >= 0; c = node(c).next_sibling) {
        if (is_class_arc(node(c).arc)) classes.push_back(c);
    }
    for (const int c : classes) {
        const MapFunction map = transfer.after(node(c).to_parent->after(back)).with_root_identity();
        int image = -1;
        for (int d = node(dest).first_child; d >= 0 && image < 0; d = node(d).next_sibling) {
            if (node(d).arc == node(c).arc && *node(d).to_parent == map) image = d;
        }
        if (image < 0) {
            const Path path = map.to_source(node(dest).path.strip_variant_selections());
            if (path.is_empty() || !path.is_prim()) continue;
            ArcRequest request{node(c).arc, dest, c, node(dest).stack, path, map};
            request.number = node(c).sibling_number;
            // The same site again: keep the node so that the class travels on, but not its opinions
            // twice
            request.contributes = node(dest).stack != node(c).stack || path != node(c).path;
            request.ancestral = request.contributes && path.element_count() > 1;
            request.skip_duplicates = request.ancestral;
            // What the new node says itself goes first; then the class comes back with its own
            // classes
            if (add_arc(request) >= 0) tasks_[ImpliedClasses].push_back(implied_task_);
            continue;
        }
        if (image != c) imply_class_tree(image, c, transfer, back);
    }
}

}  // namespace velatura::usd::compose
