// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/diagnostics.h"
#include "base/result.h"
#include "scene/scene.h"
#include "translate/translate.h"
#include "usd/stage/stage.h"

#include <optional>
#include <string>

namespace velatura::render {

/// How load_scene() reads a stage.
struct LoadOptions {
    translate::TranslateOptions translate = {};  ///< its time is overwritten by `frame`
    std::optional<double> frame = {};      ///< time code; nullopt: start of the stage, as usdrecord
    std::optional<double> volume_gb = {};  ///< memory limit of grids [GB]; nullopt: half of the
                                           ///< machine's memory
};

/// Opens and composes a stage, translates one frame of it and reads the grids of its volumes.
/// Returns: a scene for a Renderer.
/// Errors:  those of Stage::open and translate_stage. Errors and warnings of parts of the scene go
///          to `diagnostics`; these parts fall back or are skipped.
Result<scene::Scene> load_scene(const std::string& path,
                                const LoadOptions& options,
                                Diagnostics& diagnostics);

/// The same of a stage that is open already, such as one in memory (usd/stage/open_layer.h).
Result<scene::Scene> load_scene(const usd::stage::Stage& stage,
                                const LoadOptions& options,
                                Diagnostics& diagnostics);

}  // namespace velatura::render
