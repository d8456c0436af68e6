// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/compose/prim_graph.h"
#include "usd/layer/path.h"
#include "usd/layer/token.h"

#include <string>
#include <vector>

namespace velatura::usd::compose {

/// The graph of sites that one composed prim gathers its opinions from.
/// Ref: AOUSD Core Specification 1.0.1, §10.
class PrimIndex {
  public:
    /// All nodes, strongest first.
    const std::vector<Node>& nodes() const { return graph_.nodes(); }

    const PrimGraph& graph() const { return graph_; }

    /// Nodes that have specs and contribute, strongest first.
    std::vector<int> contributing() const;

    layer::Path path() const { return graph_[0].path; }

    bool is_valid() const { return !graph_.empty(); }

    /// A direct arc brought specs, so that `instanceable` metadata takes effect.
    bool has_direct_arc() const;
    /// The strongest opinion about `instanceable` says yes, and there is a direct arc.
    bool is_instanceable() const;

    bool has_payloads() const { return has_payloads_; }

    bool payloads_included() const { return payloads_included_; }

    /// What two instances must have in common to share a prototype: the direct arcs with their
    /// sites and times, and the variant selections. Empty when the prim has no direct arc.
    std::string instance_key() const;
    /// True for nodes that belong to what an instance shares: introduced at this prim, or below
    /// such a node, and with specs.
    bool is_instance_node(int node) const;

  private:
    friend class IndexBuild;

    PrimGraph graph_;
    bool has_payloads_ = false;
    bool payloads_included_ = false;
};

}  // namespace velatura::usd::compose
