// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "compositor/window/history.h"

#include <optional>
#include <string>
#include <utility>

namespace velatura::compositor::window {

/// Autosave of looks that are not saved as presets: one JSON file per layer file, restored when the
/// layer file is opened again, also after a crash.
class AutosavedLooks {
  public:
    /// folder: created when needed; empty: autosave is off.
    explicit AutosavedLooks(std::string folder = {}) : folder_(std::move(folder)) {}

    /// Looks of a layer file; nullopt: there are none, or they cannot be read.
    std::optional<Looks> find(const std::string& layers) const;
    /// Errors: "io-write".
    Result<void> keep(const std::string& layers, const Looks& looks) const;
    void drop(const std::string& layers) const;

  private:
    std::string path_of(const std::string& layers) const;

    std::string folder_;
};

/// In $XDG_STATE_HOME, else in ~/.local/state; empty where neither is known.
std::string autosave_folder();

}  // namespace velatura::compositor::window
