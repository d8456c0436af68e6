// SPDX-License-Identifier: Apache-2.0
#include "camera/camera_model.h"

#include "base/check.h"
#include "sampling/warp.h"

#include <algorithm>
#include <cmath>

namespace velatura::camera {
namespace {

/// Camera space (x right, y up, −z view) to NDC with division by w; z in [0, 1] between the planes.
Mat4d ndc_from_camera(const scene::Camera& c) {
    const double sx = 1.0 / (c.window_right - c.window_left);
    const double sy = 1.0 / (c.window_top - c.window_bottom);
    const double near = c.clip_near;
    const bool has_far = c.clip_far > near && std::isfinite(c.clip_far);
    const double range = has_far ? c.clip_far - near : 0.0;
    Mat4d m;
    m.makeIdentity();
    if (c.projection == scene::Camera::Projection::Orthographic) {
        m[0][0] = sx;
        m[3][0] = -c.window_left * sx;
        m[1][1] = -sy;
        m[3][1] = c.window_top * sy;
        m[2][2] = has_far ? -1.0 / range : -1.0;
        m[3][2] = has_far ? -near / range : -near;
        return m;
    }
    // w = −z; x_ndc = (x/w − left)·sx, y_ndc = (top − y/w)·sy
    m[0][0] = sx;
    m[2][0] = c.window_left * sx;
    m[1][1] = -sy;
    m[2][1] = -c.window_top * sy;
    m[2][2] = has_far ? -c.clip_far / range : -1.0;
    m[3][2] = has_far ? -c.clip_far * near / range : -near;
    m[2][3] = -1.0;
    m[3][3] = 0.0;
    return m;
}

}  // namespace

CameraModel::CameraModel(const scene::Camera& camera, int width, int height)
    : is_orthographic_(camera.projection == scene::Camera::Projection::Orthographic),
      render_from_camera_(camera.render_from_camera),
      camera_from_render_(camera.render_from_camera.inverse()),
      keys_(camera.motion_keys.size() > 1 ? camera.motion_keys : std::vector<Mat4d>()),
      left_(camera.window_left),
      top_(camera.window_top),
      dx_((camera.window_right - camera.window_left) / double(width)),
      dy_((camera.window_top - camera.window_bottom) / double(height)),
      lens_radius_(0.0),
      focus_distance_(camera.focus_distance),
      clip_near_(camera.clip_near),
      clip_far_(std::numeric_limits<double>::infinity()),
      shutter_(camera.shutter_full, camera.shutter_falling),
      exposure_scale_(float(camera.exposure_scale)) {
    VELATURA_CHECK(width >= 1 && height >= 1, "an image has at least one pixel");
    // A lens focused at its own plane forms no image: pinhole
    if (camera.lens_radius > 0.0 && camera.focus_distance > 0.0) lens_radius_ = camera.lens_radius;
    if (camera.lens_blades > 0)
        aperture_.emplace(camera.lens_blades, camera.lens_rotation_deg, camera.lens_roundness);
    if (!is_orthographic_) clip_near_ = std::max(clip_near_, 0.0);
    if (camera.clip_far > clip_near_) clip_far_ = camera.clip_far;

    const Vec3d axis = transform_direction(Vec3d(0.0, 0.0, -1.0), render_from_camera_);
    scale_ = std::sqrt(axis.dot(axis));
    view_direction_ = to_float(normalize(axis));
    eye_ = to_float(transform_point(Vec3d(0.0), render_from_camera_));
    pixel_ = std::sqrt(std::abs(dx_ * dy_)) * scale_;

    Mat4d world_from_camera = render_from_camera_;
    for (int i = 0; i < 3; ++i) world_from_camera[3][i] += camera.world_position[i];
    const Mat4d camera_from_world = world_from_camera.inverse();
    Mat4d flip_z;
    flip_z.makeIdentity();
    flip_z[2][2] = -1.0;
    world_to_camera_ = camera_from_world * flip_z;
    world_to_ndc_ = camera_from_world * ndc_from_camera(camera);
}

Mat4d CameraModel::render_from_camera(float time) const {
    const size_t segments = keys_.size() - 1;
    // Written so that NaN is 0
    const double at = std::min(std::max(0.0, double(time)), 1.0) * double(segments);
    const size_t segment = std::min(size_t(at), segments - 1);
    const double f = at - double(segment);
    return keys_[segment] * (1.0 - f) + keys_[segment + 1] * f;
}

Vec3d CameraModel::lens_point(const Vec2& u_lens) const {
    Vec2d disk = sampling::concentric_disk(Vec2d(u_lens));
    if (aperture_) disk = aperture_->from_disk(disk);
    return {disk.x * lens_radius_, disk.y * lens_radius_, 0.0};
}

CameraRay CameraModel::generate_ray(const Vec2& film_point, const Vec2& u_lens, float time) const {
    const double wx = left_ + double(film_point.x) * dx_;
    const double wy = top_ - double(film_point.y) * dy_;

    // Camera space: start at `from`, move by `step` per unit of depth
    Vec3d from = is_orthographic_ ? Vec3d(wx, wy, 0.0) : Vec3d(0.0);
    Vec3d step = is_orthographic_ ? Vec3d(0.0, 0.0, -1.0) : Vec3d(wx, wy, -1.0);
    if (lens_radius_ > 0.0) {
        const Vec3d lens = lens_point(u_lens);
        // Every ray of a film point meets the others in the plane of focus; at infinite focus they
        // are parallel
        if (std::isfinite(focus_distance_)) step -= lens / focus_distance_;
        from += lens;
    }

    const bool is_still = keys_.empty();
    const Mat4d& matrix = is_still ? render_from_camera_ : render_from_camera(time);
    const Vec3d direction = transform_direction(step, matrix);
    const double length = std::sqrt(direction.dot(direction));
    CameraRay ray;
    ray.o = to_float(transform_point(from + step * clip_near_, matrix));
    ray.d = to_float(direction * (1.0 / length));
    ray.t_max = float((clip_far_ - clip_near_) * length);

    // A pixel is dx·dy at depth 1; depth grows by 1/length per unit of t
    ray.cone_width = float(is_orthographic_ ? pixel_ : pixel_ * clip_near_);
    ray.cone_spread = is_orthographic_ ? 0.0f : float(pixel_ / length);
    return ray;
}

std::optional<CameraConnection> CameraModel::connect(const Vec3& p,
                                                     const Vec2& u_lens,
                                                     float time) const {
    const Mat4d matrix = keys_.empty() ? render_from_camera_ : render_from_camera(time);
    const Vec3d at = transform_point(Vec3d(p), matrix.inverse());
    const double depth = -at.z;
    if (!(depth > clip_near_ && depth > 0.0 && depth < clip_far_)) return std::nullopt;

    // Camera space: the ray goes from `from` by `step` per unit of depth, see generate_ray()
    const Vec3d lens = lens_radius_ > 0.0 ? lens_point(u_lens) : Vec3d(0.0);
    const Vec3d tilt =
        lens_radius_ > 0.0 && std::isfinite(focus_distance_) ? lens / focus_distance_ : Vec3d(0.0);
    Vec3d from = lens, step(0.0, 0.0, -1.0);
    double wx, wy;
    if (is_orthographic_) {
        wx = at.x - lens.x + tilt.x * depth;
        wy = at.y - lens.y + tilt.y * depth;
        from += Vec3d(wx, wy, 0.0);
    } else {
        wx = (at.x - lens.x) / depth + tilt.x;
        wy = (at.y - lens.y) / depth + tilt.y;
        step += Vec3d(wx, wy, 0.0);
    }
    step -= tilt;

    CameraConnection out;
    out.film_point = Vec2(float((wx - left_) / dx_), float((top_ - wy) / dy_));
    out.o = to_float(transform_point(from + step * clip_near_, matrix));
    const Vec3d direction = transform_direction(step, matrix);
    const double length = std::sqrt(direction.dot(direction));
    const Vec3d to_camera = Vec3d(out.o) - Vec3d(p);
    out.distance = float(to_camera.length());
    if (!(out.distance > 0.0f && length > 0.0)) return std::nullopt;
    out.wi = to_float(direction * (-1.0 / length));
    // A pixel moves the point by dx·dy, at depth 1 or everywhere, in a plane that the ray crosses
    // at an angle
    const double per_unit = length / (std::abs(determinant3(matrix)) * std::abs(dx_ * dy_));
    out.film_per_area = float(is_orthographic_ ? per_unit : per_unit / (depth * depth));
    out.cone_width = float(is_orthographic_ ? pixel_ : pixel_ * depth);
    return out;
}

Vec3d CameraModel::to_camera(const Vec3d& p) const {
    return transform_point(p, camera_from_render_);
}

Vec3d CameraModel::normal_to_camera(const Vec3d& n) const {
    Vec3d out;
    for (int i = 0; i < 3; ++i)
        out[i] = n.x * render_from_camera_[i][0] + n.y * render_from_camera_[i][1] +
                 n.z * render_from_camera_[i][2];
    return out.normalized();
}

Vec2d CameraModel::film_point(double wx, double wy) const {
    return {(wx - left_) / dx_, (top_ - wy) / dy_};
}

std::optional<Vec2d> CameraModel::project(const Vec3d& p) const {
    const Vec3d at = to_camera(p);
    if (is_orthographic_) return film_point(at.x, at.y);
    if (!(at.z < 0.0)) return std::nullopt;
    return film_point(at.x / -at.z, at.y / -at.z);
}

std::optional<Vec2d> CameraModel::project_direction(const Vec3d& d) const {
    const Vec3d at = transform_direction(d, camera_from_render_);
    if (is_orthographic_ || !(at.z < 0.0)) return std::nullopt;
    return film_point(at.x / -at.z, at.y / -at.z);
}

float CameraModel::footprint(const Vec3& p) const {
    const Vec3 away = p - eye_;
    return float(is_orthographic_ ? pixel_ : pixel_ / scale_ * double(away.length()));
}

}  // namespace velatura::camera
