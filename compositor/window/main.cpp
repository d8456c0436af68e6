// SPDX-License-Identifier: Apache-2.0
// velatura-comp-ui: the window that `velatura-comp ui` opens.
#include "base/atomic_file.h"
#include "base/command_line.h"
#include "base/process/memory_limit.h"
#include "compositor/window/desktop.h"
#include "compositor/window/glfw_window.h"
#include "compositor/window/script_player.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
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

double median(std::vector<double> values, double share = 0.5) {
    if (values.empty()) return 0;
    std::sort(values.begin(), values.end());
    return values[std::min(size_t(share * double(values.size())), values.size() - 1)];
}

/// How long frames and mixes took, for whoever asks with --times.
class Times {
  public:
    void add_frame(double ms) { frames_.push_back(ms); }

    void add_mix(const MixTimes& times) {
        if (times.all == 0 || times.all == last_.all) return;
        last_ = times;
        first_.push_back(times.first);
        seen_.push_back(times.seen);
        all_.push_back(times.all);
    }

    void print() const {
        fmt::print("{} frames: median {:.1f} ms, 95 % {:.1f} ms\n", frames_.size(), median(frames_),
                   median(frames_, 0.95));
        fmt::print(
            "{} mixes, medians: first preview {:.0f} ms, visible part {:.0f} ms, full image {:.0f} "
            "ms\n",
            all_.size(), median(first_), median(seen_), median(all_));
    }

  private:
    std::vector<double> frames_, first_, seen_, all_;
    MixTimes last_;
};

Result<std::optional<ScriptPlayer>> player_of(const std::string& path) {
    if (path.empty()) return std::optional<ScriptPlayer>();
    const auto text = read_file(path);
    if (!text) return text.error();
    auto steps = parse_script(*text);
    if (!steps) return Error{steps.error().code, path + ": " + steps.error().message};
    return std::optional<ScriptPlayer>(ScriptPlayer(std::move(*steps)));
}

/// As a render does: whole at once, under the name of the old one.
Result<void> replace_file(const std::string& path, const std::string& by) {
    const auto bytes = read_file(by);
    if (!bytes) return bytes.error();
    return write_file_atomically(path, *bytes);
}

/// How long nothing needs to be drawn if nothing happens, in seconds. What becomes ready wakes the
/// window; drawing without need would take time from it where there is no graphics card.
double patience(const Desktop& desktop) {
    if (ImGui::IsAnyMouseDown()) return 0.02;
    // A little after the last event, what rests on a button gets its explanation
    return desktop.is_settled() ? 0.25 : 0.1;
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

    Times times;
    const auto is_over = [&] {
        return (*window)->is_closing() || desktop.wants_to_quit() ||
               (*player && (*player)->is_over());
    };
    while (!is_over() || desktop.is_saving()) {
        (*window)->wait(*player ? (*player)->patience() : patience(desktop));
        const auto begun = std::chrono::steady_clock::now();
        Result<void> played;
        (*window)->begin_frame([&] {
            if (*player) played = (*player)->play(desktop.marks(), desktop.is_settled());
        });
        if (!played) return report(played.error());
        for (const std::string& path : (*window)->take_dropped()) desktop.open(path);
        if (*player) {
            if (const auto path = (*player)->take_dropped()) desktop.open(*path);
            if (const auto files = (*player)->take_replaced()) {
                if (const auto done = replace_file(files->first, files->second); !done)
                    return report(done.error());
                desktop.expect_renewal();
            }
        }
        if (!ImGui::GetIO().WantTextInput) {
            for (const auto& [key, is_repeat] : GlfwWindow::pressed_keys())
                desktop.press(key, is_repeat);
        }
        desktop.draw();
        const auto drawn = *player ? (*window)->end_frame((*player)->screenshot(), (*player)->cut())
                                   : (*window)->end_frame("", std::nullopt);
        if (!drawn) return report(drawn.error());
        const std::chrono::duration<double, std::milli> took =
            std::chrono::steady_clock::now() - begun;
        times.add_frame(took.count());
        times.add_mix(desktop.times());
        if (*player && desktop.has_failed())
            return report({"io-open", desktop.session().message().text});
    }
    if (o.prints_times) times.print();
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
