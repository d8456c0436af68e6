// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "compositor/window/actions.h"
#include "compositor/window/levels.h"
#include "compositor/window/worker.h"

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace velatura::compositor::window {

/// What the window writes from a look, beside presets.
enum class OutputKind { Image, NukeScript, OiioScript, BlenderScript, Bake, Request };

/// What an output is written from.
struct OutputSource {
    std::string layers;  ///< path of the file
    std::shared_ptr<const Levels> levels;
    std::shared_ptr<const ImageTask> task;
};

/// A line of the table of outputs, which menus and dialogs show.
struct Output {
    OutputKind kind;
    Action action;
    const char* title;
    const char* extension;  ///< where none is typed
    const char* hint;
    /// Writes the file by the code of the command of that name, in any thread. Returns: what there
    /// is to say beside the path, perhaps nothing.
    Result<std::string> (*write)(const OutputSource& source, const std::string& path);
};

std::span<const Output> outputs();
const Output& output_of(OutputKind kind);
/// None: the action writes nothing.
std::optional<OutputKind> output_of(Action action);

/// All files that an output writes: the path, and what lies beside it.
std::vector<std::string> files_of(OutputKind kind, const std::string& path);

}  // namespace velatura::compositor::window
