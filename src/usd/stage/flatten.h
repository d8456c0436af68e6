// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/layer/layer.h"
#include "usd/stage/stage.h"

#include <memory>
#include <string>
#include <string_view>

namespace velatura::usd::stage {

struct FlattenOptions {
    /// Folder of the file the layer will be written to: asset paths become relative to it. Empty:
    /// they become absolute.
    std::string asset_folder;
};

/// The composed stage as one layer without arcs, but for instances: those keep what is their own
/// and refer to root prims "Flattened_Prototype_N" (overs) that hold what they share.
///
/// What is kept: inactive prims, overs and classes; unregistered metadata; time samples in stage
/// time (those of value clips baked, splines retimed); blocks; empty lists of connections and
/// targets; the chosen variant of every set, as an empty variant. Asset paths are evaluated and
/// anchored, so that they mean the same files from anywhere.
/// Ref: Pixar's UsdStage::Flatten.
std::shared_ptr<layer::Layer> flatten_stage(const Stage& stage, const FlattenOptions& options = {});

/// First part of the names of prototype prims.
inline constexpr std::string_view flattened_prototype_prefix = "Flattened_Prototype_";

}  // namespace velatura::usd::stage
