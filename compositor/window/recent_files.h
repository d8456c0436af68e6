// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace velatura::compositor::window {

/// The files that were open last, newest first, kept in a text file of one path a line.
class RecentFiles {
  public:
    /// `list_path` empty: nothing is kept.
    explicit RecentFiles(std::string list_path);

    const std::vector<std::string>& paths() const { return paths_; }

    /// Puts a path in front, as an absolute one, and writes the list; a list that cannot be written
    /// is no reason to stop.
    void add(const std::string& path);

  private:
    std::string list_path_;
    std::vector<std::string> paths_;
};

/// $XDG_STATE_HOME/velatura/recent_layers, or that of the XDG base directory specification's
/// default below $HOME; empty without a home.
std::string recent_list_path();

}  // namespace velatura::compositor::window
