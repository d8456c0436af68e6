// SPDX-License-Identifier: Apache-2.0
#include "geometry/dicing.h"

#include <algorithm>
#include <cmath>

namespace velatura::geometry {

namespace {

/// A face with what surrounds it, about: its corners and edges in the limit, widened.
Box3d face_box(const scene::Mesh& mesh,
               size_t first,
               size_t count,
               const LimitSurface& surface,
               const Mat4d& render_from_shape) {
    Box3d box;
    for (size_t i = first; i < first + count; ++i) {
        const Vec3d p(mesh.points[mesh.face_vertex_indices[i]]);
        box.extendBy(transform_point(p, render_from_shape));
        for (const Vec3& q : surface.edge_points()[surface.edge_of_corner()[i]])
            if (is_finite(q)) box.extendBy(transform_point(Vec3d(q), render_from_shape));
    }
    const Vec3d margin = (box.max - box.min) * 0.25;
    return {box.min - margin, box.max + margin};
}

/// [edge] whether a face at it may be in the image.
std::vector<uint8_t> shown_edges(const scene::Mesh& mesh,
                                 const LimitSurface& surface,
                                 const DicingView& view,
                                 const Mat4d& render_from_shape) {
    std::vector<uint8_t> is_shown(surface.edge_count(), 0);
    const std::span<const uint32_t> edges = surface.edge_of_corner();
    size_t first = 0;
    for (size_t f = 0; f < mesh.face_vertex_counts.size(); ++f) {
        const size_t count = mesh.face_vertex_counts[f];
        const bool is_candidate = surface.has_face()[f] != 0;
        if (is_candidate &&
            view.can_show(face_box(mesh, first, count, surface, render_from_shape))) {
            for (size_t i = first; i < first + count; ++i) is_shown[edges[i]] = 1;
        }
        first += count;
    }
    return is_shown;
}

}  // namespace

DicingView::DicingView(const scene::Camera& camera, int width, int height)
    : camera_from_render_(camera.render_from_camera.inverse()),
      is_perspective_(camera.projection == scene::Camera::Projection::Perspective),
      pixels_per_unit_(std::max(width / (camera.window_right - camera.window_left),
                                height / (camera.window_top - camera.window_bottom))) {
    const double margin_x = 0.05 * (camera.window_right - camera.window_left);
    const double margin_y = 0.05 * (camera.window_top - camera.window_bottom);
    left_ = camera.window_left - margin_x;
    right_ = camera.window_right + margin_x;
    bottom_ = camera.window_bottom - margin_y;
    top_ = camera.window_top + margin_y;
}

double DicingView::density(const Vec3d& p) const {
    if (!is_perspective_) return pixels_per_unit_;
    // Depth where the image looks; beside and behind it there is none, but a distance
    const Vec3d c = transform_point(p, camera_from_render_);
    const double distance = std::max(-c.z, 0.5 * std::sqrt(c.dot(c)));
    return pixels_per_unit_ / distance;
}

bool DicingView::can_show(const Box3d& box) const {
    // Out of the image where all corners are on the wrong side of one border
    int beyond[5] = {};
    for (int i = 0; i < 8; ++i) {
        const Vec3d p(i & 1 ? box.max.x : box.min.x, i & 2 ? box.max.y : box.min.y,
                      i & 4 ? box.max.z : box.min.z);
        const Vec3d c = transform_point(p, camera_from_render_);
        const double scale = is_perspective_ ? -c.z : 1.0;
        beyond[0] += c.x < left_ * scale;
        beyond[1] += c.x > right_ * scale;
        beyond[2] += c.y < bottom_ * scale;
        beyond[3] += c.y > top_ * scale;
        beyond[4] += c.z > 0.0;
    }
    return std::none_of(std::begin(beyond), std::end(beyond), [](int n) { return n == 8; });
}

std::vector<uint32_t> edge_rates(const scene::Mesh& mesh,
                                 const LimitSurface& surface,
                                 const DicingView& view,
                                 const Mat4d& render_from_shape,
                                 double rate,
                                 uint32_t max) {
    const std::vector<uint8_t> is_shown = shown_edges(mesh, surface, view, render_from_shape);
    std::vector<uint32_t> rates(surface.edge_count(), 1);
    for (size_t e = 0; e < rates.size(); ++e) {
        Vec3d p[3];
        for (size_t k = 0; k < 3; ++k)
            p[k] = transform_point(Vec3d(surface.edge_points()[e][k]), render_from_shape);
        double pixels = 0;
        for (size_t k = 0; k < 2; ++k) {
            const double nearest = std::max(view.density(p[k]), view.density(p[k + 1]));
            pixels += (p[k + 1] - p[k]).length() * nearest;
        }
        const double pieces = std::ceil(pixels / (is_shown[e] ? rate : rate * unseen_factor));
        // What is not a number, for want of a face, stays one piece
        if (pieces > 1.0) rates[e] = uint32_t(std::min(pieces, double(max)));
    }
    return rates;
}

uint64_t estimated_triangles(scene::SubdivisionScheme scheme,
                             std::span<const uint32_t> edges,
                             std::span<const uint32_t> rates) {
    const auto rate = [&](size_t i) { return uint64_t(rates[edges[i]]); };
    const size_t count = edges.size();
    uint64_t max = 0;
    for (size_t i = 0; i < count; ++i) max = std::max(max, rate(i));
    if (scheme == scene::SubdivisionScheme::Loop) return max * max;
    if (count == 4) return (rate(0) + rate(2)) * (rate(1) + rate(3)) / 2;
    return std::max<uint64_t>(count * max * max / 2, count - 2);
}

uint64_t estimated_triangles(const scene::Mesh& mesh,
                             const LimitSurface& surface,
                             std::span<const uint32_t> rates) {
    const std::span<const uint32_t> edges = surface.edge_of_corner();
    uint64_t total = 0;
    size_t first = 0;
    for (size_t f = 0; f < mesh.face_vertex_counts.size(); ++f) {
        const size_t count = mesh.face_vertex_counts[f];
        if (surface.has_face()[f])
            total += estimated_triangles(mesh.subdivision, edges.subspan(first, count), rates);
        first += count;
    }
    return total;
}

}  // namespace velatura::geometry
