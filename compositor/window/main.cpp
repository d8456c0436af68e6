// SPDX-License-Identifier: Apache-2.0
// velatura-comp-ui: the window that `velatura-comp ui` opens.
#include "base/command_line.h"
#include "base/process/memory_limit.h"
#include "compositor/window/desktop.h"
#include "compositor/window/glfw_window.h"
#include "compositor/window/window_loop.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <optional>
#include <string>
#include <vector>

namespace velatura::compositor::window {

namespace {

enum ExitCode { done = 0, failed = 1, usage = 2 };

struct Options {
    std::vector<std::string> inputs;
    std::string preset, script, input_space, stereo;
    std::optional<double> frame;
    int width = 1600, height = 960;
    bool prints_times = false, follows = false;
};

int report(const Error& error) {
    fmt::print(stderr, "error: {} [{}]\n", error.message, error.code);
    return error.code == "bad-script" || error.code == "bad-arguments" ? usage : failed;
}

bool is_preset(const std::string& path) {
    return path.ends_with(".json");
}

int run(const Options& o) {
    const std::string input = o.inputs.empty() ? "" : o.inputs[0];
    if (is_preset(input) && !o.preset.empty())
        return report({"bad-arguments", "--preset and " + input + " are two presets"});
    auto player = player_of(o.script);
    if (!player) return report(player.error());
    auto window = GlfwWindow::open(o.width, o.height);
    if (!window) return report(window.error());
    Desktop desktop(**window, o.frame);
    desktop.set_input_space(o.input_space);
    desktop.set_stereo(o.stereo);
    desktop.set_following(o.follows);
    if (o.frame && !std::isfinite(*o.frame))
        return report({"bad-arguments", "--frame is not a number"});
    for (const std::string& path : {o.preset, is_preset(input) ? input : std::string()}) {
        if (path.empty()) continue;
        desktop.load_preset(path);
        const Message& said = desktop.session().message();
        if (said.is_error) return report({"bad-preset", said.text});
    }
    if (o.inputs.size() > 1)
        desktop.open_together(o.inputs);
    else if (!input.empty() && !is_preset(input))
        desktop.open(input);

    LoopTimes times;
    if (const auto ended = run_window(**window, desktop, *player, times); !ended)
        return report(ended.error());
    if (o.prints_times) fmt::print("{}", times.text());
    return done;
}

int run_command(int argc, char** argv) {
    CommandLine app("Opens the light mixer window.", "velatura-comp-ui");
    Options o;
    app.add_option("input", o.inputs,
                   "File of light layers, sequence (shot.####.exr), preset (.json), or several "
                   "files of one AOV each");
    app.add_option("--preset", o.preset, "Preset to open (JSON)").type_name("FILE");
    app.add_option("--frame", o.frame, "Frame at which keyed values are read")
        .default_text("that of the file");
    app.add_option("--input-space", o.input_space,
                   "Color space of the file, overrides its header (see `velatura-comp mix`)")
        .type_name("SPACE");
    app.add_option("--stereo", o.stereo,
                   "View of a stereo file: left, right, or a name of the file")
        .type_name("VIEW")
        .default_text("the first");
    app.add_flag("--follow", o.follows, "Read the file again when a render replaces it");
    std::vector<int> size = {o.width, o.height};
    app.add_option("--size", size, "Window size").size(16384).default_text("1600 960");
    app.add_option("--script", o.script, "Script of mouse and key events to play before quitting")
        .type_name("FILE");
    app.add_flag("--times", o.prints_times, "Print the times of frames and mixes");
    app.example("velatura-comp-ui shot.exr");
    if (const std::optional<CommandExit> ended = app.parse(argc, argv)) {
        std::fputs(ended->text.c_str(), ended->code == done ? stdout : stderr);
        return ended->code;
    }
    o.width = std::clamp(size[0], 320, 16384);
    o.height = std::clamp(size[1], 240, 16384);
    return run(o);
}

}  // namespace

}  // namespace velatura::compositor::window

int main(int argc, char** argv) {
    using namespace velatura::compositor::window;
    try {
        velatura::reserve_memory();
        return run_command(argc, argv);
    } catch (const std::exception& e) {
        std::fprintf(stderr, "error: %s [internal]\n", e.what());
        return failed;
    }
}
