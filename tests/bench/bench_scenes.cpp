// SPDX-License-Identifier: Apache-2.0
#include "bench_scenes.h"

#include <cmath>

namespace velatura::bench {

namespace {

// Deterministic numbers in [0, 1) (SplitMix64).
class Random {
  public:
    explicit Random(uint64_t seed) : state_(seed) {}

    float operator()() {
        uint64_t z = (state_ += 0x9e3779b97f4a7c15u);
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
        return float((z ^ (z >> 31)) >> 40) * 0x1p-24f;
    }

    float operator()(float a, float b) { return a + (b - a) * (*this)(); }

  private:
    uint64_t state_;
};

float bumps(const Vec3& p) {
    float height = 0, frequency = 3, amplitude = 0.08f;
    for (int octave = 0; octave < 5; ++octave) {
        height += amplitude * std::sin(frequency * p.x + 1.3f * std::sin(frequency * p.y)) *
                  std::sin(frequency * p.z + 0.7f * float(octave));
        frequency *= 2.3f;
        amplitude *= 0.5f;
    }
    return height;
}

void add_displaced_sphere(BenchMesh& mesh, const Vec3& centre, float radius, int rings) {
    const auto first = uint32_t(mesh.positions.size());
    const int sectors = 2 * rings;
    for (int i = 0; i <= rings; ++i) {
        for (int j = 0; j < sectors; ++j) {
            const float theta = pi * float(i) / float(rings),
                        phi = 2 * pi * float(j) / float(sectors);
            const Vec3 n(std::sin(theta) * std::cos(phi), std::cos(theta),
                         std::sin(theta) * std::sin(phi));
            mesh.positions.push_back(centre + n * (radius * (1.0f + bumps(n))));
        }
    }
    const auto at = [&](int i, int j) { return first + uint32_t(i * sectors + j % sectors); };
    for (int i = 0; i < rings; ++i) {
        for (int j = 0; j < sectors; ++j) {
            if (i > 0) mesh.triangles.push_back({at(i, j), at(i, j + 1), at(i + 1, j)});
            if (i + 1 < rings)
                mesh.triangles.push_back({at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)});
        }
    }
}

void add_column(BenchMesh& mesh, const Vec3& foot, const Vec3& axis, float radius, int sides) {
    const Frame frame = Frame::from_z(normalize(axis));
    const auto ring = [&](int j) {
        const float phi = 2 * pi * float(j) / float(sides);
        return (frame.x * std::cos(phi) + frame.y * std::sin(phi)) * radius;
    };
    for (int j = 0; j < sides; ++j) {
        mesh.add_quad(foot + ring(j), foot + ring(j + 1), foot + axis + ring(j + 1),
                      foot + axis + ring(j));
    }
}

}  // namespace

void BenchMesh::add(const Vec3& a, const Vec3& b, const Vec3& c) {
    const auto first = uint32_t(positions.size());
    positions.insert(positions.end(), {a, b, c});
    triangles.push_back({first, first + 1, first + 2});
}

void BenchMesh::add_quad(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
    const auto first = uint32_t(positions.size());
    positions.insert(positions.end(), {a, b, c, d});
    triangles.push_back({first, first + 1, first + 2});
    triangles.push_back({first, first + 2, first + 3});
}

void BenchMesh::add_box(const Vec3& o, const Vec3& x, const Vec3& y, const Vec3& z) {
    add_quad(o, o + x, o + x + y, o + y);
    add_quad(o + z, o + z + x, o + z + x + y, o + z + y);
    add_quad(o, o + x, o + x + z, o + z);
    add_quad(o + y, o + y + x, o + y + x + z, o + y + z);
    add_quad(o, o + y, o + y + z, o + z);
    add_quad(o + x, o + x + y, o + x + y + z, o + x + z);
}

accel::SoupScene BenchScene::soup() const {
    accel::SoupScene scene;
    scene.shapes.push_back({direct.positions, direct.triangles});
    for (const BenchMesh& mesh : prototypes) {
        scene.prototypes.push_back({accel::TriangleSoupView{mesh.positions, mesh.triangles}});
    }
    scene.instances = instances;
    return scene;
}

size_t BenchScene::triangle_count() const {
    size_t count = direct.triangles.size();
    for (const BenchMesh& mesh : prototypes) count += mesh.triangles.size();
    return count;
}

BenchScene make_museum() {
    BenchScene scene;
    scene.name = "museum";
    scene.direct.add_box(Vec3(-8, 0, -8), Vec3(16, 0, 0), Vec3(0, 8, 0), Vec3(0, 0, 16));
    add_displaced_sphere(scene.direct, Vec3(0, 2.2f, 0), 2.0f, 440);
    add_displaced_sphere(scene.direct, Vec3(-4, 1.2f, 2.5f), 1.0f, 220);
    add_displaced_sphere(scene.direct, Vec3(3.5f, 1, 3), 0.8f, 150);
    scene.eye = Vec3(1, 3, 7.5f);
    scene.target = Vec3(0, 2, 0);
    scene.light = Vec3(-2, 7.9f, -2);
    scene.light_x = Vec3(4, 0, 0);
    scene.light_y = Vec3(0, 0, 4);
    scene.ambient_distance = 1.0f;
    return scene;
}

BenchScene make_forest() {
    BenchScene scene;
    scene.name = "forest";
    Random random(1);
    for (int kind = 0; kind < 4; ++kind) {
        BenchMesh tree;
        add_column(tree, Vec3(0), Vec3(0, 4, 0), 0.15f, 24);
        for (int twig = 0; twig < 400; ++twig) {
            const float phi = random(0, 2 * pi), rise = random(-0.2f, 0.6f);
            const Vec3 foot(0, random(1, 4), 0);
            const Vec3 axis = Vec3(std::cos(phi), rise, std::sin(phi)) * random(0.5f, 1.6f);
            add_column(tree, foot, axis, 0.01f, 3);
            for (int leaf = 0; leaf < 100; ++leaf) {
                const Vec3 p = foot + axis * random(0.2f, 1.0f) +
                               Vec3(random(-0.1f, 0.1f), random(-0.1f, 0.1f), random(-0.1f, 0.1f));
                const auto edge = [&] {
                    return Vec3(random(-0.04f, 0.04f), random(-0.04f, 0.04f),
                                random(-0.04f, 0.04f));
                };
                tree.add(p, p + edge(), p + edge());
            }
        }
        scene.prototypes.push_back(std::move(tree));
    }
    scene.direct.add_quad(Vec3(-60, 0, -60), Vec3(60, 0, -60), Vec3(60, 0, 60), Vec3(-60, 0, 60));
    for (uint32_t i = 0; i < 1000; ++i) {
        const float phi = random(0, 2 * pi), s = random(0.7f, 1.4f);
        Mat4 m;
        m[0][0] = s * std::cos(phi);
        m[0][2] = -s * std::sin(phi);
        m[1][1] = s;
        m[2][0] = s * std::sin(phi);
        m[2][2] = s * std::cos(phi);
        m[3][0] = random(-50, 50);
        m[3][2] = random(-50, 50);
        scene.instances.push_back({i % 4, m});
    }
    scene.eye = Vec3(0, 6, 52);
    scene.target = Vec3(0, 2, 20);
    scene.light = Vec3(-20, 60, -20);
    scene.light_x = Vec3(10, 0, 0);
    scene.light_y = Vec3(0, 0, 10);
    scene.ambient_distance = 2.0f;
    return scene;
}

BenchScene make_interior() {
    BenchScene scene;
    scene.name = "interior";
    Random random(2);
    BenchMesh& mesh = scene.direct;
    mesh.add_box(Vec3(-10, 0, -6), Vec3(20, 0, 0), Vec3(0, 6, 0), Vec3(0, 0, 12));
    for (int i = 0; i < 12; ++i) {
        const float x = -9.0f + 1.6f * float(i);
        add_column(mesh, Vec3(x, 0, -4), Vec3(0, 6, 0), 0.25f, 300);
        add_column(mesh, Vec3(x, 0, 4), Vec3(0, 6, 0), 0.25f, 300);
    }
    // Rods across the room: triangles hundreds of times longer than wide
    for (int i = 0; i < 800; ++i) {
        const Vec3 a(random(-9.5f, 9.5f), random(2, 6), random(-5.5f, 5.5f));
        const Vec3 b(random(-9.5f, 9.5f), random(2, 6), random(-5.5f, 5.5f));
        add_column(mesh, a, (b - a) * 0.25f, 0.004f, 6);
    }
    // Curtains of long thin strips
    for (int curtain = 0; curtain < 4; ++curtain) {
        constexpr int strips = 5000;
        const auto fold = [&](int i) {
            const float u = float(i) / float(strips);
            return Vec3(-9 + 18 * u, 0,
                        (curtain < 2 ? -5.5f : 5.2f) + 0.3f * float(curtain % 2) +
                            0.1f * std::sin(200.0f * u));
        };
        for (int i = 0; i < strips; ++i) {
            const Vec3 up(0, 5.5f, 0);
            mesh.add_quad(fold(i), fold(i + 1), fold(i + 1) + up, fold(i) + up);
        }
    }
    scene.eye = Vec3(-8.5f, 1.7f, 0.3f);
    scene.target = Vec3(5, 2.5f, -0.5f);
    scene.light = Vec3(-3, 5.9f, -1);
    scene.light_x = Vec3(6, 0, 0);
    scene.light_y = Vec3(0, 0, 2);
    scene.ambient_distance = 0.7f;
    // Turn everything off the axes
    Mat4 turn;
    turn.setAxisAngle(normalize(Vec3(1, 2, 0.5f)), 0.6f);
    for (Vec3& p : mesh.positions) p = transform_point(p, turn);
    for (Vec3* v : {&scene.eye, &scene.target, &scene.light, &scene.light_x, &scene.light_y}) {
        *v = transform_direction(*v, turn);
    }
    return scene;
}

}  // namespace velatura::bench
