// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/script_player.h"

#include "compositor/window/glfw_window.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <utility>

namespace velatura::compositor::window {

Result<void> ScriptPlayer::play(const Marks& marks, bool is_settled) {
    screenshot_.clear();
    cut_.reset();
    if (frames_.empty() && at_ < steps_.size()) {
        if (auto begun = begin_step(marks, is_settled); !begun) return begun;
    }
    InputFrame frame;
    frame.mouse = held_.mouse;
    if (!frames_.empty()) {
        frame = frames_.front();
        frames_.pop_front();
        if (!frame.mouse) frame.mouse = held_.mouse;
    }
    apply(frame);
    held_ = frame;
    return {};
}

Result<void> ScriptPlayer::begin_step(const Marks& marks, bool is_settled) {
    // Images that came in the last frame are drawn in the next
    constexpr int frames_to_settle = 3;
    const ScriptStep& step = steps_[at_];
    if (step.kind == ScriptStep::Kind::Wait) {
        settled_frames_ = is_settled ? settled_frames_ + 1 : 0;
        if (settled_frames_ < frames_to_settle) return {};
        settled_frames_ = 0;
    }
    Marks::Box box;
    if (!step.mark.empty()) {
        const Marks::Box* found = marks.find(step.mark);
        if (!found)
            return Error{"bad-script",
                         fmt::format("line {}: no '{}' on the screen", step.line, step.mark)};
        box = *found;
    }
    if (step.kind == ScriptStep::Kind::Whole && box.is_cut)
        return Error{"bad-script", fmt::format("line {}: '{}' is truncated", step.line, step.mark)};
    ++at_;
    switch (step.kind) {
        case ScriptStep::Kind::Whole:
        case ScriptStep::Kind::Wait:
            return {};
        case ScriptStep::Kind::Frames:
            frames_.assign(size_t(step.count), InputFrame());
            return {};
        case ScriptStep::Kind::Screenshot:
            screenshot_ = step.text;
            if (!step.mark.empty()) cut_ = box;
            return {};
        case ScriptStep::Kind::Drop:
            dropped_ = step.text;
            return {};
        case ScriptStep::Kind::Replace:
            replaced_ = {step.other, step.text};
            return {};
        default:
            for (InputFrame& frame : input_of(step, box)) frames_.push_back(std::move(frame));
            // What was clicked shows its effect before the next step looks for its mark
            frames_.insert(frames_.end(), 2, InputFrame());
            return {};
    }
}

void ScriptPlayer::apply(const InputFrame& frame) {
    ImGuiIO& io = ImGui::GetIO();
    // Double clicks must not depend on how fast the machine draws
    io.DeltaTime = 1.0f / 60;
    if (frame.mouse) io.MousePos = {(*frame.mouse)[0], (*frame.mouse)[1]};
    std::fill(std::begin(io.MouseDown), std::end(io.MouseDown), false);
    io.MouseDown[0] = frame.is_button_down;
    io.MouseWheel = frame.wheel;
    io.KeyCtrl = frame.is_ctrl;
    io.KeyShift = frame.is_shift;
    io.KeyAlt = frame.is_alt;
    if (held_.key) io.KeysDown[GlfwWindow::key_index(*held_.key)] = false;
    if (frame.key) io.KeysDown[GlfwWindow::key_index(*frame.key)] = true;
    io.AddInputCharactersUTF8(frame.typed.c_str());
}

double ScriptPlayer::patience() const {
    const bool is_waiting = frames_.empty() && at_ < steps_.size() &&
                            steps_[at_].kind == ScriptStep::Kind::Wait && settled_frames_ == 0;
    return is_waiting ? 0.1 : 0;
}

std::optional<std::string> ScriptPlayer::take_dropped() {
    return std::exchange(dropped_, std::nullopt);
}

std::optional<std::pair<std::string, std::string>> ScriptPlayer::take_replaced() {
    return std::exchange(replaced_, std::nullopt);
}

}  // namespace velatura::compositor::window
