// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "compositor/window/script.h"
#include "compositor/window/theme.h"

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

struct GLFWwindow;

namespace velatura::compositor::window {

/// The window of the operating system with Dear ImGui in it. One at a time.
class GlfwWindow {
  public:
    /// Errors: "no-display" (no screen, or no OpenGL on it).
    static Result<std::unique_ptr<GlfwWindow>> open(int width, int height);
    ~GlfwWindow();
    GlfwWindow(const GlfwWindow&) = delete;
    GlfwWindow& operator=(const GlfwWindow&) = delete;

    const Fonts& fonts() const { return fonts_; }

    bool is_closing() const;

    /// Waits for something to happen, at most so long; 0: not at all.
    void wait(double max_s);
    /// From any thread: ends a wait.
    static void wake();

    /// Files that were dropped since the last call.
    std::vector<std::string> take_dropped();

    struct PressedKey {
        KeyPress press;
        bool is_repeat = false;  ///< it is held down
    };

    /// Keys of the table that went down, or are held so long that they count again.
    static std::vector<PressedKey> pressed_keys();
    /// True while a key of the table is down.
    static bool is_key_held();

    /// `change_input` sees mouse and keys before ImGui does.
    void begin_frame(const std::function<void()>& change_input);
    /// Draws; with a name writes what is on the screen, or the box of it, as an image.
    Result<void> end_frame(const std::string& screenshot, const std::optional<Marks::Box>& box);

    /// The index that ImGui knows a key by.
    static int key_index(int key);

  private:
    explicit GlfwWindow(GLFWwindow* window);
    Result<void> write_screen(const std::string& path, const std::optional<Marks::Box>& box) const;

    GLFWwindow* window_;
    Fonts fonts_;
    std::vector<std::string> dropped_;
};

}  // namespace velatura::compositor::window
