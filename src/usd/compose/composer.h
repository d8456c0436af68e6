// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/diagnostics.h"
#include "base/result.h"
#include "usd/compose/layer_registry.h"
#include "usd/compose/layer_stack.h"
#include "usd/compose/options.h"
#include "usd/compose/prim_index.h"
#include "usd/compose/prim_indexer.h"

#include <map>
#include <memory>
#include <string>
#include <vector>

namespace velatura::usd::compose {

/// Composes prims of one root layer stack. Owns the layers and layer stacks; the Diagnostics must
/// outlive it. Not thread-safe: callers lock around index-building calls.
class Composer {
  public:
    Composer(ComposeOptions options, Diagnostics& diagnostics);

    /// Opens the root layer and the session layer (file name, empty = none).
    Result<LayerStack*> open(const std::string& root_file, const std::string& session_file);

    LayerStack* root_stack() const { return root_stack_; }

    /// Index of "/".
    PrimIndex root_index();
    /// Index of a child of a prim. `parent_is_instance`: local opinions below the parent do not
    /// count.
    PrimIndex child_index(const PrimIndex& parent, layer::Token name, bool parent_is_instance);

    /// Names of the children in composed order. Of an instance only what its prototype has.
    std::vector<layer::Token> child_names(const PrimIndex& index, bool is_instance) const;

    const ComposeOptions& options() const { return options_; }

    Diagnostics& diagnostics() { return diagnostics_; }

    LayerRegistry& registry() { return registry_; }

    // For PrimIndexer
    Result<LayerStack*> layer_stack(const std::string& file);
    /// Index of any site, built from its root prim down.
    PrimIndex site_index(LayerStack* stack,
                         layer::Path path,
                         layer::Path stage_path,
                         const IndexFrame* frame);

  private:
    ComposeOptions options_;
    Diagnostics& diagnostics_;
    LayerRegistry registry_;
    std::map<std::string, std::unique_ptr<LayerStack>> stacks_;
    std::unique_ptr<LayerStack> root_stack_owner_;
    LayerStack* root_stack_ = nullptr;
};

/// A target or connection path of a site, expressed in the namespace of the composed prim; empty
/// when it points outside what the arcs bring in.
layer::Path map_to_root(const Node& node, layer::Path path);

}  // namespace velatura::usd::compose
