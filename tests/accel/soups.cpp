// SPDX-License-Identifier: Apache-2.0
#include "soups.h"

#include "discs.h"
#include "geometry/mapped_set.h"
#include "geometry/quadric.h"
#include "geometry/ribbons.h"
#include "geometry/round_curves.h"
#include "geometry/sphere_set.h"

#include <cmath>
#include <utility>

namespace velatura::accel::test {

void Soup::add(const Vec3& a, const Vec3& b, const Vec3& c) {
    const auto first = uint32_t(positions.size());
    positions.insert(positions.end(), {a, b, c});
    triangles.push_back({first, first + 1, first + 2});
}

SoupScene scene_of(const std::vector<Soup>& soups) {
    SoupScene scene;
    for (const Soup& soup : soups) scene.shapes.push_back(soup.view());
    return scene;
}

Soup random_soup(size_t count, float size, uint64_t seed) {
    Random random(seed);
    Soup soup;
    for (size_t i = 0; i < count; ++i) {
        const Vec3 p = random.in_cube(1);
        soup.add(p, p + random.in_cube(size), p + random.in_cube(size));
    }
    return soup;
}

Soup needles(size_t count, float aspect, uint64_t seed) {
    Random random(seed);
    Soup soup;
    for (size_t i = 0; i < count; ++i) {
        const Vec3 p = random.in_cube(1), q = random.in_cube(1);
        soup.add(p, q, q + random.direction() * ((q - p).length() / aspect));
    }
    return soup;
}

Soup rods(size_t count, float width, uint64_t seed) {
    Random random(seed);
    Soup soup;
    for (size_t i = 0; i < count; ++i) {
        const Vec3 along = random.direction() * 1.5f, middle = random.in_cube(0.7f);
        const Vec3 across = normalize(cross(along, random.direction())) * width;
        const Vec3 a = middle - along, b = middle + along;
        soup.add(a, b, b + across);
        soup.add(a, b + across, a + across);
    }
    return soup;
}

Soup flat_triangles(size_t count, uint64_t seed) {
    Random random(seed);
    Soup soup;
    for (size_t i = 0; i < count; ++i) {
        const int axis = int(random.below(3));
        const float level = float(int(random.below(17)) - 8) / 8.0f;
        Vec3 p[3];
        for (Vec3& v : p) {
            v = random.in_cube(1);
            // Half of the vertices on a coarse grid: shared planes, edges and vertices
            if (random.below(2)) {
                for (int k = 0; k < 3; ++k) v[k] = std::round(v[k] * 8.0f) / 8.0f;
            }
            v[axis] = level;
        }
        soup.add(p[0], p[1], p[2]);
    }
    return soup;
}

Soup star_mesh(
    int rings, int sectors, double radius, double roughness, const Vec3d& center, uint64_t seed) {
    Random random(seed);
    Soup soup;
    const auto vertex = [&](double theta, double phi) {
        const double r = radius * (1.0 + roughness * double(random.unit()));
        const Vec3d p = Vec3d(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi),
                              std::cos(theta)) *
                            r +
                        center;
        soup.positions.emplace_back(float(p.x), float(p.y), float(p.z));
    };
    vertex(0, 0);
    for (int i = 1; i < rings; ++i) {
        for (int j = 0; j < sectors; ++j) vertex(pi_d * i / rings, 2 * pi_d * j / sectors);
    }
    vertex(pi_d, 0);
    const auto at = [&](int i, int j) { return uint32_t(1 + (i - 1) * sectors + j % sectors); };
    const auto last = uint32_t(soup.positions.size() - 1);
    for (int j = 0; j < sectors; ++j) {
        soup.triangles.push_back({0, at(1, j), at(1, j + 1)});
        for (int i = 1; i + 1 < rings; ++i) {
            soup.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
            soup.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
        }
        soup.triangles.push_back({last, at(rings - 1, j + 1), at(rings - 1, j)});
    }
    return soup;
}

Soup box(const Vec3& lower, const Vec3& upper) {
    Soup soup;
    for (int i = 0; i < 8; ++i) {
        soup.positions.emplace_back((i & 1) ? upper.x : lower.x, (i & 2) ? upper.y : lower.y,
                                    (i & 4) ? upper.z : lower.z);
    }
    constexpr uint32_t quads[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                      {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    for (const auto& q : quads) {
        soup.triangles.push_back({q[0], q[1], q[2]});
        soup.triangles.push_back({q[0], q[2], q[3]});
    }
    return soup;
}

std::vector<TriangleSoupView> quadrics(size_t count, double size, uint64_t seed) {
    using Kind = scene::Gprim::Kind;
    constexpr Kind kinds[] = {Kind::Sphere, Kind::Cylinder, Kind::Cone, Kind::Capsule};
    Random random(seed);
    std::vector<TriangleSoupView> shapes;
    for (size_t i = 0; i < count; ++i) {
        scene::Gprim gprim;
        gprim.kind = kinds[i % 4];
        gprim.radius = size * double(random.between(0.2f, 1));
        gprim.height = size * double(random.between(0.2f, 3));
        Mat4d scale, turn, move;
        if (i % 3 == 1) scale.setScale(Vec3d(1, 0.2, 2));
        if (i % 3 == 2) scale.setScale(Vec3d(-1, 1, 0.01));
        turn.setAxisAngle(Vec3d(random.direction()), double(random.between(0, 6)));
        move.setTranslation(Vec3d(random.in_cube(1)));
        gprim.shape_from_gprim = scale * turn * move;
        shapes.push_back({{}, {}, geometry::Quadric::make(gprim)});
    }
    return shapes;
}

std::vector<TriangleSoupView> strands(size_t count, double thickness, uint64_t seed) {
    using Basis = scene::Curves::Basis;
    using Wrap = scene::Curves::Wrap;
    Random random(seed);
    std::vector<TriangleSoupView> shapes;
    for (size_t i = 0; i < count; ++i) {
        scene::Curves curves;
        curves.basis = Basis(i % 4);
        curves.wrap = curves.basis == Basis::Bezier ? Wrap::Nonperiodic : Wrap(i / 4 % 3);
        curves.width_interpolation = scene::Interpolation::Vertex;
        for (int c = 0; c < 8; ++c) {
            curves.vertex_counts.push_back(7);
            Vec3 p = random.in_cube(0.8f), step = random.in_cube(0.2f);
            for (int k = 0; k < 7; ++k) {
                curves.points.push_back(p);
                curves.widths.push_back(float(thickness) * random.between(0.2f, 1));
                step += random.in_cube(0.1f);
                p += step;
                if (i % 3 == 2) curves.normals.push_back(random.direction());
            }
        }
        std::shared_ptr<const geometry::PrimitiveSet> set;
        if (i % 5 == 4) {
            scene::Points points;
            points.points = curves.points;
            points.widths = curves.widths;
            set = geometry::SphereSet::make(points);
        } else if (i % 3 == 2) {
            set = geometry::Ribbons::make(curves);
        } else {
            set = geometry::RoundCurves::make(curves);
        }
        Mat4d uneven;
        if (i % 7 == 3) uneven.setScale(Vec3d(1, 0.3, -1));
        shapes.push_back({{}, {}, geometry::MappedSet::make(set, uneven)});
    }
    return shapes;
}

TriangleSoupView discs(size_t count, double size, uint64_t seed) {
    Random random(seed);
    std::vector<Discs::Disc> all;
    for (size_t i = 0; i < count; ++i) {
        const Vec3d x = normalize(Vec3d(random.direction()));
        const Vec3d y = normalize(x.cross(Vec3d(random.direction())));
        const double radius = i % 5 == 4 ? 0.0 : size * double(random.between(0.2f, 1));
        all.push_back({Vec3d(random.in_cube(1)), x, y, radius});
    }
    return {{}, {}, std::make_shared<Discs>(std::move(all))};
}

std::vector<geometry::Ray> mixed_rays(size_t count, uint64_t seed) {
    Random random(seed);
    std::vector<geometry::Ray> rays;
    for (size_t i = 0; i < count; ++i) {
        geometry::Ray ray;
        ray.o = random.in_cube(random.below(2) ? 1.0f : 3.0f);
        ray.d = random.in_cube(1) - ray.o;
        const uint32_t kind = random.below(8);
        if (kind >= 6) ray.d = random.direction();
        if (kind < 3) {
            // Grid origins and directions with zeros of both signs
            for (int k = 0; k < 3; ++k) ray.o[k] = std::round(ray.o[k] * 8.0f) / 8.0f;
            for (int k = 0; k < 3; ++k) {
                if (kind == 0 || random.below(2)) ray.d[k] = random.below(2) ? 0.0f : -0.0f;
            }
            if (kind == 0) ray.d[int(random.below(3))] = random.below(2) ? 1.0f : -1.0f;
        }
        if (random.below(8) == 0) ray.t_max = random.between(0.01f, 1.0f);
        rays.push_back(ray);
    }
    return rays;
}

}  // namespace velatura::accel::test
