// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/command_line.h"
#include "base/result.h"
#include "usd/stage/stage.h"

#include <string>
#include <vector>

namespace velatura::app {

/// Opinions from the command line, stronger than the scene.
struct SceneOverrides {
    std::string session;                ///< a layer file
    std::vector<std::string> variants;  ///< /Prim{set=name}
    std::vector<std::string> values;    ///< /Prim.attribute=value, maybe with a type before it

    bool is_empty() const { return session.empty() && variants.empty() && values.empty(); }
};

/// Adds --session, --variant and --set.
void add_override_options(Command& command, SceneOverrides& overrides);

/// Name of the layer that holds what --variant and --set say: asset paths in it are relative to the
/// folder that the program runs in.
std::string override_layer_name();

/// Sets options.session_layer to the session layer, with what --variant and --set say above it. For
/// values the stage is composed here once, to know the types of the attributes. Errors: "usage" for
/// what does not fit the scene (the option is named), those of Stage::open.
Result<void> apply_overrides(const SceneOverrides& overrides,
                             const std::string& scene,
                             usd::stage::StageOptions& options);

}  // namespace velatura::app
