// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <memory>
#include <string>

namespace velatura::compositor::window {

/// An X server without a monitor (Xvfb), for as long as the object lives.
class VirtualScreen {
  public:
    /// Whether there is an Xvfb to start.
    static bool is_installed();

    /// Null where it does not start.
    static std::unique_ptr<VirtualScreen> start(int width, int height);
    ~VirtualScreen();
    VirtualScreen(const VirtualScreen&) = delete;
    VirtualScreen& operator=(const VirtualScreen&) = delete;

    const std::string& display() const { return display_; }  ///< `:99`

  private:
    VirtualScreen(pid_t server, std::string display)
        : server_(server), display_(std::move(display)) {}

    pid_t server_;
    std::string display_;
};

}  // namespace velatura::compositor::window
