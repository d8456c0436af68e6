// SPDX-License-Identifier: Apache-2.0
#include "usd/compose/prim_graph.h"

#include "base/check.h"

#include <algorithm>

namespace velatura::usd::compose {

using layer::Path;
using layer::Token;

namespace {

/// A path some levels of namespace up; variant selections on the way go too, those above stay.
Path climb(Path path, size_t levels) {
    for (; levels > 0; --levels) {
        while (path.is_variant_selection()) path = path.parent();
        path = path.parent();
    }
    return path;
}

uint16_t clamp16(size_t n) {
    return uint16_t(std::min<size_t>(n, UINT16_MAX));
}

}  // namespace

const char* arc_name(ArcType arc) {
    switch (arc) {
        case ArcType::Root:
            return "root";
        case ArcType::Inherit:
            return "inherit";
        case ArcType::Variant:
            return "variant";
        case ArcType::Relocate:
            return "relocate";
        case ArcType::Reference:
            return "reference";
        case ArcType::Payload:
            return "payload";
        case ArcType::Specialize:
            return "specialize";
    }
    return "?";
}

size_t prim_depth(Path path) {
    size_t depth = path.element_count();
    while (path.has_variant_selection()) {
        if (path.is_variant_selection()) --depth;
        path = path.parent();
    }
    return depth;
}

// ---- Growing ----

void PrimGraph::reset(LayerStack* stack, Path path, const MapTable& maps) {
    Node root;
    root.stack = stack;
    root.path = path;
    root.to_parent = root.to_root = maps.identity();
    nodes_.assign(1, root);
}

int PrimGraph::insert(Node node, MapTable& maps) {
    node.to_root = maps.composed((*this)[node.parent].to_root, node.to_parent);
    node.first_child = node.next_sibling = -1;
    nodes_.push_back(node);
    const int child = int(nodes_.size()) - 1;
    link(child);
    return child;
}

int PrimGraph::insert_graph(const PrimGraph& graph, const Node& top, MapTable& maps) {
    const int base = int(nodes_.size());
    const auto shifted = [base](int i) { return i < 0 ? i : i + base; };
    nodes_.reserve(nodes_.size() + graph.size());
    nodes_.insert(nodes_.end(), graph.nodes_.begin(), graph.nodes_.end());

    Node& head = edit(base);
    head.parent = top.parent;
    head.origin = top.origin;
    head.arc = top.arc;
    head.namespace_depth = top.namespace_depth;
    head.sibling_number = top.sibling_number;
    head.to_parent = top.to_parent;
    head.to_root = maps.composed((*this)[top.parent].to_root, top.to_parent);
    head.first_child = shifted(head.first_child);
    const MapPtr to_root = head.to_root;
    for (int i = base + 1; i < int(nodes_.size()); ++i) {
        Node& n = edit(i);
        n.parent = shifted(n.parent);
        n.origin = shifted(n.origin);
        n.first_child = shifted(n.first_child);
        n.next_sibling = shifted(n.next_sibling);
        n.to_root = maps.composed(to_root, n.to_root);
    }
    link(base);
    return base;
}

void PrimGraph::link(int child) {
    const int parent = (*this)[child].parent;
    int previous = -1;
    int next = (*this)[parent].first_child;
    while (next >= 0 && compare_siblings(child, next) >= 0) {
        previous = next;
        next = (*this)[next].next_sibling;
    }
    edit(child).next_sibling = next;
    (previous < 0 ? edit(parent).first_child : edit(previous).next_sibling) = child;
}

void PrimGraph::append_child(Token name) {
    for (Node& n : nodes_) n.path = n.path.append_child(name);
}

// ---- Who may speak ----

void PrimGraph::set_inert(int i, bool inert) {
    Node& n = edit(i);
    if (n.inert == inert) return;
    n.inert = inert;
    n.restricted_depth = n.contributes() ? uint16_t(0) : clamp16(n.path.element_count());
}

void PrimGraph::set_culled(int i) {
    Node& n = edit(i);
    if (n.culled) return;
    n.culled = true;
    n.restricted_depth = clamp16(n.path.element_count());
}

void PrimGraph::make_subtree_inert(int i) {
    visit(i, [this](int below) {
        set_inert(below, true);
        return true;
    });
}

void PrimGraph::strengthen_origin(int i, int origin, uint16_t sibling_number) {
    if ((*this)[i].origin == origin || !precedes(origin, (*this)[i].origin)) return;
    const int parent = (*this)[i].parent;
    int previous = -1;
    for (int c = (*this)[parent].first_child; c != i; c = (*this)[c].next_sibling) previous = c;
    (previous < 0 ? edit(parent).first_child : edit(previous).next_sibling) =
        (*this)[i].next_sibling;
    edit(i).origin = origin;
    edit(i).sibling_number = sibling_number;
    link(i);
}

// ---- Asking ----

size_t PrimGraph::depth_below_introduction(int i) const {
    const Node& n = (*this)[i];
    if (n.parent < 0) return 0;
    const size_t depth = prim_depth((*this)[n.parent].path);
    return depth > n.namespace_depth ? depth - n.namespace_depth : 0;
}

Path PrimGraph::path_at_introduction(int i) const {
    return climb((*this)[i].path, depth_below_introduction(i));
}

std::pair<int, int> PrimGraph::class_hierarchy_start(int i) const {
    const size_t depth = depth_below_introduction(i);
    int instance = i;
    int top_class = i;
    while (is_class_arc((*this)[instance].arc) && depth_below_introduction(instance) == depth) {
        top_class = instance;
        instance = (*this)[instance].parent;
    }
    return {instance, top_class};
}

bool PrimGraph::is_implied_class(int i) const {
    const Node& n = (*this)[i];
    return is_class_arc(n.arc) && n.parent != n.origin;
}

bool PrimGraph::has_class_child(int i) const {
    for (int c = (*this)[i].first_child; c >= 0; c = (*this)[c].next_sibling) {
        if (is_class_arc((*this)[c].arc)) return true;
    }
    return false;
}

bool PrimGraph::has_specialize_below(int i) const {
    bool found = false;
    visit(i, [&](int at) {
        found = found || (at != i && (*this)[at].arc == ArcType::Specialize);
        return !found;
    });
    return found;
}

bool PrimGraph::is_in_subtree(int i, int top) const {
    while (i >= 0 && i != top) i = (*this)[i].parent;
    return i == top;
}

bool PrimGraph::is_propagated_specialize(int i) const {
    const Node& n = (*this)[i];
    if (n.arc != ArcType::Specialize || n.parent != 0) return false;
    const Node& origin = (*this)[n.origin];
    return n.stack == origin.stack && n.path == origin.path;
}

bool PrimGraph::has_site(const LayerStack* stack, Path path) const {
    return std::any_of(nodes_.begin(), nodes_.end(), [&](const Node& n) {
        return n.stack == stack && n.path == path && n.contributes();
    });
}

std::vector<int> PrimGraph::children(int i) const {
    std::vector<int> result;
    for (int c = (*this)[i].first_child; c >= 0; c = (*this)[c].next_sibling) result.push_back(c);
    return result;
}

void PrimGraph::visit(int top, const std::function<bool(int)>& visit) const {
    // The links lead through the tree without a stack
    int at = top;
    while (at >= 0) {
        if (visit(at) && (*this)[at].first_child >= 0) {
            at = (*this)[at].first_child;
            continue;
        }
        while (at != top && (*this)[at].next_sibling < 0) at = (*this)[at].parent;
        at = at == top ? -1 : (*this)[at].next_sibling;
    }
}

// ---- Strength ----

bool PrimGraph::precedes(int a, int b) const {
    if (a == b) return false;
    const auto depth_of = [this](int i) {
        size_t depth = 0;
        for (i = (*this)[i].parent; i >= 0; i = (*this)[i].parent) ++depth;
        return depth;
    };
    size_t x = depth_of(a);
    size_t y = depth_of(b);
    // An ancestor precedes what is below it
    const bool a_is_higher = x < y;
    for (; x > y; --x) a = (*this)[a].parent;
    for (; y > x; --y) b = (*this)[b].parent;
    if (a == b) return a_is_higher;
    while ((*this)[a].parent != (*this)[b].parent) {
        a = (*this)[a].parent;
        b = (*this)[b].parent;
    }
    for (int i = (*this)[a].next_sibling; i >= 0; i = (*this)[i].next_sibling) {
        if (i == b) return true;
    }
    return false;
}

std::pair<int, size_t> PrimGraph::origin_root(int i) const {
    size_t steps = 0;
    for (; (*this)[i].origin != (*this)[i].parent; ++steps) i = (*this)[i].origin;
    return {i, steps};
}

size_t PrimGraph::class_hierarchy_depth(int i) const {
    int instance = class_hierarchy_start(i).first;
    // A relocated site only stands for the prim that came from it
    while ((*this)[instance].arc == ArcType::Relocate) instance = (*this)[instance].parent;
    return (*this)[instance].namespace_depth;
}

int PrimGraph::compare_specializes(int a, int b) const {
    const Node& x = (*this)[a];
    const Node& y = (*this)[b];
    const auto [x_root, x_steps] = origin_root(a);
    const auto [y_root, y_steps] = origin_root(b);
    // Deeper is stronger, but what specializes is stronger than what it specializes
    if (!is_in_subtree(x_root, y_root) && !is_in_subtree(y_root, x_root) &&
        x.namespace_depth != y.namespace_depth) {
        return x.namespace_depth > y.namespace_depth ? -1 : 1;
    }
    const bool x_authored = x.origin == x.parent;
    const bool y_authored = y.origin == y.parent;
    const auto differs_from_origin = [this](const Node& n) {
        const Node& origin = (*this)[n.origin];
        return n.stack != origin.stack || n.path != origin.path;
    };
    // Of an implied class and the copy of the class it comes from the implied one is more local
    const auto by_implication = [&] {
        return int(differs_from_origin(y)) - int(differs_from_origin(x));
    };
    if (x.origin == y.origin) return x_authored || y_authored ? 0 : by_implication();
    if (x_root != y_root) return precedes(x_root, y_root) ? -1 : 1;

    // One authored arc, seen from several places
    const size_t x_depth = x_authored ? 0 : class_hierarchy_depth(x.origin);
    const size_t y_depth = y_authored ? 0 : class_hierarchy_depth(y.origin);
    if (x_depth != y_depth) return x_depth < y_depth ? -1 : 1;
    if (x_steps != y_steps) return x_steps > y_steps ? -1 : 1;
    if (x.stack == (*this)[0].stack && y.stack == (*this)[0].stack && !x_authored && !y_authored) {
        if (const int order = by_implication(); order != 0) return order;
    }
    return precedes(x.origin, y.origin) ? -1 : 1;
}

int PrimGraph::compare_siblings(int a, int b) const {
    const Node& x = (*this)[a];
    const Node& y = (*this)[b];
    if (x.arc != y.arc) return x.arc < y.arc ? -1 : 1;
    if (x.arc == ArcType::Specialize) {
        if (const int order = compare_specializes(a, b); order != 0) return order;
    } else {
        // Deeper is stronger, then the stronger origin
        if (x.namespace_depth != y.namespace_depth)
            return x.namespace_depth > y.namespace_depth ? -1 : 1;
        if (x.origin != y.origin) return precedes(x.origin, y.origin) ? -1 : 1;
    }
    return int(x.sibling_number) - int(y.sibling_number);
}

int PrimGraph::compare(int a, int b) const {
    if (a == b) return 0;
    return precedes(a, b) ? -1 : 1;
}

// ---- The end ----

std::vector<char> PrimGraph::erasable() const {
    std::vector<char> result(nodes_.size());
    for (size_t i = 0; i < nodes_.size(); ++i) result[i] = nodes_[i].culled;
    // Keep what others name as their origin, with all above it
    for (size_t i = 0; i < nodes_.size(); ++i) {
        bool is_needed = false;
        for (int at = int(i); at >= 0; at = nodes_[size_t(at)].origin) {
            if (!result[size_t(at)]) {
                is_needed = true;
            } else if (is_needed) {
                for (int p = at; p >= 0 && result[size_t(p)]; p = nodes_[size_t(p)].parent)
                    result[size_t(p)] = false;
            }
            if (nodes_[size_t(at)].origin == nodes_[size_t(at)].parent) break;
        }
    }
    return result;
}

void PrimGraph::finalize() {
    if (nodes_.size() < 2) return;
    const bool has_culled =
        std::any_of(nodes_.begin(), nodes_.end(), [](const Node& n) { return n.culled; });
    std::vector<char> erased;
    if (has_culled) erased = erasable();
    std::vector<int> order;
    order.reserve(nodes_.size());
    bool changed = false;
    visit(0, [&](int i) {
        if (has_culled && erased[size_t(i)]) {
            changed = true;
            return false;
        }
        changed = changed || i != int(order.size());
        order.push_back(i);
        return true;
    });
    if (!changed) return;

    std::vector<int> place(nodes_.size(), -1);
    for (size_t i = 0; i < order.size(); ++i) place[size_t(order[i])] = int(i);
    const auto moved = [&](int i) { return i < 0 ? i : place[size_t(i)]; };
    std::vector<Node> sorted;
    sorted.reserve(order.size());
    for (const int i : order) {
        Node n = (*this)[i];
        n.parent = moved(n.parent);
        n.origin = moved(n.origin);
        if (n.origin < 0) n.origin = n.parent;
        n.first_child = n.next_sibling = -1;
        sorted.push_back(n);
    }
    // Strength order is the order of the list: link children from the back
    for (size_t i = sorted.size(); i-- > 1;) {
        Node& parent = sorted[size_t(sorted[i].parent)];
        sorted[i].next_sibling = parent.first_child;
        parent.first_child = int(i);
    }
    nodes_ = std::move(sorted);
}

}  // namespace velatura::usd::compose
