// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "camera/aperture.h"
#include "camera/shutter_curve.h"
#include "scene/camera.h"

#include <limits>
#include <optional>
#include <vector>

namespace velatura::camera {

/// A ray from the lens into the scene, render space. It starts on the near clipping plane (at the
/// lens when the camera has none) and ends on the far one: visible points are o + t·d, 0 < t <
/// t_max.
struct CameraRay {
    Vec3 o;
    Vec3 d;  ///< unit
    float t_max = std::numeric_limits<float>::infinity();
    /// Width of the pixel's footprint at distance t: cone_width + cone_spread · t, scene units, for
    /// texture filtering.
    float cone_width = 0;
    float cone_spread = 0;
};

/// How the camera sees a point of the scene through one point of its lens.
struct CameraConnection {
    Vec2 film_point;     ///< pixels, as in generate_ray()
    Vec3 o;              ///< render space: where the ray of that film point begins
    Vec3 wi;             ///< unit, from the point of the scene toward o
    float distance = 0;  ///< between the two
    /// Area on the film [pixels²] over area at the point, perpendicular to wi [scene unit²].
    float film_per_area = 0;
    float cone_width = 0;  ///< of the ray at the point, see CameraRay
};

/// Rays of a camera over an image of width × height pixels. Immutable; all arithmetic inside is
/// double, scale by a power of two gives bit-identical directions and exactly scaled origins.
class CameraModel {
  public:
    /// Args: camera as `translate` conformed it; width, height of the whole image (not of a
    /// crop), >= 1.
    CameraModel(const scene::Camera& camera, int width, int height);

    /// The ray through a film point.
    /// Args: film_point in pixels, x right, y down, (0,0) = upper left corner, pixel centers at .5;
    /// may lie outside
    ///       the image. u_lens in [0,1)², unused by a pinhole. time: 0 as the shutter opens, 1 as
    ///       it closes; of no consequence where the camera does not move.
    CameraRay generate_ray(const Vec2& film_point, const Vec2& u_lens, float time = 0.0f) const;

    /// The inverse of generate_ray(): the film point whose ray meets p [render space].
    /// Args:    u_lens, time: as there.
    /// Returns: nullopt when p is behind the near plane or beyond the far one.
    /// Ref:     Veach 1997, section 8.3.2 (importance emitted by a camera).
    std::optional<CameraConnection> connect(const Vec3& p, const Vec2& u_lens, float time) const;

    /// Width that the footprint of a pixel has about a distance from the camera [scene unit].
    float footprint(const Vec3& p) const;

    /// When a ray is: as often as the shutter lets light through then. u in [0, 1).
    float shutter_time(float u) const { return shutter_.time(u); }

    /// Whether time matters.
    bool has_motion() const { return !keys_.empty(); }

    /// Whether u_lens matters: lens radius and focus distance both > 0.
    bool has_lens() const { return lens_radius_ > 0.0; }

    /// Of a point of render space, along the viewing direction (−Z of the camera).
    float depth(const Vec3& p) const { return (p - eye_).dot(view_direction_); }

    /// A point of render space in camera space (x right, y up, −z along the view), as when the
    /// camera does not move.
    Vec3d to_camera(const Vec3d& p) const;

    /// A normal (covector) of render space in camera space, unit.
    Vec3d normal_to_camera(const Vec3d& n) const;

    /// The film point [pixels] at which a pinhole in place of the lens sees a point, or the point
    /// at infinity in a direction; nullopt behind the camera.
    std::optional<Vec2d> project(const Vec3d& p) const;
    std::optional<Vec2d> project_direction(const Vec3d& d) const;

    /// 2^exposure: multiplies radiance.
    float exposure_scale() const { return exposure_scale_; }

    /// World to camera space in the convention of the EXR attribute `worldToCamera`: left-handed, x
    /// right, y up, z the viewing direction; row vectors.
    Mat4d world_to_camera() const { return world_to_camera_; }

    /// World to NDC in the convention of the EXR attribute `worldToNDC`: after division by w, (0,0)
    /// is the upper left and (1,1) the lower right corner of the image; z is 0 on the near plane
    /// and 1 on the far plane (1 at infinity).
    Mat4d world_to_ndc() const { return world_to_ndc_; }

  private:
    Mat4d render_from_camera(float time) const;
    Vec3d lens_point(const Vec2& u_lens) const;
    Vec2d film_point(double wx, double wy) const;

    bool is_orthographic_;
    Mat4d render_from_camera_, camera_from_render_;
    std::vector<Mat4d> keys_;      // of its motion; empty = none
    double left_, top_, dx_, dy_;  // window: corner and size of a pixel
    double lens_radius_, focus_distance_, clip_near_, clip_far_;
    std::optional<Aperture> aperture_;  // nothing: a disk
    ShutterCurve shutter_;
    double scale_;  // length in render space of one unit along −Z
    double pixel_;  // edge of a pixel at depth 1, render space
    float exposure_scale_;
    Vec3 view_direction_, eye_;
    Mat4d world_to_camera_, world_to_ndc_;
};

}  // namespace velatura::camera
