// SPDX-License-Identifier: Apache-2.0
#include "geometry/tessellate.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

namespace velatura::geometry {

namespace {

using Triangles = std::vector<std::array<uint32_t, 3>>;

Vec3d newell_normal(std::span<const Vec3> polygon) {
    // Relative to corner 0, so that a polygon far from the origin keeps its digits
    const Vec3d origin(polygon[0]);
    Vec3d n(0.0);
    for (size_t i = 1; i + 1 < polygon.size(); ++i)
        n += (Vec3d(polygon[i]) - origin).cross(Vec3d(polygon[i + 1]) - origin);
    return n;
}

/// The polygon seen along the axis that it faces most, wound counter-clockwise.
std::vector<Vec2d> project(std::span<const Vec3> polygon, const Vec3d& normal) {
    int axis = 0;
    if (std::abs(normal.y) > std::abs(normal[axis])) axis = 1;
    if (std::abs(normal.z) > std::abs(normal[axis])) axis = 2;
    int u = (axis + 1) % 3;
    int v = (axis + 2) % 3;
    if (normal[axis] < 0.0) std::swap(u, v);
    const Vec3d origin(polygon[0]);
    std::vector<Vec2d> flat;
    flat.reserve(polygon.size());
    for (const Vec3& p : polygon) {
        const Vec3d q = Vec3d(p) - origin;
        flat.emplace_back(q[u], q[v]);
    }
    return flat;
}

/// Twice the signed area of a, b, c.
double turn(const Vec2d& a, const Vec2d& b, const Vec2d& c) {
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

bool is_inside(const Vec2d& p, const Vec2d& a, const Vec2d& b, const Vec2d& c) {
    return turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0;
}

/// Linked list of the corners that are left.
struct Ring {
    std::vector<uint32_t> next, previous;

    explicit Ring(size_t n) : next(n), previous(n) {
        for (size_t i = 0; i < n; ++i) {
            next[i] = uint32_t((i + 1) % n);
            previous[i] = uint32_t((i + n - 1) % n);
        }
    }

    void remove(uint32_t i) {
        next[previous[i]] = next[i];
        previous[next[i]] = previous[i];
    }
};

/// Whether cutting the corner off takes away nothing but its own triangle.
bool is_ear(const std::vector<Vec2d>& flat, const Ring& ring, uint32_t corner) {
    const uint32_t before = ring.previous[corner];
    const uint32_t after = ring.next[corner];
    const Vec2d &a = flat[before], &b = flat[corner], &c = flat[after];
    if (turn(a, b, c) <= 0.0) return false;
    for (uint32_t i = ring.next[after]; i != before; i = ring.next[i]) {
        const Vec2d& p = flat[i];
        // Corners at the same place belong to keyhole edges and do not obstruct
        if (p == a || p == b || p == c) continue;
        if (is_inside(p, a, b, c)) return false;
    }
    return true;
}

void clip_ears(const std::vector<Vec2d>& flat, Triangles& out) {
    Ring ring(flat.size());
    size_t left = flat.size();
    uint32_t corner = 0;
    size_t failures = 0;
    while (left > 3) {
        const uint32_t before = ring.previous[corner];
        const uint32_t after = ring.next[corner];
        const bool is_straight = turn(flat[before], flat[corner], flat[after]) == 0.0;
        // After a full round without an ear the polygon crosses itself: cut here all the same. A
        // straight corner goes only then, since it still shapes the triangles of its neighbors.
        if (is_ear(flat, ring, corner) || failures >= left * (is_straight ? 1 : 2)) {
            out.push_back({before, corner, after});
            ring.remove(corner);
            --left;
            failures = 0;
            corner = after;
        } else {
            ++failures;
            corner = after;
        }
    }
    out.push_back({ring.previous[corner], corner, ring.next[corner]});
}

void fan(size_t n, Triangles& out) {
    for (size_t i = 1; i + 1 < n; ++i) out.push_back({0, uint32_t(i), uint32_t(i + 1)});
}

}  // namespace

void triangulate_polygon(std::span<const Vec3> polygon, Triangles& out) {
    const size_t n = polygon.size();
    if (n < 3) return;
    if (n == 3) {
        out.push_back({0, 1, 2});
        return;
    }
    const Vec3d normal = newell_normal(polygon);
    if (normal == Vec3d(0.0)) {
        fan(n, out);
        return;
    }
    const std::vector<Vec2d> flat = project(polygon, normal);
    if (n == 4) {
        const bool is_convex_02 =
            turn(flat[0], flat[1], flat[2]) > 0.0 && turn(flat[2], flat[3], flat[0]) > 0.0;
        const bool is_convex_13 =
            turn(flat[1], flat[2], flat[3]) > 0.0 && turn(flat[3], flat[0], flat[1]) > 0.0;
        const double d02 = (Vec3d(polygon[2]) - Vec3d(polygon[0])).length2();
        const double d13 = (Vec3d(polygon[3]) - Vec3d(polygon[1])).length2();
        if (is_convex_02 && (!is_convex_13 || d02 <= d13)) {
            out.push_back({0, 1, 2});
            out.push_back({0, 2, 3});
            return;
        }
        if (is_convex_13) {
            out.push_back({1, 2, 3});
            out.push_back({1, 3, 0});
            return;
        }
    }
    clip_ears(flat, out);
}

}  // namespace velatura::geometry
