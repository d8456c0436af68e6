// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/render_arguments.h"
#include "compositor/window/layer_source.h"
#include "view/live_control.h"

#include <array>
#include <atomic>
#include <functional>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace velatura::view {

/// Options of `velatura render` that a render in a window has no use for. Errors: "usage".
Result<void> check_live_arguments(const app::RenderArguments& arguments);

/// A render in a thread of its own, whose layers are those of a window.
class LiveRender : public compositor::window::LayerSource {
  public:
    /// `wake` is called from the thread whenever there is news. With an output (-o) the finished
    /// film is written to it.
    LiveRender(app::RenderArguments arguments, std::function<void()> wake);
    /// Ends the render.
    ~LiveRender() override;

    std::optional<Result<compositor::window::RenewedLayers>> take() override {
        return control_.take_layers();
    }

    std::string state() const override { return text_of(control_.status()); }

    bool is_settled() const override;

    LiveStatus status() const { return control_.status(); }

    /// Nothing is rendered any more: the scene could not be rendered, or a signal came.
    bool is_ended() const { return status().phase == LiveStatus::Phase::Ended; }

    /// Of exit_codes.h, once it has ended.
    int exit_code() const { return exit_code_; }

    void pause(bool is_paused);

    /// Values and another camera prim: the scene is read again, and what differs is rendered.
    void edit(LiveEdits edits);

    /// No more edits follow the last one: the image itself is rendered.
    void rest();

    /// Renders that part of the image alone [px]; none: all of it. What was rendered of the whole
    /// is kept, unless the scene is edited meanwhile.
    void set_region(const std::optional<image::Window>& region);

    /// Finds what is seen at a pixel of the image: LiveStatus::pick.
    void pick(const std::array<int, 2>& pixel);

    /// Writes the film so far with its sums; empty: to the output of the render.
    void save(const std::string& path = {});

  private:
    app::RenderArguments arguments_;
    LiveControl control_;
    std::atomic<int> exit_code_ = 0;
    std::jthread thread_;  ///< last: it uses all of the above
};

}  // namespace velatura::view
