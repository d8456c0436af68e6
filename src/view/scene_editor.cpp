// SPDX-License-Identifier: Apache-2.0
#include "view/scene_editor.h"

#include "render/scene_update.h"
#include "view/camera_edits.h"

#include <algorithm>
#include <utility>

namespace velatura::view {

namespace {

/// The oldest ones are forgotten.
constexpr size_t max_steps = 1000;

bool is_same_place(const std::optional<scene::Camera>& a, const std::optional<scene::Camera>& b) {
    return a.has_value() == b.has_value() && (!a || is_same_pose(*a, *b));
}

}  // namespace

bool is_same_state(const SceneState& a, const SceneState& b) {
    return is_same_place(a.camera, b.camera) && a.camera_prim == b.camera_prim &&
           a.values == b.values;
}

void SceneEditor::note(const LiveStatus& status) {
    if (status.loads == loads_) return;
    loads_ = status.loads;
    of_scene_ = status.scene_camera;
    seen_ = now_.camera && of_scene_
                ? with_pose(*of_scene_, render::rebased(*now_.camera, of_scene_->world_position))
                : status.camera;
}

void SceneEditor::edit(const std::string& gesture,
                       bool is_moving,
                       const std::function<void(SceneState&)>& change,
                       std::vector<compositor::Control> baked) {
    const SceneState before = now_;
    change(now_);
    if (is_same_state(before, now_)) return;
    if (gesture.empty() || gesture != gesture_) {
        undone_from_.push_back({before, std::move(baked)});
        if (undone_from_.size() > max_steps) undone_from_.erase(undone_from_.begin());
    }
    gesture_ = gesture;
    redone_from_.clear();
    tell(before, is_moving);
}

void SceneEditor::move_camera(const std::string& gesture,
                              bool is_moving,
                              const scene::Camera& camera) {
    edit(gesture, is_moving, [&](SceneState& s) {
        s.camera = camera;
        if (of_scene_ && is_same_pose(camera, *of_scene_)) s.camera.reset();
    });
}

void SceneEditor::seal() {
    gesture_.clear();
    if (std::exchange(is_moving_, false)) render_.rest();
}

/// Asks for what differs from the state before.
void SceneEditor::tell(const SceneState& before, bool is_moving) {
    is_moving_ = is_moving;
    LiveEdits edits;
    if (!(before.values == now_.values)) edits.values = now_.values.values();
    const bool is_other_prim = before.camera_prim != now_.camera_prim;
    if (is_other_prim) edits.camera_prim = now_.camera_prim;
    if (!is_same_place(before.camera, now_.camera)) {
        if (now_.camera)
            edits.camera = now_.camera;
        else
            edits.is_camera_reset = true;
    } else if (is_other_prim) {
        edits.camera = now_.camera;
    }
    if (edits.camera) seen_ = edits.camera;
    if (edits.is_camera_reset && !is_other_prim && of_scene_) seen_ = of_scene_;
    edits.is_moving = is_moving;
    render_.edit(std::move(edits));
}

std::optional<std::vector<compositor::Control>> SceneEditor::step(std::vector<Step>& from,
                                                                  std::vector<Step>& to) {
    if (from.empty()) return std::nullopt;
    Step step = std::move(from.back());
    from.pop_back();
    const SceneState before = std::exchange(now_, std::move(step.state));
    to.push_back({before, step.baked});
    gesture_.clear();
    tell(before, false);
    return step.baked;
}

std::optional<std::vector<compositor::Control>> SceneEditor::undo() {
    return step(undone_from_, redone_from_);
}

std::optional<std::vector<compositor::Control>> SceneEditor::redo() {
    return step(redone_from_, undone_from_);
}

Result<void> SceneEditor::save(const std::string& path) const {
    std::vector<PrimEdit> edits = now_.values.opinions();
    if (of_scene_ && now_.camera) {
        PrimEdit camera = camera_edit(*of_scene_, with_pose(*of_scene_, *now_.camera));
        const auto same = std::find_if(edits.begin(), edits.end(),
                                       [&](const PrimEdit& e) { return e.path == camera.path; });
        if (same == edits.end())
            edits.push_back(std::move(camera));
        else
            same->lines.insert(same->lines.end(), camera.lines.begin(), camera.lines.end());
    }
    return save_edits(path, edits);
}

}  // namespace velatura::view
