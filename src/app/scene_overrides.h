// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/command_line.h"
#include "base/diagnostics.h"
#include "base/result.h"
#include "usd/stage/stage.h"

#include <string>
#include <vector>

namespace velatura::app {

/// Opinions from the command line, stronger than the scene.
struct SceneOverrides {
    std::vector<std::string> sessions;  ///< layer files, the last one the strongest
    std::vector<std::string> variants;  ///< /Prim{set=name}
    std::vector<std::string> values;    ///< /Prim.attribute=value, maybe with a type before it

    bool is_empty() const { return sessions.empty() && variants.empty() && values.empty(); }
};

/// Adds --session, --variant and --set.
void add_override_options(Command& command, SceneOverrides& overrides);

/// Name of the layer that holds what --variant and --set say: asset paths in it are relative to the
/// folder that the program runs in.
std::string override_layer_name();

/// The stage, and the text of the layer of --variant and --set (empty without).
struct OverriddenStage {
    usd::stage::Stage stage;
    std::string made_layer;
};

/// Adds the files of --session, the strongest first. Errors: "usage" (not found).
Result<void> add_session_layers(const SceneOverrides& overrides, usd::stage::StageOptions& options);

/// Stage::open with the session layers, and what --variant and --set say above them. A value that a
/// connection hides is a warning. Errors: "usage" for what does not fit the scene (the option is
/// named), those of Stage::open.
Result<OverriddenStage> open_stage(const SceneOverrides& overrides,
                                   const std::string& scene,
                                   usd::stage::StageOptions options,
                                   Diagnostics& diagnostics);

}  // namespace velatura::app
