// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "compositor/window/history.h"

#include <optional>
#include <string>
#include <utility>

namespace velatura::compositor::window {

/// Looks that no preset holds, one file of JSON for each file of layers: they outlive a window that
/// is killed, and come back with their layers.
class KeptLooks {
  public:
    /// An empty folder keeps nothing. It is made when it is needed.
    explicit KeptLooks(std::string folder = {}) : folder_(std::move(folder)) {}

    /// None: there are none, or they cannot be read.
    std::optional<Looks> find(const std::string& layers) const;
    /// Errors: "io-write".
    Result<void> keep(const std::string& layers, const Looks& looks) const;
    void drop(const std::string& layers) const;

  private:
    std::string path_of(const std::string& layers) const;

    std::string folder_;
};

/// In $XDG_STATE_HOME, else in ~/.local/state; empty where neither is known.
std::string kept_looks_folder();

}  // namespace velatura::compositor::window
