// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "geometry/subdivider.h"
#include "scene/camera.h"
#include "scene/mesh.h"

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace velatura::geometry {

/// How finely limit surfaces are cut.
struct DicingOptions {
    double rate = 1.0;              ///< pixels that the edge of a triangle in the image may cover
    std::optional<int> level = {};  ///< instead: every edge into 2^level pieces
    /// All surfaces together; above that the whole scene is cut more coarsely.
    uint64_t max_triangles = 50'000'000;
};

/// How large things are in the image. Points and boxes in render space.
class DicingView {
  public:
    /// Size of the whole image in pixels.
    DicingView(const scene::Camera& camera, int width, int height);

    /// Pixels per unit of length at p, however the length lies: what is seen from the side now may
    /// be an outline. Infinite at the camera.
    double density(const Vec3d& p) const;

    /// Whether any of the box may lie in the image, or in a margin of 5 % around it. May say so
    /// of a box that does not.
    bool can_show(const Box3d& box) const;

  private:
    Mat4d camera_from_render_;
    bool is_perspective_;
    double pixels_per_unit_;  ///< at distance 1, for perspective
    double left_, right_, bottom_, top_;
};

/// Edges that no image shows directly are this many times as long.
inline constexpr double unseen_factor = 8.0;

/// So are those of surfaces that light is sampled from, triangle by triangle.
inline constexpr double light_factor = 4.0;

/// Pieces of one edge at most.
inline constexpr uint32_t max_pieces = 4096;

/// [edge] how many pieces edges get, so that none covers more than `rate` pixels. A function of the
/// edge and of what lies beside it, thus the same for both faces of it. render_from_shape: where
/// the surface stands for the image. most: pieces of one edge at most.
std::vector<uint32_t> edge_rates(const scene::Mesh& mesh,
                                 const LimitSurface& surface,
                                 const DicingView& view,
                                 const Mat4d& render_from_shape,
                                 double rate,
                                 uint32_t max = max_pieces);

/// About how many triangles LimitSurface::dice makes of a face with these edges. rates: [edge].
uint64_t estimated_triangles(scene::SubdivisionScheme scheme,
                             std::span<const uint32_t> edges,
                             std::span<const uint32_t> rates);

/// About how many triangles it makes of all faces.
uint64_t estimated_triangles(const scene::Mesh& mesh,
                             const LimitSurface& surface,
                             std::span<const uint32_t> rates);

}  // namespace velatura::geometry
