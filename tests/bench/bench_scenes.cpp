// SPDX-License-Identifier: Apache-2.0
#include "bench_scenes.h"

#include <cmath>

namespace velatura::bench {

namespace {

BenchScene make_museum() {
    BenchScene scene;
    BenchMesh& mesh = scene.direct;
    mesh.add_box(Vec3(-12, 0, -8), Vec3(24, 0, 0), Vec3(0, 7, 0), Vec3(0, 0, 16));
    for (int i = 0; i < 10; ++i) {
        for (const float z : {-7.2f, 7.2f})
            mesh.add_column(Vec3(-11 + 2.4f * float(i), 0, z), Vec3(0, 7, 0), 0.3f, 96);
    }
    Random random(3);
    for (int i = 0; i < 24; ++i) {
        // Eight models, three of each
        const auto kind = float(i % 8);
        const Vec3 foot(-10.5f + 3.0f * float(i % 8), 0, -4.0f + 4.0f * float(i / 8));
        mesh.add_box(foot - Vec3(0.5f, 0, 0.5f), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1));
        BlobShape shape;
        shape.radius = Vec3(0.45f + 0.03f * kind, 0.6f + 0.05f * kind, 0.45f);
        shape.center = foot + Vec3(0, 1.05f + 1.15f * shape.radius.y, 0);
        shape.phase = 1.7f * kind;
        shape.twist = 0.6f * kind + random(0, 0.5f);
        add_blob(mesh, shape, 112);
    }
    scene.eye = Vec3(-10, 3, 6.8f);
    scene.target = Vec3(1, 1.5f, -1);
    scene.light = Vec3(-4, 6.9f, -2);
    scene.light_x = Vec3(8, 0, 0);
    scene.light_y = Vec3(0, 0, 4);
    scene.ambient_distance = 1.0f;
    return scene;
}

BenchScene make_hair() {
    BenchScene scene;
    BenchMesh& mesh = scene.direct;
    BlobShape head;
    head.radius = Vec3(0.95f);
    head.octaves = 0;
    add_blob(mesh, head, 48);
    Random random(4);
    constexpr int strips = 60000, segments = 20;
    for (int i = 0; i < strips; ++i) {
        // Roots spread evenly over the sphere above the chin
        const float y = random(-0.3f, 1), phi = random(0, 2 * pi), r = safe_sqrt(1 - y * y);
        const Vec3 root(r * std::cos(phi), y, r * std::sin(phi));
        Vec3 p = root * 0.95f, d = root + random.in_cube(0.3f);
        const Vec3 side = normalize(cross(root, random.in_cube(1) + Vec3(0, 0, 2)));
        const float curl = random(2, 6), start = random(0, 2 * pi);
        auto at = uint32_t(mesh.positions.size());
        for (int k = 0; k <= segments; ++k) {
            const float u = float(k) / float(segments);
            const Vec3 half_width = side * (0.0007f * (1.0f - 0.8f * u));
            mesh.positions.insert(mesh.positions.end(), {p - half_width, p + half_width});
            d = normalize(
                d + Vec3(std::cos(curl * u * 6 + start), -1.2f, std::sin(curl * u * 6 + start)) *
                        0.12f);
            p += d * 0.04f;
            if (k == segments) break;
            mesh.triangles.push_back({at, at + 1, at + 2});
            mesh.triangles.push_back({at + 1, at + 3, at + 2});
            at += 2;
        }
    }
    scene.eye = Vec3(0.5f, 0.7f, 2.6f);
    scene.target = Vec3(0);
    scene.light = Vec3(-3, 4, 2);
    scene.light_x = Vec3(2, 0, 0);
    scene.light_y = Vec3(0, 0, 2);
    scene.ambient_distance = 0.2f;
    return scene;
}

BenchScene make_atrium() {
    BenchScene scene;
    Random random(2);
    BenchMesh& mesh = scene.direct;
    mesh.add_box(Vec3(-10, 0, -6), Vec3(20, 0, 0), Vec3(0, 6, 0), Vec3(0, 0, 12));
    for (int i = 0; i < 12; ++i) {
        const float x = -9.0f + 1.6f * float(i);
        for (const float z : {-4.0f, 4.0f}) {
            mesh.add_column(Vec3(x, 0, z), Vec3(0, 6, 0), 0.25f, 64);
            BlobShape vase;
            vase.center = Vec3(x + 0.8f, 0.5f, z);
            vase.radius = Vec3(0.3f, 0.45f, 0.3f);
            vase.phase = float(i);
            add_blob(mesh, vase, 100);
        }
    }
    // Rods across the room: triangles hundreds of times longer than wide
    for (int i = 0; i < 4000; ++i) {
        const Vec3 a{random(-9.5f, 9.5f), random(2, 6), random(-5.5f, 5.5f)};
        const Vec3 b{random(-9.5f, 9.5f), random(2, 6), random(-5.5f, 5.5f)};
        mesh.add_column(a, (b - a) * 0.25f, 0.004f, 6);
    }
    for (int curtain = 0; curtain < 4; ++curtain) {
        constexpr int columns = 300, rows = 150;
        const float z = (curtain < 2 ? -5.5f : 5.2f) + 0.3f * float(curtain % 2);
        const auto at = [&](int i, int j) {
            const float u = float(i) / float(columns), v = float(j) / float(rows);
            return Vec3(-9 + 18 * u, 5.5f * v, z + 0.1f * std::sin(200.0f * u + 2.0f * v));
        };
        for (int i = 0; i < columns; ++i) {
            for (int j = 0; j < rows; ++j)
                mesh.add_quad(at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
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

// A trunk, and `leaves` triangles of no common vertex along twigs too thin to draw.
BenchMesh make_tree(Random& random, int leaves) {
    constexpr int twigs = 60;
    BenchMesh tree;
    tree.add_column(Vec3(0), Vec3(0, 4, 0), 0.12f, 12);
    for (int twig = 0; twig < twigs; ++twig) {
        const float phi = random(0, 2 * pi), rise = random(-0.2f, 0.6f);
        const Vec3 foot(0, random(1, 4), 0);
        const Vec3 axis = Vec3(std::cos(phi), rise, std::sin(phi)) * random(0.5f, 1.6f);
        for (int leaf = 0; leaf < leaves / twigs; ++leaf) {
            const float along = random(0.2f, 1.0f);
            const Vec3 p = foot + axis * along + random.in_cube(0.2f);
            const Vec3 a = random.in_cube(0.08f), b = random.in_cube(0.08f);
            tree.add(p, p + a, p + b);
        }
    }
    return tree;
}

// Eight kinds of trees, `count` in all, upright on a square of ground.
void plant(BenchScene& scene, uint32_t count, float half_side) {
    Random random(1);
    for (int kind = 0; kind < 8; ++kind) scene.prototypes.push_back(make_tree(random, 9600));
    const float h = half_side;
    scene.direct.add_quad(Vec3(-h, 0, -h), Vec3(h, 0, -h), Vec3(h, 0, h), Vec3(-h, 0, h));
    for (uint32_t i = 0; i < count; ++i) {
        const float phi = random(0, 2 * pi), s = random(0.7f, 1.4f);
        Mat4 m;
        m[0][0] = s * std::cos(phi);
        m[0][2] = -s * std::sin(phi);
        m[1][1] = s;
        m[2][0] = s * std::sin(phi);
        m[2][2] = s * std::cos(phi);
        m[3][0] = random(-h, h);
        m[3][2] = random(-h, h);
        scene.instances.push_back({i % 8, m});
    }
    scene.eye = Vec3(0, 5, h);
    scene.target = Vec3(0, 1, 0.6f * h);
    scene.light = Vec3(-20, 60, -20);
    scene.light_x = Vec3(10, 0, 0);
    scene.light_y = Vec3(0, 0, 10);
    scene.ambient_distance = 1.0f;
}

BenchScene make_forest() {
    BenchScene scene;
    plant(scene, 420, 20);
    for (const accel::SoupInstance& instance : scene.instances) {
        scene.direct.add(scene.prototypes[instance.prototype], instance.render_from_prototype);
    }
    scene.prototypes.clear();
    scene.instances.clear();
    return scene;
}

BenchScene make_woods() {
    BenchScene scene;
    plant(scene, 8 * 420, 57);
    return scene;
}

BenchScene make_city() {
    BenchScene scene;
    BenchMesh& mesh = scene.direct;
    Random random(5);
    constexpr int lots = 100;
    constexpr float lot = 20, half = 0.5f * lot * float(lots);
    mesh.add_box(Vec3(-half, -1, -half), Vec3(2 * half, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 2 * half));
    const auto add = [&](const Vec3& lower, const Vec3& size) {
        mesh.add_box(lower, Vec3(size.x, 0, 0), Vec3(0, size.y, 0), Vec3(0, 0, size.z));
    };
    for (int i = 0; i < lots * lots; ++i) {
        const Vec3 corner(lot * float(i % lots) - half, 0, lot * float(i / lots) - half);
        const Vec3 size{random(9, 15), 6 + 60 * std::pow(random(), 3.0f), random(9, 15)};
        const Vec3 foot = corner + Vec3{random(0.5f, 4), 0, random(0.5f, 4)};
        add(foot, size);
        // Cornices, and boxes on the roof
        for (int k = 1; k <= 4; ++k) {
            const Vec3 out(0.4f, 0, 0.4f);
            add(foot + Vec3(0, size.y * float(k) / 4.0f, 0) - out,
                Vec3(size.x, 0.5f, size.z) + out * 2.0f);
        }
        for (int k = 0; k < 2; ++k) {
            const Vec3 at{random(0, size.x - 3), size.y + 0.5f, random(0, size.z - 3)};
            add(foot + at, Vec3{random(1, 3), random(1, 4), random(1, 3)});
        }
        // Something on the pavement, in every other lot
        if (i % 2) add(corner + Vec3(17, 0, random(2, 18)), Vec3(1.8f, 1.5f, 1.8f));
    }
    scene.eye = Vec3(-250, 90, 420);
    scene.target = Vec3(0, 0, 150);
    scene.light = Vec3(-300, 800, -200);
    scene.light_x = Vec3(100, 0, 0);
    scene.light_y = Vec3(0, 0, 100);
    scene.ambient_distance = 15.0f;
    return scene;
}

}  // namespace

accel::SoupScene BenchScene::soup() const {
    accel::SoupScene scene;
    const auto view = [](const BenchMesh& mesh) {
        return accel::TriangleSoupView{mesh.positions, mesh.triangles, nullptr,
                                       mesh.later_positions};
    };
    scene.shapes.push_back(view(direct));
    for (const BenchMesh& mesh : prototypes) scene.prototypes.push_back({view(mesh)});
    scene.instances = instances;
    for (size_t i = 0; i < later_instances.size(); ++i)
        scene.instances[i].later = later_instances[i];
    return scene;
}

size_t BenchScene::triangle_count() const {
    size_t count = direct.triangles.size();
    for (const BenchMesh& mesh : prototypes) count += mesh.triangles.size();
    return count;
}

BenchScene make_statue(int rings) {
    BenchScene scene;
    BlobShape shape;
    shape.octaves = 7;
    add_blob(scene.direct, shape, rings);
    scene.eye = Vec3(0.4f, 0.5f, 1.9f);
    scene.target = Vec3(0);
    scene.light = Vec3(-3, 4, 2);
    scene.light_x = Vec3(2, 0, 0);
    scene.light_y = Vec3(0, 0, 2);
    scene.ambient_distance = 0.3f;
    return scene;
}

const std::vector<SceneMaker>& all_scenes() {
    static const std::vector<SceneMaker> makers = {
        {"museum", make_museum, false}, {"statue", [] { return make_statue(881); }, false},
        {"hair", make_hair, false},     {"atrium", make_atrium, true},
        {"forest", make_forest, false}, {"city", make_city, false},
        {"woods", make_woods, false}};
    return makers;
}

void add_scene_options(CommandLine& line,
                       std::vector<std::string>& scenes,
                       int& size,
                       int& rounds) {
    std::vector<std::string> names;
    for (const SceneMaker& maker : all_scenes()) names.emplace_back(maker.name);
    line.add_option("--scene", scenes, "only these scenes").allow_extra_args(true).one_of(names);
    line.add_option("--size", size, "edge of the picture; its square is the rays per set")
        .range(16, 4096);
    line.add_option("--rounds", rounds, "how often each set is timed").range(1, 99);
}

}  // namespace velatura::bench
