// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/window_loop.h"

#include "base/atomic_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <utility>

namespace velatura::compositor::window {

namespace {

double median(std::vector<double> values, double share = 0.5) {
    if (values.empty()) return 0;
    std::sort(values.begin(), values.end());
    return values[std::min(size_t(share * double(values.size())), values.size() - 1)];
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

/// Files that the script, or a hand, dropped onto the window or replaced.
Result<void> take_files(GlfwWindow& window, Desktop& desktop, std::optional<ScriptPlayer>& player) {
    for (const std::string& path : window.take_dropped()) desktop.open(path);
    if (!player) return {};
    if (const auto path = player->take_dropped()) desktop.open(*path);
    if (const auto files = player->take_replaced()) {
        if (const auto done = replace_file(files->first, files->second); !done) return done;
        desktop.expect_renewal();
    }
    return {};
}

}  // namespace

void LoopTimes::add_mix(const MixTimes& times) {
    if (times.all == 0 || times.all == last_.all) return;
    last_ = times;
    first_.push_back(times.first);
    seen_.push_back(times.seen);
    all_.push_back(times.all);
}

std::string LoopTimes::text() const {
    return fmt::format(
        "{} frames: median {:.1f} ms, 95 % {:.1f} ms\n"
        "{} mixes, medians: first preview {:.0f} ms, visible part {:.0f} ms, full image {:.0f} "
        "ms\n",
        frames_.size(), median(frames_), median(frames_, 0.95), all_.size(), median(first_),
        median(seen_), median(all_));
}

Result<std::optional<ScriptPlayer>> player_of(const std::string& path) {
    if (path.empty()) return std::optional<ScriptPlayer>();
    const auto text = read_file(path);
    if (!text) return text.error();
    auto steps = parse_script(*text);
    if (!steps) return Error{steps.error().code, path + ": " + steps.error().message};
    return std::optional<ScriptPlayer>(ScriptPlayer(std::move(*steps)));
}

Result<void> run_window(GlfwWindow& window,
                        Desktop& desktop,
                        std::optional<ScriptPlayer>& player,
                        LoopTimes& times,
                        const LoopHooks& hooks) {
    const auto is_over = [&] {
        return window.is_closing() || desktop.wants_to_quit() || (player && player->is_over()) ||
               (hooks.is_over && hooks.is_over());
    };
    while (!is_over() || desktop.is_saving()) {
        window.wait(player ? player->patience() : patience(desktop));
        const auto begun = std::chrono::steady_clock::now();
        Result<void> played;
        window.begin_frame([&] {
            if (player) played = player->play(desktop.marks(), desktop.is_settled());
        });
        if (!played) return played;
        if (auto taken = take_files(window, desktop, player); !taken) return taken;
        if (!ImGui::GetIO().WantTextInput) {
            for (const auto& [key, is_repeat] : GlfwWindow::pressed_keys()) {
                if (!hooks.press || !hooks.press(key, is_repeat)) desktop.press(key, is_repeat);
            }
        }
        if (hooks.begin_frame) hooks.begin_frame();
        desktop.draw();
        auto drawn = player ? window.end_frame(player->screenshot(), player->cut())
                            : window.end_frame("", std::nullopt);
        if (!drawn) return drawn;
        const std::chrono::duration<double, std::milli> took =
            std::chrono::steady_clock::now() - begun;
        times.add_frame(took.count());
        times.add_mix(desktop.times());
        if (player && desktop.has_failed())
            return Error{"io-open", desktop.session().message().text};
    }
    return {};
}

}  // namespace velatura::compositor::window
