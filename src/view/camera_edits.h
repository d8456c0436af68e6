// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "scene/camera.h"

#include <string>

namespace velatura::view {

/// Whether both see the same image.
bool is_same_camera(const scene::Camera& a, const scene::Camera& b);

/// A USD layer (.usda) of opinions over the scene's camera prim: its transform in world space and
/// its focus distance; of an orthographic camera its apertures as well. A scene without a camera
/// gets one that frames it: /view_camera.
std::string camera_edit(const scene::Camera& of_scene, const scene::Camera& edited);

/// Writes it. Errors: "bad-output" (not .usda), those of write_file_atomically.
Result<void> save_camera_edit(const std::string& path,
                              const scene::Camera& of_scene,
                              const scene::Camera& edited);

}  // namespace velatura::view
