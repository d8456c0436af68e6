// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

namespace velatura::usd::compose {

enum class PayloadPolicy : unsigned char { LoadAll, LoadNone };

/// What composition depends on beside the layers.
struct ComposeOptions {
    std::vector<std::string>
        search_paths;  ///< tried for asset paths that do not start with ./ or ../ or /
    PayloadPolicy payloads = PayloadPolicy::LoadAll;
    /// Selections tried in order when no opinion selects a variant of the set.
    std::map<std::string, std::vector<std::string>> variant_fallbacks;

    size_t max_nodes_per_prim = 20000;  ///< nodes of one prim index; more is an error at that prim
    size_t max_arc_depth = 200;         ///< nested arcs of one prim index
    size_t max_path_depth = 1024;       ///< namespace depth of a composed prim
    size_t max_prims = 20'000'000;      ///< prims of one stage
    size_t max_layers = 100'000;        ///< layers opened
};

}  // namespace velatura::usd::compose
