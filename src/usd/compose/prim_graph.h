// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/compose/layer_stack.h"
#include "usd/compose/map_function.h"
#include "usd/layer/path.h"
#include "usd/layer/token.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

namespace velatura::usd::compose {

/// How a node hangs on its parent, strongest first among siblings (LIVERPS with the local site as
/// the parent itself).
enum class ArcType : uint8_t { Root, Inherit, Variant, Relocate, Reference, Payload, Specialize };

const char* arc_name(ArcType arc);

inline bool is_class_arc(ArcType arc) {
    return arc == ArcType::Inherit || arc == ArcType::Specialize;
}

/// Prim elements of a path, variant selections not counted.
size_t prim_depth(layer::Path path);

/// One site (layer stack + path) that may hold opinions about the prim of a PrimIndex.
struct Node {
    int parent = -1;
    /// Node whose arc this one repeats; the parent when the arc is authored there.
    int origin = -1;
    int first_child = -1;  ///< children in strength order
    int next_sibling = -1;
    uint16_t sibling_number = 0;   ///< place in the list that introduced the arc
    uint16_t namespace_depth = 0;  ///< prim elements of the parent's path where the arc was made
    /// Elements of the site's path where the node lost its say; 0 while it has it.
    uint16_t restricted_depth = 0;
    ArcType arc = ArcType::Root;
    bool due_to_ancestor = false;  ///< introduced by an ancestor of the prim
    bool has_specs = false;
    bool inert = false;           ///< contributes no opinions; its children may
    bool culled = false;          ///< contributes nothing, nor does anything below it
    bool only_implies = false;    ///< added only for what it implies further up
    bool moved = false;           ///< inert, since a copy elsewhere in the graph speaks instead
    LayerStack* stack = nullptr;  ///< owned by the Composer
    layer::Path path;
    MapPtr to_parent = nullptr;  ///< owned by the Composer, as is the next
    MapPtr to_root = nullptr;

    bool contributes() const { return !inert && !culled; }
};

/// The tree of nodes of a prim index, children in strength order.
/// Ref: AOUSD Core Specification 1.0.1, §10; the order of siblings follows Pixar's Pcp.
class PrimGraph {
  public:
    size_t size() const { return nodes_.size(); }

    bool empty() const { return nodes_.empty(); }

    const Node& operator[](int i) const { return nodes_[size_t(i)]; }

    const std::vector<Node>& nodes() const { return nodes_; }

    /// Direct access for changes that keep the shape of the tree.
    Node& edit(int i) { return nodes_[size_t(i)]; }

    /// Starts over with one site.
    void reset(LayerStack* stack, layer::Path path, const MapTable& maps);
    /// Adds a child of `node.parent` in strength order. Returns its number.
    int insert(Node node, MapTable& maps);
    /// Adds another graph whose root hangs on `top.parent` by the arc of `top`.
    int insert_graph(const PrimGraph& graph, const Node& top, MapTable& maps);
    /// Steps every site down to a child prim.
    void append_child(layer::Token name);

    /// Nodes are told not to contribute, or to do so again; remembers how deep that was.
    void set_inert(int i, bool inert);
    void set_culled(int i);
    void make_subtree_inert(int i);
    /// Lets a node repeat a stronger arc than it did, where `origin` is one.
    void strengthen_origin(int i, int origin, uint16_t sibling_number);

    /// Levels of namespace below the one where the arc to the node was made.
    size_t depth_below_introduction(int i) const;
    layer::Path path_at_introduction(int i) const;
    /// The first node and the topmost class of the chain of classes, made on one level of
    /// namespace, that a class node stands in.
    std::pair<int, int> class_hierarchy_start(int i) const;
    bool is_implied_class(int i) const;
    bool has_class_child(int i) const;
    bool has_specialize_below(int i) const;
    bool is_in_subtree(int i, int top) const;
    /// A specializes node that stands at the root for its weakness, a copy of its origin.
    bool is_propagated_specialize(int i) const;

    /// The child of a node below `top` in strength order, before it or equal: < 0 when a is
    /// stronger.
    int compare(int a, int b) const;
    bool has_site(const LayerStack* stack, layer::Path path) const;
    std::vector<int> children(int i) const;
    /// Visits a subtree strongest first; where `visit` returns false the children are left out.
    void visit(int top, const std::function<bool(int)>& visit) const;

    /// Puts the nodes in strength order and drops what is culled and no one's origin.
    void finalize();

  private:
    void link(int child);
    bool precedes(int a, int b) const;
    int compare_siblings(int a, int b) const;
    int compare_specializes(int a, int b) const;
    std::pair<int, size_t> origin_root(int i) const;
    size_t class_hierarchy_depth(int i) const;
    std::vector<char> erasable() const;

    std::vector<Node> nodes_;
};

}  // namespace velatura::usd::compose
