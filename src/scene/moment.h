// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "scene/camera.h"
#include "scene/ids.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

namespace velatura::scene {

/// An instant at which motion vectors ask where things are.
enum class MomentKind : uint8_t { Frame, NextFrame, PreviousFrame, ShutterOpen, ShutterClose };

/// Primvars of meshes, curves and points that are elsewhere at a moment: what is to be added to
/// their points in shape space, by MomentKind.
inline constexpr std::array<std::string_view, 5> moment_primvars = {
    "velatura:moment:frame", "velatura:moment:next", "velatura:moment:previous",
    "velatura:moment:open", "velatura:moment:close"};

/// Where things are at an instant, beside where the Scene has them when the shutter opens.
struct Moment {
    MomentKind kind = MomentKind::Frame;
    PrimvarId offsets = none;  ///< of moment_primvars; none: no points are elsewhere
    Camera camera;             ///< in the Scene's render space, without motion
    /// Of Scene::instances that are elsewhere, by index: from the prototype to render space.
    std::unordered_map<uint32_t, Mat4d> instances;
    /// Of other shapes that are elsewhere, by prototype (none: placed directly) and index: carries
    /// points, in shape space.
    std::map<std::pair<uint32_t, ShapeId>, Mat4d> shapes;
};

/// The moment of a kind; null where the Scene itself is it.
inline const Moment* find_moment(const std::vector<Moment>& moments, MomentKind kind) {
    for (const Moment& m : moments)
        if (m.kind == kind) return &m;
    return nullptr;
}

}  // namespace velatura::scene
