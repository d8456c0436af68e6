// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "render/renderer.h"
#include "scene/scene.h"

#include <cstddef>
#include <string>

namespace velatura::render {

/// How update() treats what is a matter of choice.
struct UpdateOptions {
    /// Diced meshes keep the rates of the first camera when the camera or the size changes, as with
    /// Renderer::set_camera(); else the scene is replaced, and they are diced anew.
    bool keeps_dicing = false;
};

/// What update() did.
struct UpdateReport {
    bool is_replaced = false;  ///< the whole scene; `why` says what called for it
    std::string why;
    bool camera = false;                                          ///< edited, or the size
    size_t lights = 0, materials = 0, instances = 0, shapes = 0;  ///< edited

    /// The film is kept.
    bool is_unchanged() const {
        return !is_replaced && !camera && lights + materials + instances + shapes == 0;
    }

    /// One line, "2 materials, 1 light edited".
    std::string text() const;
};

/// Turns the scene that a Renderer renders into another one, such as a later translation of an
/// edited stage, by the edits in which they differ. Replaces the scene where edits do not lead
/// there: prims were added or removed, textures, links or light groups have changed. After
/// prepare() the renderer gives the bits of a new Renderer of the scene. Places in files, and
/// EffectNotes, are not compared.
/// Args: renderer: owns its scene, and nothing of it is hidden by set_..._visible().
UpdateReport update(Renderer& renderer, scene::Scene&& scene, const UpdateOptions& options = {});

/// A camera in the render space of another origin.
scene::Camera rebased(const scene::Camera& camera, const Vec3d& origin);

}  // namespace velatura::render
