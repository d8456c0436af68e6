// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "scene/mesh.h"
#include "translate/context/context.h"
#include "translate/geometry/primvars.h"
#include "translate/materials/materials.h"
#include "translate/motion/pose.h"

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace velatura::translate::geometry {

/// Rows of an attribute that has an interpolation (widths, normals), without indices: one for each
/// element.
struct ElementRows {
    std::vector<double> values;  ///< [element][width]
    scene::Interpolation interpolation = scene::Interpolation::Constant;
};

/// `primvars:<name>` before `<name>`; nothing when neither is authored. False and nothing, with a
/// warning that ends in `fallback`, when they do not fit. One row stands for all elements whatever
/// the interpolation says. Rows that do not fit their interpolation are taken by one that they fit,
/// with a warning.
bool read_element_rows(Context& ctx,
                       Prim prim,
                       const std::string& name,
                       int width,
                       const ElementCounts& counts,
                       std::string_view fallback,
                       std::optional<ElementRows>& out);

/// Widths of curves or points. Those that are negative or not finite count as 0. False and nothing,
/// with a warning, when they are of no use.
bool read_widths(Context& ctx,
                 Prim prim,
                 const ElementCounts& counts,
                 std::optional<ElementRows>& out);

/// Where points with a width around them stand.
struct RoundPlacement {
    Mat4d parent_from_points;  ///< in double, before the cast
    Mat4d shape_from_stored;   ///< the identity where balls stay balls
    double width_scale = 1;    ///< of stored widths
};

/// Splits a matrix for points the first of which is given. Similarities go into the points.
/// Nothing, with a warning, where no ball can be seen through the matrix.
std::optional<RoundPlacement> place_round(Context& ctx,
                                          Prim prim,
                                          const Mat4d& matrix,
                                          const Vec3d& first);

/// Whether an affine map leaves something of balls to be met: see geometry::MappedSet.
bool keeps_spheres(const Mat4d& matrix);

/// What both curves and points of a prim have to say, beside their geometry: material, sides,
/// provenance; and in warnings, that light they emit is not sampled, nor widths are of the screen.
scene::Shape round_shape(Context& ctx, Prim prim, const materials::MaterialEntry& material);

/// Shape of a BasisCurves prim; what is wrong of it is left out with a warning. matrix, pose: as
/// for read_mesh.
std::optional<scene::Shape> read_curves(Context& ctx,
                                        Prim prim,
                                        const Mat4d& matrix,
                                        const motion::Pose* pose);

/// The same of a Points prim.
std::optional<scene::Shape> read_point_cloud(Context& ctx,
                                             Prim prim,
                                             const Mat4d& matrix,
                                             const motion::Pose* pose);

}  // namespace velatura::translate::geometry
