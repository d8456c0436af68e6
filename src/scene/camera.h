// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "scene/ids.h"

#include <cstdint>
#include <string>
#include <vector>

namespace velatura::scene {

/// A UsdGeomCamera after aperture conforming, in scene units. Camera space: −Z view, +Y up.
struct Camera {
    enum class Projection : uint8_t { Perspective, Orthographic };
    std::string name;  ///< prim path
    Projection projection = Projection::Perspective;
    /// Rotation (and scale, normally 1) from camera space to render space. `translate` puts the
    /// camera into the origin of render space, hence no translation; a camera that was moved since
    /// has one.
    Mat4d render_from_camera;
    /// [key] the same, with translation, at equal steps from when the shutter opens to when it
    /// closes, for a camera that moves meanwhile; it goes straight on between. Two or more, or
    /// none: then render_from_camera holds all the time.
    std::vector<Mat4d> motion_keys;
    /// When the shutter is fully open and when it begins to close, in parts of the time that it is
    /// open at all: light rises from 0 to the one and falls to 0 from the other on.
    double shutter_full = 0, shutter_falling = 1;
    /// Image window for the whole image: at distance 1 for perspective, in scene units for
    /// orthographic.
    double window_left = -1, window_right = 1, window_bottom = -1, window_top = 1;
    double lens_radius = 0;  ///< scene units; 0 = pinhole
    int lens_blades =
        0;  ///< edges of the opening, whose corners are at lens_radius; 0 = a disk, else 3 and up
    double lens_rotation_deg = 0;  ///< of a corner, from right towards up as the camera sees it
    double lens_roundness = 0;  ///< of the edges: 0 = straight, 1 = the circle through the corners
    double focus_distance = 0;  ///< scene units
    double clip_near = 0, clip_far = 0;  ///< along −Z, scene units; far 0 = infinite
    double exposure_scale = 1;           ///< multiplies radiance: 2^exposure
    Vec3d world_position = Vec3d(0.0);   ///< what was subtracted to reach render space
    ProvenanceId provenance = none;
};

}  // namespace velatura::scene
