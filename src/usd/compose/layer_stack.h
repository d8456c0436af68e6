// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/compose/composition_error.h"
#include "usd/compose/layer_registry.h"
#include "usd/compose/map_function.h"
#include "usd/compose/relocations.h"
#include "usd/layer/layer.h"

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace velatura::usd::compose {

/// One layer of a stack.
struct StackLayer {
    LayerPtr layer;
    TimeOffset to_root;  ///< time of this layer → time of the stack, rates of time codes included
    double rate = 24.0;  ///< the layer's own time codes per second, always above 0
};

/// A root layer with its sublayers, strongest first; of a stage also the session layers.
/// Ref: AOUSD Core Specification 1.0.1, §10.3.1.
class LayerStack {
  public:
    const std::vector<StackLayer>& layers() const { return layers_; }

    /// File of the root layer.
    const std::string& identifier() const { return identifier_; }

    const layer::Layer& root_layer() const { return *root_layer_; }

    /// The session layers, strongest first, then the root layer: whose metadata count for a stage.
    const std::vector<const layer::Layer*>& metadata_layers() const { return metadata_layers_; }

    double time_codes_per_second() const { return time_codes_per_second_; }

    bool has_spec(layer::Path path) const;

    const Relocations& relocations() const { return relocations_; }

    bool has_relocates() const { return !relocations_.empty(); }

    /// Variables that expressions in this stack see: the stack's own, under those of the stacks
    /// that refer to it.
    const layer::Dictionary& expression_variables() const { return expression_variables_; }

    /// Names the stack whose variables count; stacks of one root layer with equal sources are one.
    const std::string& variables_source() const { return variables_source_; }

    /// Value of an expression that must give a string; text that is no expression stays as it is.
    /// An error is added, and nothing comes back, when there is no value.
    std::optional<std::string> evaluate(const std::string& text,
                                        layer::Path site,
                                        SourceLoc loc,
                                        std::vector<CompositionError>* errors) const;

  private:
    friend class LayerStackBuilder;

    std::string identifier_;
    const layer::Layer* root_layer_ = nullptr;
    std::vector<const layer::Layer*> metadata_layers_;
    std::vector<StackLayer> layers_;
    double time_codes_per_second_ = 24.0;
    Relocations relocations_;
    layer::Dictionary expression_variables_;
    std::string variables_source_;
};

/// What a layer stack is made of.
struct LayerStackInputs {
    LayerPtr root;
    std::vector<LayerPtr> sessions = {};   ///< of a stage, strongest first
    const LayerStack* referrer = nullptr;  ///< whose expression variables are stronger; may be null
};

/// Builds a stack. Missing sublayers, cycles, bad offsets and relocations go to `errors`, bad rates
/// of time codes and what is ignored to `diagnostics`.
std::unique_ptr<LayerStack> build_layer_stack(const LayerStackInputs& inputs,
                                              LayerRegistry& registry,
                                              Diagnostics& diagnostics,
                                              std::vector<CompositionError>& errors);

}  // namespace velatura::usd::compose
