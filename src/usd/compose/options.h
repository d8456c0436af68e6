// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/layer/path.h"

#include <cstddef>
#include <functional>
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
    /// Decides for each prim that has payloads whether they are loaded; instead of `payloads`.
    std::function<bool(layer::Path prim)> load_payloads = nullptr;
    /// Whether .mtlx files are layers, as with OpenUSD's MaterialX plugin; else they are errors.
    bool reads_materialx = true;
    /// Selections tried in order when no opinion selects a variant of the set.
    std::map<std::string, std::vector<std::string>> variant_fallbacks;

    size_t max_nodes_per_prim = 10000;  ///< nodes of one prim index; more is an error at that prim
    size_t max_variant_sets = 5000;     ///< of one site
    size_t max_arc_depth = 200;         ///< nested arcs of one prim index
    size_t max_path_depth = 1024;       ///< namespace depth of a composed prim
    size_t max_prims = 20'000'000;      ///< prims of one stage
    size_t max_layers = 100'000;        ///< layers opened
    /// Nodes of prim indices that one spec of the layers may give rise to, on the average: what
    /// stops a small file that asks for a huge stage.
    size_t max_nodes_per_spec = 1000;
    size_t min_node_limit = 250'000;  ///< of a stage, however few specs there are
};

}  // namespace velatura::usd::compose
