// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "compositor/look/controls.h"
#include "scene/camera.h"
#include "view/live_render.h"
#include "view/value_edits.h"

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace velatura::view {

/// What was edited of a scene.
struct SceneState {
    std::optional<scene::Camera> camera;  ///< that was moved; none: where the scene has it
    std::string camera_prim;              ///< that is looked through; empty: the render's own
    ValueEdits values;                    ///< of lights and lenses
};

bool is_same_state(const SceneState& a, const SceneState& b);

/// Edits of the scene that a render shows, with undo and redo. It tells the render what differs.
class SceneEditor {
  public:
    /// It must outlive it.
    explicit SceneEditor(LiveRender& render) : render_(render) {}

    /// What the render does now; before edits that depend on it.
    void note(const LiveStatus& status);

    const SceneState& state() const { return now_; }

    /// What is seen, or was asked for; null before the scene is read.
    const scene::Camera* camera() const { return seen_ ? &*seen_ : nullptr; }

    /// The camera as the scene has it, with the edits of its lens.
    const scene::Camera* scene_camera() const { return of_scene_ ? &*of_scene_ : nullptr; }

    /// Changes that follow one another with the same name are one step of undo; one without a name
    /// is a step of its own. is_moving: more follow, and drafts are enough, until seal(). baked:
    /// controls of a look that became edits; undo() gives them back.
    void edit(const std::string& gesture,
              bool is_moving,
              const std::function<void(SceneState&)>& change,
              std::vector<compositor::Control> baked = {});

    void move_camera(const std::string& gesture, bool is_moving, const scene::Camera& camera);

    /// The gesture is over: the image itself is rendered.
    void seal();

    bool can_undo() const { return !undone_from_.empty(); }

    bool can_redo() const { return !redone_from_.empty(); }

    /// Returns: the controls that had been baked; none where there is nothing to undo.
    std::optional<std::vector<compositor::Control>> undo();
    /// Returns: the controls that are baked again.
    std::optional<std::vector<compositor::Control>> redo();

    bool is_changed() const { return !is_same_state(now_, SceneState()); }

    /// As a USD layer of opinions. Errors: those of save_edits.
    Result<void> save(const std::string& path) const;

  private:
    struct Step {
        SceneState state;
        std::vector<compositor::Control> baked;
    };

    void tell(const SceneState& before, bool is_moving);
    std::optional<std::vector<compositor::Control>> step(std::vector<Step>& from,
                                                         std::vector<Step>& to);

    LiveRender& render_;
    SceneState now_;
    std::vector<Step> undone_from_;  ///< before each edit, the newest last
    std::vector<Step> redone_from_;
    std::string gesture_;
    bool is_moving_ = false;
    std::optional<scene::Camera> seen_, of_scene_;
    size_t loads_ = 0;  ///< of the scene, that were noted
};

}  // namespace velatura::view
