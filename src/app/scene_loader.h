// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/diagnostics.h"
#include "base/result.h"
#include "usd/stage/stage.h"

namespace velatura::app {

/// Prints diagnostics to stderr as they come: errors always, warnings unless quiet, notes when verbose.
void print_diagnostics(Diagnostics& diagnostics, bool quiet, bool verbose);

/// A composed stage with what identifies its content.
struct LoadedStage {
    usd::stage::Stage stage;
    uint64_t content_hash = 0;             ///< of the bytes of every layer
    std::vector<std::string> layer_names;  ///< file names without folders, in order of opening
    double seconds = 0;
};

/// Opens and composes. Errors: those of Stage::open.
Result<LoadedStage> load_stage(const std::string& path, Diagnostics& diagnostics);

}  // namespace velatura::app
