// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/asset_options.h"
#include "base/command_line.h"
#include "base/diagnostics.h"
#include "base/result.h"
#include "usd/layer/layer.h"
#include "usd/stage/stage.h"

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace velatura::app {

/// Prints diagnostics to stderr as they come: errors always, warnings and what was chosen for the
/// scene unless quiet, other notes when verbose. Unless verbose, only the first 20 of a code; when
/// the Diagnostics ends, the number of the others follows.
void print_diagnostics(Diagnostics& diagnostics, bool quiet, bool verbose);

/// A composed stage with what identifies its content.
struct LoadedStage {
    usd::stage::Stage stage;
    uint64_t content_hash = 0;             ///< of the bytes of every layer
    std::vector<std::string> layer_names;  ///< file names without folders, in order of opening
    double seconds = 0;
};

/// Adds --materialx to a command that shows what OpenUSD without its MaterialX plugin composes.
void add_materialx_option(Command& command, bool& reads_materialx);

/// Opens and composes. Assets are looked for in the search paths, then in
/// $PXR_AR_DEFAULT_SEARCH_PATH, and read where the asset roots of the process allow it. Errors:
/// those of Stage::open, "usage" (wrong overrides).
Result<LoadedStage> compose_stage(const std::string& path,
                                  Diagnostics& diagnostics,
                                  const AssetOptions& assets = {},
                                  bool reads_materialx = true);

/// The same of a root layer in memory, which must not change while the stage is used. Errors: also
/// "usage" for --variant and --set.
Result<LoadedStage> compose_layer(std::shared_ptr<usd::layer::Layer> root,
                                  Diagnostics& diagnostics,
                                  const AssetOptions& assets = {});

/// apply_asset_roots(), then compose_stage().
Result<LoadedStage> load_stage(const std::string& path,
                               Diagnostics& diagnostics,
                               const AssetOptions& assets = {},
                               bool reads_materialx = true);

}  // namespace velatura::app
