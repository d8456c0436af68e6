// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/stage/resolve.h"

#include <string>

namespace velatura::usd::stage {

/// What an asset path is relative to, and the variables its expression may name.
struct AssetAnchor {
    compose::LayerPtr layer;  ///< null for values that no layer holds
    const compose::LayerStack* stack = nullptr;
};

AssetAnchor asset_anchor(const PrimData& prim, const ValueOpinion& opinion, TimeCode time);

/// The asset path that authored text means: itself, or what its variable expression comes to. Empty
/// with a warning where the expression has errors or is no string; None is the empty path.
std::string evaluate_asset(const std::string& authored,
                           const AssetAnchor& anchor,
                           const std::string& prim_path,
                           SourceLoc loc,
                           Diagnostics& diagnostics);

}  // namespace velatura::usd::stage
