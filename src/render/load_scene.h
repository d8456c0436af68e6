// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/diagnostics.h"
#include "base/result.h"
#include "scene/scene.h"
#include "translate/translate.h"

#include <optional>
#include <string>

namespace velatura::render {

struct LoadOptions {
    /// Its time is that of `frame`.
    translate::TranslateOptions translate = {};
    std::optional<double> frame = {};      ///< nothing: the start of the stage, as usdrecord has it
    std::optional<double> volume_gb = {};  ///< grids may take that; nothing: half of the machine's
};

/// Opens and composes a stage, translates one frame of it and reads the grids of its volumes: what
/// a Renderer takes. What is wrong with the scene is said by diagnostics, and the rest goes on.
/// Errors: those of Stage::open and translate_stage, which leave no scene.
Result<scene::Scene> load_scene(const std::string& path,
                                const LoadOptions& options,
                                Diagnostics& diagnostics);

}  // namespace velatura::render
