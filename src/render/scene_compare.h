// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "scene/scene.h"

namespace velatura::render {

// Whether parts of scenes are the same, numbers bit by bit: NaN is NaN, and 0 is not −0. Files are
// compared by name.

bool is_same(const scene::Shape& a, const scene::Shape& b);
bool is_same(const scene::Instance& a, const scene::Instance& b);
bool is_same(const scene::Material& a, const scene::Material& b);
bool is_same(const scene::Light& a, const scene::Light& b);
bool is_same(const scene::Camera& a, const scene::Camera& b);

/// The first part that differs of what the edits of a Renderer cannot change: "textures",
/// "number of shapes", …; null when there is none.
const char* fixed_difference(const scene::Scene& a, const scene::Scene& b);

}  // namespace velatura::render
