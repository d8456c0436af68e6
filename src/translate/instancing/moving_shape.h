// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "translate/context/instance_source.h"

#include <functional>
#include <optional>

namespace velatura::translate::instancing {

/// The shape of a prim under a matrix into the space of what holds it.
using ShapeReader = std::function<std::optional<scene::Shape>(const Mat4d& matrix)>;

/// A prim as place_moving_shape() takes it.
struct MovingPrim {
    const ShapeReader& read;
    bool is_light = false;  ///< by UsdLux LightAPI
};

/// Puts a prim that is no mesh, and is carried while the shutter is open, into what holds it, as an
/// instance of itself; its shape stays as it is at the frame's instant, which is named where it
/// would not. False: it stays, or must. Args: matrix of the prim, before the holder's origin is
/// subtracted; a point near its geometry, in
///       its own space.
bool place_moving_shape(Context& ctx,
                        Prim prim,
                        const Mat4d& matrix,
                        const Vec3d& near,
                        const MovingPrim& moving,
                        InstanceSource& parent);

}  // namespace velatura::translate::instancing
