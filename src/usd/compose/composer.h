// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/diagnostics.h"
#include "base/result.h"
#include "usd/compose/composition_error.h"
#include "usd/compose/index_frame.h"
#include "usd/compose/layer_registry.h"
#include "usd/compose/layer_stack.h"
#include "usd/compose/options.h"
#include "usd/compose/prim_index.h"

#include <map>
#include <memory>
#include <string>
#include <unordered_set>
#include <vector>

namespace velatura::usd::compose {

/// Names of child prims in composed order, and those that a relocation took away.
struct ChildNames {
    std::vector<layer::Token> names;
    std::vector<layer::Token> prohibited;  ///< sorted
};

/// Layers of a stage that are stronger than its root layer.
struct SessionLayers {
    LayerPtr made = nullptr;         ///< in memory, the strongest; may be null
    std::vector<std::string> files;  ///< strongest first
};

/// Composes prims of one root layer stack. Owns the layers, layer stacks and maps that prim indices
/// point to; the Diagnostics must outlive it. Not thread-safe: callers lock around index-building
/// calls; reading finished indices is safe.
class Composer {
  public:
    Composer(ComposeOptions options, Diagnostics& diagnostics);

    /// Opens the root layer and the session layers.
    Result<LayerStack*> open(const std::string& root_file, const SessionLayers& session);

    LayerStack* root_stack() const { return root_stack_; }

    /// Index of "/".
    PrimIndex root_index();
    /// Index of a child of a prim. `parent_is_instance`: local opinions below the parent do not
    /// count.
    PrimIndex child_index(const PrimIndex& parent, layer::Token name, bool parent_is_instance);
    /// Index of any prim, composed from the root down; invalid when the path is no prim's. Costs as
    /// many indices as the path has elements.
    PrimIndex prim_index(layer::Path path);

    /// Names of the children in composed order. Of an instance only what its prototype has. When a
    /// limit of ComposeOptions is reached, an error says so once and there are no more children.
    std::vector<layer::Token> child_names(const PrimIndex& index, bool is_instance);
    /// The same without limits, with the names that relocations forbid.
    ChildNames all_child_names(const PrimIndex& index, bool is_instance) const;
    /// Names of the properties, those of weaker sites first.
    std::vector<layer::Token> property_names(const PrimIndex& index) const;

    const ComposeOptions& options() const { return options_; }

    Diagnostics& diagnostics() { return diagnostics_; }

    /// Everything that was wrong so far.
    const CompositionErrors& errors() const { return errors_; }

    LayerRegistry& registry() { return registry_; }

    // For the types behind PrimIndexer
    /// The stack of a file, as seen from a stack that refers to it.
    Result<LayerStack*> layer_stack(const std::string& file, const LayerStack& referrer);
    /// Index of the site an arc leads to, composed from its root prim (or innermost variant) down.
    PrimIndex site_index(LayerStack* stack,
                         layer::Path path,
                         layer::Path stage_path,
                         bool contributes,
                         const IndexFrame* frame);

    MapTable& maps() { return maps_; }

    CompositionErrors& errors() { return errors_; }

    /// Counts work on the index under way, in nodes made or looked through; false when it has taken
    /// too much.
    bool spend(size_t nodes);

    /// A limit of the whole stage is reached: said once, nothing more is composed.
    bool is_exhausted() const { return is_exhausted_; }

  private:
    LayerStack* add_stack(std::unique_ptr<LayerStack> stack,
                          const std::vector<CompositionError>& errors);
    /// Reads the files that arcs of a stack's layers name, in parallel.
    void prefetch_arcs(const LayerStack& stack);
    /// Reports, once, that a limit of the stage is reached.
    void exhaust(layer::Path path);
    size_t node_limit() const;

    ComposeOptions options_;
    Diagnostics& diagnostics_;
    CompositionErrors errors_;
    LayerRegistry registry_;
    MapTable maps_;
    std::map<std::string, LayerStack*> stack_of_;  ///< by file and source of variables
    std::vector<std::unique_ptr<LayerStack>> stacks_;
    LayerStack* root_stack_ = nullptr;
    std::unordered_set<const layer::Layer*> counted_;
    size_t spec_count_ = 0;   ///< of all layers in stacks
    size_t prim_count_ = 0;   ///< prims composed or named
    size_t node_count_ = 0;   ///< nodes made for all of them
    size_t index_nodes_ = 0;  ///< work on the index under way
    layer::Path index_path_;  ///< of the index under way
    bool is_exhausted_ = false;
};

/// A target or connection path of a site, expressed in the namespace of the composed prim; empty
/// when it points outside what the arcs bring in.
layer::Path map_to_root(const Node& node, layer::Path path);

}  // namespace velatura::usd::compose
