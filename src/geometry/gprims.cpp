// SPDX-License-Identifier: Apache-2.0
#include "geometry/gprims.h"

#include <array>
#include <cmath>
#include <utility>
#include <vector>

namespace velatura::geometry {

namespace {

/// cos and sin of i/n turns, exact in the eight symmetric directions, so that closed rings are
/// closed bit for bit.
std::vector<Vec2d> unit_circle(int n) {
    std::vector<Vec2d> circle(static_cast<size_t>(n));
    for (int i = 0; i < n; ++i) {
        const int quarter = (4 * i) / n;
        const double angle = (2.0 * pi_d * i) / n - quarter * (pi_d / 2);
        const double c = std::cos(angle), s = 4 * i == quarter * n ? 0.0 : std::sin(angle);
        const Vec2d turned[4] = {{c, s}, {-s, c}, {-c, -s}, {s, -c}};
        circle[size_t(i)] = turned[quarter % 4];
    }
    return circle;
}

/// Collects vertices in gprim space and writes them in shape space.
class Builder {
  public:
    Builder(const Mat4d& shape_from_gprim, int segments)
        : shape_from_gprim_(shape_from_gprim),
          normal_matrix_(cofactor_matrix(shape_from_gprim)),
          sign_(determinant3(shape_from_gprim) < 0.0 ? -1.0 : 1.0),
          circle_(unit_circle(segments)) {}

    uint32_t vertex(const Vec3d& p, const Vec3d& n) {
        const Vec3d q = transform_point(p, shape_from_gprim_);
        const Vec3d m = (n * normal_matrix_) * sign_;
        const double length = m.length();
        data_.positions.emplace_back(float(q.x), float(q.y), float(q.z));
        // A gprim pressed flat along an axis loses some normals; the geometric one serves there
        const Vec3d unit = length > 0.0 ? m / length : Vec3d(0.0);
        data_.normals.emplace_back(float(unit.x), float(unit.y), float(unit.z));
        return uint32_t(data_.positions.size() - 1);
    }

    void triangle(uint32_t a, uint32_t b, uint32_t c) {
        const auto& p = data_.positions;
        if (p[a] == p[b] || p[b] == p[c] || p[c] == p[a]) return;
        data_.triangles.push_back({a, b, c});
    }

    /// Ring of vertices at height z; normals lean by (nr along the radius, nz). Returns the first.
    uint32_t ring(double radius, double z, double nr, double nz) {
        const auto first = uint32_t(data_.positions.size());
        for (const Vec2d& c : circle_)
            vertex({radius * c.x, radius * c.y, z}, {nr * c.x, nr * c.y, nz});
        return first;
    }

    /// Band between a lower and an upper ring, outside away from the axis.
    void band(uint32_t lower, uint32_t upper) {
        const auto n = uint32_t(circle_.size());
        for (uint32_t i = 0; i < n; ++i) {
            const uint32_t j = (i + 1) % n;
            triangle(lower + i, lower + j, upper + j);
            triangle(lower + i, upper + j, upper + i);
        }
    }

    /// Triangles between a ring and a point on the axis, above it or below it.
    void fan(uint32_t ring_start, uint32_t apex, bool is_above) {
        const auto n = uint32_t(circle_.size());
        for (uint32_t i = 0; i < n; ++i) {
            const uint32_t j = (i + 1) % n;
            if (is_above)
                triangle(ring_start + i, ring_start + j, apex);
            else
                triangle(ring_start + j, ring_start + i, apex);
        }
    }

    /// Disc that closes a quadric.
    void cap(double radius, double z, bool is_above) {
        const double nz = is_above ? 1.0 : -1.0;
        const uint32_t rim = ring(radius, z, 0.0, nz);
        fan(rim, vertex({0, 0, z}, {0, 0, nz}), is_above);
    }

    /// Half sphere around (0, 0, z0) from the equator to a pole. Returns the equator's ring.
    uint32_t dome(double radius, double z0, bool is_above, int rings) {
        const double up = is_above ? 1.0 : -1.0;
        const uint32_t equator = ring(radius, z0, 1.0, 0.0);
        uint32_t last = equator;
        for (int k = 1; k < rings; ++k) {
            const double latitude = (pi_d / 2) * k / rings;
            const double c = std::cos(latitude), s = up * std::sin(latitude);
            const uint32_t next = ring(radius * c, z0 + radius * s, c, s);
            is_above ? band(last, next) : band(next, last);
            last = next;
        }
        fan(last, vertex({0, 0, z0 + up * radius}, {0, 0, up}), is_above);
        return equator;
    }

    TriangleMeshData take() {
        data_.normal_interpolation = scene::Interpolation::Vertex;
        return std::move(data_);
    }

  private:
    Mat4d shape_from_gprim_;
    Mat3d normal_matrix_;
    double sign_;
    std::vector<Vec2d> circle_;
    TriangleMeshData data_;
};

void add_cube(Builder& builder, double size) {
    const double h = size / 2;
    for (int axis = 0; axis < 3; ++axis) {
        for (const double side : {-1.0, 1.0}) {
            Vec3d n(0.0), u(0.0), v(0.0);
            n[axis] = side;
            // u × v = n, thus corners run counter-clockwise from outside
            u[(axis + 1) % 3] = side > 0 ? 1.0 : -1.0;
            v[(axis + 2) % 3] = 1.0;
            const uint32_t a = builder.vertex((n - u - v) * h, n);
            const uint32_t b = builder.vertex((n + u - v) * h, n);
            const uint32_t c = builder.vertex((n + u + v) * h, n);
            const uint32_t d = builder.vertex((n - u + v) * h, n);
            builder.triangle(a, b, c);
            builder.triangle(a, c, d);
        }
    }
}

void add_plane(Builder& builder, double width, double length) {
    const double x = width / 2, y = length / 2;
    const Vec3d n(0, 0, 1);
    const uint32_t a = builder.vertex({-x, -y, 0}, n);
    const uint32_t b = builder.vertex({x, -y, 0}, n);
    const uint32_t c = builder.vertex({x, y, 0}, n);
    const uint32_t d = builder.vertex({-x, y, 0}, n);
    builder.triangle(a, b, c);
    builder.triangle(a, c, d);
}

void add_cone(Builder& builder, double radius, double height, int segments) {
    // Rows along the slope: shading normals at the apex belong to one slope line each
    const int rows = std::max(1, segments / 8);
    uint32_t last = builder.ring(radius, -height / 2, height, radius);
    for (int k = 1; k <= rows; ++k) {
        const double t = double(k) / rows;
        const double r = k == rows ? 0.0 : radius * (1.0 - t);
        const uint32_t next = builder.ring(r, height * (t - 0.5), height, radius);
        builder.band(last, next);
        last = next;
    }
    builder.cap(radius, -height / 2, false);
}

}  // namespace

TriangleMeshData tessellate_gprim(const scene::Gprim& gprim, int segments) {
    using Kind = scene::Gprim::Kind;
    Builder builder(gprim.shape_from_gprim, segments);
    const int rings = std::max(1, segments / 4);
    const double half = gprim.height / 2;
    switch (gprim.kind) {
        case Kind::Sphere: {
            const uint32_t lower = builder.dome(gprim.radius, 0.0, false, rings);
            const uint32_t upper = builder.dome(gprim.radius, 0.0, true, rings);
            static_cast<void>(lower);
            static_cast<void>(upper);
            break;
        }
        case Kind::Capsule: {
            const uint32_t lower = builder.dome(gprim.radius, -half, false, rings);
            const uint32_t upper = builder.dome(gprim.radius, half, true, rings);
            builder.band(lower, upper);
            break;
        }
        case Kind::Cylinder: {
            const uint32_t lower = builder.ring(gprim.radius, -half, 1.0, 0.0);
            const uint32_t upper = builder.ring(gprim.radius, half, 1.0, 0.0);
            builder.band(lower, upper);
            builder.cap(gprim.radius, -half, false);
            builder.cap(gprim.radius, half, true);
            break;
        }
        case Kind::Cone:
            add_cone(builder, gprim.radius, gprim.height, segments);
            break;
        case Kind::Cube:
            add_cube(builder, gprim.size);
            break;
        case Kind::Plane:
            add_plane(builder, gprim.width, gprim.length);
            break;
    }
    return builder.take();
}

}  // namespace velatura::geometry
