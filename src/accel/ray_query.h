// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace velatura::accel {

/// Coordinates at or above this count as infinite, so that differences of two never overflow.
inline constexpr float coordinate_limit = 0x1p126f;

/// A ray made ready for one tree: an exact part in double, which decides what is hit, and a
/// conservative part in float, which only says where to look. The direction is scaled by a power of
/// two so that its largest component lies in [1, 2); t below is that of the scaled ray.
struct QueryRay {
    double permuted_origin[3];            ///< components kx, ky, kz
    double shear_x, shear_y, inverse_z;   ///< d[kx]/d[kz], d[ky]/d[kz], 1/d[kz]
    double t_from_scaled, scaled_from_t;  ///< exact powers of two
    uint32_t kx, ky, kz;                  ///< kz: axis of the largest component of d

    /// Slab test: t = (bound − origin)·inverse, with origins moved outward by the bound of all
    /// errors and inverses widened. Every operation is monotonic, so the interval of a box contains
    /// that of any box inside it, exactly. Ref: Ize 2013, "Robust BVH Ray Traversal", JCGT 2(2).
    /// Element 3 of each has no meaning.
    alignas(16) float near_origin[4], far_origin[4];
    alignas(16) float near_inverse[4], far_inverse[4];
    alignas(16) int32_t near_row[4], far_row[4];  ///< rows of WideNode::bounds

    float filter_origin[3];  ///< origin rounded; components kx, ky, kz
    float filter_shear_x, filter_shear_y;
    float filter_inverse_z;
    float filter_error;     ///< bound of the errors of sheared coordinates in floats, four times
    float filter_error_2;   ///< its square; infinite where the filter must decide nothing
    float filter_t_margin;  ///< bound of the errors of scaled t in floats that are not relative
};

/// What rounding may do to a ray before a query sees it.
struct QuerySlack {
    float inverse = 0x1p-21f;  ///< relative widening of slab distances
    double origin = 0x1p-48;   ///< origin error in multiples of the largest distance to the bounds
};

/// A box that is not empty, in double; the elements 3 are zero.
struct alignas(32) QueryBounds {
    double lower[4] = {}, upper[4] = {};
    float lower_float[4] = {}, upper_float[4] = {};

    QueryBounds() = default;

    explicit QueryBounds(const Box3& box)
        : lower{double(box.min.x), double(box.min.y), double(box.min.z), 0},
          upper{double(box.max.x), double(box.max.y), double(box.max.z), 0},
          lower_float{box.min.x, box.min.y, box.min.z, 0},
          upper_float{box.max.x, box.max.y, box.max.z, 0} {}
};

/// A hit before shape and triangle are told apart. t as the caller of the accelerator counts it.
struct TriangleHit {
    float t = 0, b1 = 0, b2 = 0;
    bool is_leaving = false;  ///< the corners run clockwise as seen from the ray's origin
};

/// Interval of scaled t in which the ray may be inside the box given by lower x, y, z and upper
/// x, y, z. The same arithmetic as the SIMD kernels. False when it is empty.
inline bool clip_to_box(const QueryRay& q, const float bounds[6], float& t_near, float& t_far) {
    const float nx = (bounds[q.near_row[0]] - q.near_origin[0]) * q.near_inverse[0];
    const float ny = (bounds[q.near_row[1]] - q.near_origin[1]) * q.near_inverse[1];
    const float nz = (bounds[q.near_row[2]] - q.near_origin[2]) * q.near_inverse[2];
    const float fx = (bounds[q.far_row[0]] - q.far_origin[0]) * q.far_inverse[0];
    const float fy = (bounds[q.far_row[1]] - q.far_origin[1]) * q.far_inverse[1];
    const float fz = (bounds[q.far_row[2]] - q.far_origin[2]) * q.far_inverse[2];
    t_near = std::max(std::max(nx, ny), std::max(nz, 0.0f));
    t_far = std::min(std::min(fx, fy), fz);
    return t_near <= t_far;
}

/// How far the box of a part of a triangle reaches beyond it, in largest edges of the triangle's
/// box: more than the point of a hit may err (see hit_triangle).
inline constexpr float split_margin = 0x1p-12f;

/// The definition of a hit, on both sides, edges and vertices included: shear test in double with
/// t kept inside the interval of the triangle's own box. Edge functions are differences of two
/// separately rounded products, whose sign is never wrong, and depend only on the edge's vertices
/// up to their sign; thus rays cannot pass between triangles that share vertices. For the same
/// reason that clip_to_box is monotonic, a tree that skips boxes entered behind the best t finds
/// exactly what testing every triangle finds.
/// A tree may also hold parts of a triangle, each with a box of its own. The computed point is, but
/// for the rounding of the weights u, v, w, that of a triangle whose corners are moved by less than
/// the outward shift of the ray's origin; the error that the weights add, 2^-47·(largest edge)²/det
/// largest edges, is below split_margin/4 unless the triangle is seen edge-on or has no area to
/// speak of. Those are hit at the end of the interval of their own box, where the ray has met every
/// part that it meets. Ref: Woop, Benthin, Wald 2013, "Watertight Ray/Triangle Intersection", JCGT
/// 2(1). Returns: whether 0 < t < infinity; the caller compares t with its bound.
[[gnu::always_inline]] inline bool hit_triangle(const QueryRay& q,
                                                const float* v0,
                                                const float* v1,
                                                const float* v2,
                                                size_t stride,
                                                TriangleHit& hit) {
    const size_t x = q.kx * stride, y = q.ky * stride, z = q.kz * stride;
    const double az = double(v0[z]) - q.permuted_origin[2];
    const double bz = double(v1[z]) - q.permuted_origin[2];
    const double cz = double(v2[z]) - q.permuted_origin[2];
    const double ax = (double(v0[x]) - q.permuted_origin[0]) - q.shear_x * az;
    const double ay = (double(v0[y]) - q.permuted_origin[1]) - q.shear_y * az;
    const double bx = (double(v1[x]) - q.permuted_origin[0]) - q.shear_x * bz;
    const double by = (double(v1[y]) - q.permuted_origin[1]) - q.shear_y * bz;
    const double cx = (double(v2[x]) - q.permuted_origin[0]) - q.shear_x * cz;
    const double cy = (double(v2[y]) - q.permuted_origin[1]) - q.shear_y * cz;
    const double u = cx * by - cy * bx;
    const double v = ax * cy - ay * cx;
    const double w = bx * ay - by * ax;
    if ((u < 0 || v < 0 || w < 0) && (u > 0 || v > 0 || w > 0)) return false;
    const double det = u + v + w;
    if (det == 0) return false;
    const double inverse_det = 1.0 / det;
    double t = (u * az + v * bz + w * cz) * q.inverse_z * inverse_det;
    // Keep t inside the own box
    if (!(t > 0)) return false;
    float bounds[6];
    for (size_t k = 0; k < 3; ++k) {
        const size_t i = k * stride;
        bounds[k] = std::min(v0[i], std::min(v1[i], v2[i]));
        bounds[k + 3] = std::max(v0[i], std::max(v1[i], v2[i]));
    }
    float t_near = 0, t_far = 0;
    if (!clip_to_box(q, bounds, t_near, t_far)) return false;
    t = std::min(std::max(t, double(t_near)), double(t_far));
    const auto edge = double(
        std::max(bounds[3] - bounds[0], std::max(bounds[4] - bounds[1], bounds[5] - bounds[2])));
    if (std::abs(det) < 0x1p-32 * edge * edge) t = double(t_far);
    hit.t = float(t * q.t_from_scaled);
    hit.b1 = float(v * inverse_det);
    hit.b2 = float(w * inverse_det);
    hit.is_leaving = det * q.inverse_z < 0;
    return hit.t > 0.0f && hit.t < std::numeric_limits<float>::infinity();
}

/// Whether all coordinates are finite and not too large.
bool is_usable(const Vec3& p);

/// Whether the builder drops the triangle: no area, or a corner that is not usable.
/// A triangle that moves is not there in segments of its motion at whose beginning or end a corner
/// is not usable. Else it is, at each time, the triangle of its corners where geometry::moved
/// (geometry/motion.h) puts them, in floats, and not there at times at which that is degenerate.
/// Rays are made ready for all of these together, by the box of the corners at the keys of all
/// segments that they are there in. Since neighbors share what the vertices that they share
/// become, nothing slips through between them at any time.
bool is_degenerate(const Vec3& a, const Vec3& b, const Vec3& c);

}  // namespace velatura::accel
