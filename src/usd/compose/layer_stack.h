// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/compose/layer_registry.h"
#include "usd/compose/map_function.h"
#include "usd/layer/layer.h"

#include <string>
#include <vector>

namespace velatura::usd::compose {

/// One layer of a stack.
struct StackLayer {
    LayerPtr layer;
    TimeOffset to_root;  ///< time of this layer → time of the stack, rates of time codes included
};

/// A root layer with its sublayers, strongest first; of a stage also the session layer.
/// Ref: AOUSD Core Specification 1.0.1, §10.3.1.
class LayerStack {
  public:
    const std::vector<StackLayer>& layers() const { return layers_; }

    const std::string& identifier() const { return identifier_; }

    double time_codes_per_second() const { return time_codes_per_second_; }

    bool has_spec(layer::Path path) const;

    /// Relocations of the stack, chains joined: source → target; an empty target deletes.
    const layer::Relocates& relocates() const { return relocates_; }

    /// Relocations as authored, one step each.
    const layer::Relocates& single_relocates() const { return single_relocates_; }

    bool has_relocates() const { return !relocates_.empty(); }

    /// The source that `target` is relocated from; empty when none.
    layer::Path relocation_source(layer::Path target) const;
    bool is_relocation_source(layer::Path path) const;

  private:
    friend class LayerStackBuilder;

    std::string identifier_;
    std::vector<StackLayer> layers_;
    double time_codes_per_second_ = 24.0;
    layer::Relocates relocates_;
    layer::Relocates single_relocates_;
};

/// Builds the stack of a root layer and, for a stage, a session layer (may be null). Missing
/// sublayers, cycles and bad offsets go to `diagnostics`.
std::unique_ptr<LayerStack> build_layer_stack(LayerPtr root,
                                              LayerPtr session,
                                              LayerRegistry& registry,
                                              Diagnostics& diagnostics);

}  // namespace velatura::usd::compose
