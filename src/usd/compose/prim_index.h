// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/compose/layer_stack.h"
#include "usd/compose/map_function.h"
#include "usd/layer/path.h"
#include "usd/layer/token.h"

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace velatura::usd::compose {

/// How a node hangs on its parent, strongest first among siblings (LIVRPS with the local site as
/// the parent itself).
enum class ArcType : uint8_t { Root, Inherit, Variant, Relocate, Reference, Payload, Specialize };

const char* arc_name(ArcType arc);

inline bool is_class_arc(ArcType arc) {
    return arc == ArcType::Inherit || arc == ArcType::Specialize;
}

/// One site (layer stack + path) that may hold opinions about the prim of a PrimIndex.
struct Node {
    int parent = -1;
    int origin =
        -1;  ///< node whose arc this one repeats; the parent when the arc is authored there
    int first_child = -1;  ///< children in strength order
    int next_sibling = -1;
    ArcType arc = ArcType::Root;
    uint16_t namespace_depth =
        0;  ///< prim elements of the parent's path where the arc was introduced
    uint16_t sibling_number = 0;   ///< place in the list that introduced the arc
    bool due_to_ancestor = false;  ///< introduced by an ancestor of the prim
    bool has_specs = false;
    bool inert = false;            ///< contributes no opinions; its children may
    bool arcs_done = false;        ///< its authored arcs have been followed
    bool skip_duplicates = false;  ///< its arcs leave out sites that the graph has already
    LayerStack* stack = nullptr;   ///< owned by the Composer
    layer::Path path;
    MapPtr to_parent;
    MapPtr to_root;
};

/// The graph of sites that one composed prim gathers its opinions from.
/// Ref: AOUSD Core Specification 1.0.1, §10.
class PrimIndex {
  public:
    const std::vector<Node>& nodes() const { return nodes_; }

    /// Nodes that have specs and contribute, strongest first; specializes after everything else.
    const std::vector<int>& contributing() const { return contributing_; }

    layer::Path path() const { return nodes_.front().path; }

    bool is_valid() const { return !nodes_.empty(); }

    /// A direct arc brought specs, so that `instanceable` metadata takes effect.
    bool has_direct_arc() const;

    bool has_payloads() const { return has_payloads_; }

    bool payloads_included() const { return payloads_included_; }

    /// Names that a relocation forbids for children.
    const std::vector<layer::Token>& prohibited_children() const { return prohibited_children_; }

    /// Contributing sites with all their data, equal for instances that may share a prototype.
    /// Empty when the prim has no direct arc.
    std::string instance_key() const;
    /// True for nodes that belong to what an instance shares: introduced at this prim, or below
    /// such a node.
    bool is_instance_node(int node) const;

    /// Text of the graph, one node per line, for debugging and tests.
    std::string to_string() const;

  private:
    friend class PrimIndexer;
    friend class Composer;

    std::vector<Node> nodes_;
    std::vector<int> contributing_;
    std::vector<layer::Token> prohibited_children_;
    bool has_payloads_ = false;
    bool payloads_included_ = false;
};

}  // namespace velatura::usd::compose
