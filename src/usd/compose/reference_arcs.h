// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/compose/arc_adder.h"
#include "usd/compose/index_build.h"
#include "usd/compose/site.h"

namespace velatura::usd::compose {

/// Follows references and payloads.
class ReferenceArcs {
  public:
    ReferenceArcs(IndexBuild& build, ArcAdder& arcs)
        : build_(build), composer_(build.composer), graph_(build.graph), arcs_(arcs) {}

    /// Adds the references of a node's site, or its payloads where they are to be loaded.
    void eval(int node, bool payloads);
    /// Reports a reference or payload whose target has no specs.
    void check_resolved(int node);

  private:
    void eval_reference(int node, const SiteReference& reference, int number, ArcType arc);
    bool includes_payloads(int node);

    IndexBuild& build_;
    Composer& composer_;
    PrimGraph& graph_;
    ArcAdder& arcs_;
};

}  // namespace velatura::usd::compose
