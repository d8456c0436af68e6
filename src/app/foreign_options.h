// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"

#include <string>
#include <vector>

namespace velatura::app {

/// A command line of `velatura render`, without the program's name, in which options that people
/// type for usdrecord and husk are replaced by the ones of the same meaning: `--imageWidth 640` by
/// `--image-width 640`, `-n 10` of husk by the end of --frames, the second argument of usdrecord by
/// `-o`. Words of other commands, and own options, stay.
///
/// Error "usage": an option of theirs without such a meaning; the message says what to do.
/// Ref: usdrecord of OpenUSD 24.08, husk of Houdini 20.5 (docs/reference/rendering.md has the
/// table).
Result<std::vector<std::string>> with_own_options(std::vector<std::string> words);

/// A word that can only be a scene: `velatura scene.usda` renders it.
bool is_scene_name(const std::string& word);

}  // namespace velatura::app
