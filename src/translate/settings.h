// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "translate/context/context.h"
#include "translate/translate.h"

namespace velatura::translate {

/// Reads the RenderSettings prim (options.settings, else the stage's renderSettingsPrimPath) with
/// its products and vars into ctx.scene.settings, and what follows from it: purposes, material
/// purposes, wanted primvars, the working space. Errors: "unknown-settings", "unknown-pass",
/// "bad-resolution", "unknown-working-space".
Result<void> read_render_settings(Context& ctx, const TranslateOptions& options);

}  // namespace velatura::translate
