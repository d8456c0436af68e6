// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accumulate/data_layer.h"
#include "camera/camera_model.h"
#include "geometry/surface_point.h"
#include "scene/moment.h"

#include <array>
#include <optional>

namespace velatura::integrator {

struct World;

/// How points move in the image, by Scene::moments: pixels, x right, y up. Both ends of a vector
/// are seen through a pinhole. Nothing where an end lies behind the camera.
class MotionVectors {
  public:
    explicit MotionVectors(const World& world);

    std::optional<Vec2> of_surface(accumulate::DataSource source,
                                   const geometry::SurfacePoint& point) const;

    /// Of something that stays where it is, while the camera moves.
    std::optional<Vec2> of_place(accumulate::DataSource source, const Vec3& p) const;

    /// Of something infinitely far away.
    std::optional<Vec2> of_direction(accumulate::DataSource source, const Vec3& d) const;

  private:
    /// One end of a vector.
    struct End {
        const scene::Moment* moment = nullptr;      ///< null: the scene, as when the shutter opens
        std::optional<camera::CameraModel> camera;  ///< of the moment
    };

    const camera::CameraModel& camera_at(const End& end) const;
    Vec3d place_at(const End& end, const geometry::SurfacePoint& point) const;

    const World& world_;
    std::array<End, 5> ends_;  ///< by MomentKind
};

}  // namespace velatura::integrator
