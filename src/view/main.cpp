// SPDX-License-Identifier: Apache-2.0
// velatura-view: the window that `velatura view` opens.
#include "app/exit_codes.h"
#include "app/render_job.h"
#include "app/view_options.h"
#include "base/command_line.h"
#include "base/process/mapping_guard.h"
#include "base/process/memory_limit.h"
#include "compositor/window/desktop.h"
#include "compositor/window/glfw_window.h"
#include "compositor/window/window_loop.h"
#include "view/live_render.h"
#include "view/view_tools.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <vector>

namespace velatura::view {

namespace {

namespace window = compositor::window;

using Options = app::ViewOptions;

int report(const Error& error) {
    fmt::print(stderr, "error: {} [{}]\n", error.message, error.code);
    const bool is_usage =
        error.code == "usage" || error.code == "bad-script" || error.code == "bad-arguments";
    return is_usage ? app::UsageError : app::RenderError;
}

/// What looks are kept for, and files are called by.
std::string output_of(const app::RenderArguments& arguments) {
    if (!arguments.output.empty()) return arguments.output;
    return std::filesystem::path(arguments.scene).stem().string() + ".exr";
}

std::string edits_of(const Options& o) {
    if (!o.edits.empty()) return o.edits;
    return std::filesystem::path(o.render.scene).stem().string() + ".edits.usda";
}

int run(const Options& o) {
    if (!o.edits.empty() && !o.edits.ends_with(".usda"))
        return report({"usage", "--edits: expected a name ending in .usda, found " + o.edits});
    if (const auto ok = check_live_arguments(o.render); !ok) return report(ok.error());
    if (const auto job = app::make_render_job(o.render); !job) return report(job.error());
    auto player = window::player_of(o.script);
    if (!player) return report(player.error());
    auto opened = window::GlfwWindow::open(std::clamp(o.size[0], 320, 16384),
                                           std::clamp(o.size[1], 240, 16384));
    if (!opened) return report(opened.error());
    window::Desktop desktop(**opened, std::nullopt);
    if (!o.preset.empty()) {
        desktop.load_preset(o.preset);
        const window::Message& said = desktop.session().message();
        if (said.is_error) return report({"bad-preset", said.text});
    }
    const auto render = std::make_shared<LiveRender>(o.render, window::GlfwWindow::wake);
    desktop.set_source(render, output_of(o.render));
    ViewTools tools(*render, desktop, edits_of(o));
    window::LoopTimes times;
    window::LoopHooks hooks;
    hooks.press = [&](const window::KeyPress& key, bool is_repeat) {
        return tools.press(key, is_repeat);
    };
    hooks.begin_frame = [&] { tools.begin_frame(); };
    hooks.is_over = [&] { return render->is_ended(); };
    if (const auto ended = window::run_window(**opened, desktop, *player, times, hooks); !ended)
        return report(ended.error());
    if (o.prints_times) fmt::print("{}{}", times.text(), tools.times());
    return render->is_ended() ? render->exit_code() : app::Done;
}

int run_command(int argc, char** argv) {
    CommandLine app("Renders a USD scene in a window with the light mixer on it.", "velatura-view");
    Options o;
    app::declare_view_options(app, o);
    if (const std::optional<CommandExit> ended = app.parse(argc, argv)) {
        std::fputs(ended->text.c_str(), ended->code == app::Done ? stdout : stderr);
        return ended->code;
    }
    std::fputs(app.notes().c_str(), stderr);
    read_truncated_pages_as_zeros();
    return run(o);
}

}  // namespace

}  // namespace velatura::view

int main(int argc, char** argv) {
    try {
        velatura::reserve_memory();
        return velatura::view::run_command(argc, argv);
    } catch (const std::bad_alloc&) {
        std::fputs("error: out of memory [out-of-memory]\n", stderr);
    } catch (const std::exception& e) {
        std::fprintf(stderr, "error: %s [internal]\n", e.what());
    }
    return velatura::app::RenderError;
}
