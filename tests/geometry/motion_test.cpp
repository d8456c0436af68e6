// SPDX-License-Identifier: Apache-2.0
#include "geometry/motion.h"

#include "geometry/geometry_set.h"
#include "geometry/surface_point.h"

#include <gtest/gtest.h>

#include <random>

namespace velatura::geometry {

namespace {

constexpr int grid = 5;  // points along an edge of the sheet

Vec3 random_point(std::mt19937& random) {
    std::uniform_real_distribution<float> uniform(-1, 1);
    const float x = uniform(random), y = uniform(random), z = uniform(random);
    return {x, y, z};
}

/// A sheet of quads with texture coordinates; all of it moves, normals too.
scene::Mesh moving_sheet(uint32_t segments, uint32_t seed) {
    std::mt19937 random(seed);
    scene::Mesh mesh;
    mesh.later_points.resize(segments);
    mesh.later_normals.resize(segments);
    scene::Primvar st;
    st.interpolation = scene::Interpolation::Vertex;
    st.width = 2;
    for (int y = 0; y < grid; ++y) {
        for (int x = 0; x < grid; ++x) {
            const Vec3 p(float(x), float(y), 0);
            st.values.insert(st.values.end(), {p.x, p.y});
            mesh.points.push_back(p + random_point(random) * 0.3f);
            mesh.normals.push_back(Vec3(0, 0, 1) + random_point(random) * 0.5f);
            for (uint32_t k = 0; k < segments; ++k) {
                mesh.later_points[k].push_back(p + random_point(random) * 0.4f);
                mesh.later_normals[k].push_back(Vec3(0, 0, 2) + random_point(random));
            }
        }
    }
    for (uint32_t y = 0; y + 1 < grid; ++y) {
        for (uint32_t x = 0; x + 1 < grid; ++x) {
            const uint32_t i = y * grid + x;
            mesh.face_vertex_counts.push_back(4);
            mesh.face_vertex_indices.insert(mesh.face_vertex_indices.end(),
                                            {i, i + 1, i + grid + 1, i + grid});
        }
    }
    mesh.primvars = {st};
    return mesh;
}

/// The sheet as a shape, and as a prototype that is placed once.
scene::Scene scene_of(scene::Mesh mesh) {
    scene::Scene scene;
    mesh.primvars[0].name = scene::intern_primvar(scene, "st");
    scene::Shape shape;
    shape.geometry = std::move(mesh);
    scene.shapes = {shape};
    scene.prototypes.push_back({"sheet", {shape}});
    Mat4d turn, scale;
    turn.setAxisAngle(Vec3d(0.6, 0.8, 0), 0.7);
    scale.setScale(Vec3d(1, -2, 0.5));
    scene.instances.emplace_back().render_from_prototype = Mat4(scale * turn);
    return scene;
}

}  // namespace

// Shading sees the mesh that stands still where the moving one is at the time of the ray.
TEST(MovingSurfacePoint, IsThatOfTheMeshAtTheTimeOfTheRay) {
    std::mt19937 random(3);
    std::uniform_real_distribution<float> uniform(0, 1);
    for (const uint32_t segments : {1u, 2u, 5u}) {
        const scene::Mesh mesh = moving_sheet(segments, segments);
        const scene::Scene moving = scene_of(mesh);
        const GeometrySet moving_set(moving);
        const TriangleMesh& triangles = moving_set.shapes()[0];
        ASSERT_EQ(triangles.segments(), segments);
        for (int trial = 0; trial < 200; ++trial) {
            const float time = trial % 5 == 0 ? float(int(random() % segments)) / float(segments)
                                              : uniform(random);
            // The same triangles, where they are at that time
            const MotionTime at = motion_time(time, segments);
            const auto& from = at.segment == 0 ? mesh.points : mesh.later_points[at.segment - 1];
            TriangleMeshData still;
            still.triangles.assign(triangles.triangles().begin(), triangles.triangles().end());
            for (size_t i = 0; i < mesh.points.size(); ++i)
                still.positions.push_back(moved(from[i], mesh.later_points[at.segment][i], at.f));
            const TriangleMesh posed(still);
            const Hit hit{1,
                          uniform(random) * 0.5f,
                          uniform(random) * 0.5f,
                          trial % 2 ? 0u : scene::none,
                          0,
                          uint32_t(random() % triangles.triangle_count())};
            for (int k = 0; k < 3; ++k)
                ASSERT_EQ(triangles.corner(hit.triangle, k, time), posed.corner(hit.triangle, k));

            scene::Scene stopped = moving;
            scene::Mesh pose = mesh;
            pose.points = still.positions;
            pose.later_points.clear();
            pose.later_normals.clear();
            pose.normals.clear();
            // Quads are cut as they are at first: hand the triangles over one by one
            pose.face_vertex_counts.assign(still.triangles.size(), 3);
            pose.face_vertex_indices.clear();
            for (const auto& v : still.triangles)
                pose.face_vertex_indices.insert(pose.face_vertex_indices.end(), v.begin(), v.end());
            pose.primvars = std::get<scene::Mesh>(stopped.shapes[0].geometry).primvars;
            stopped.shapes[0].geometry = stopped.prototypes[0].shapes[0].geometry = pose;
            const GeometrySet stopped_set(stopped);
            Ray ray{Vec3(0), Vec3(0, 0, 1)};
            ray.time = time;
            const SurfacePoint p = make_surface_point(moving, moving_set, ray, hit);
            const SurfacePoint q = make_surface_point(stopped, stopped_set, ray, hit);
            EXPECT_EQ(p.p, q.p);
            EXPECT_EQ(p.p_error, q.p_error);
            EXPECT_EQ(p.ng, q.ng);
            EXPECT_EQ(p.time, time);
            SurfacePoint same_frame = p;
            same_frame.ns = q.ns;
            EXPECT_EQ(tangents(moving, same_frame).dpds, tangents(stopped, q).dpds);
            EXPECT_EQ(spawn_ray(p, Vec3(0, 0, 1)).time, time);
            EXPECT_EQ(spawn_ray_to(p, Vec3(5)).time, time);
            EXPECT_EQ(spawn_ray_to(p, q).time, time);
        }
    }
}

TEST(MovingSurfacePoint, HasNormalsBetweenThoseOfTheKeys) {
    const scene::Mesh mesh = moving_sheet(2, 7);
    const scene::Scene scene = scene_of(mesh);
    const GeometrySet set(scene);
    for (const float time : {0.0f, 0.125f, 0.5f, 0.75f}) {
        const size_t segment = time < 0.5f ? 0 : 1;
        const double f = double(time) * 2 - double(segment);
        for (uint32_t triangle = 0; triangle < set.shapes()[0].triangle_count(); ++triangle) {
            Vec3d expected(0);
            const double weights[3] = {0.25, 0.25, 0.5};
            for (size_t k = 0; k < 3; ++k) {
                const uint32_t v = set.shapes()[0].vertices(triangle)[k];
                // Every key's normal is a direction
                const Vec3 from = segment == 0 ? mesh.normals[v] : mesh.later_normals[0][v];
                const Vec3d a(normalize(from)), b(normalize(mesh.later_normals[segment][v]));
                expected += (a + (b - a) * f) * weights[k];
            }
            Ray ray{Vec3(0), Vec3(0, 0, 1)};
            ray.time = time;
            const SurfacePoint p =
                make_surface_point(scene, set, ray, {1, 0.25f, 0.5f, scene::none, 0, triangle});
            const Vec3d n = expected / expected.length();
            const Vec3d facing = n.dot(Vec3d(p.ng)) < 0 ? -n : n;
            EXPECT_NEAR((Vec3d(p.ns) - facing).length(), 0, 1e-6);
        }
    }
}

TEST(MovingMesh, ThatDoesNotMoveIsStill) {
    scene::Mesh mesh = moving_sheet(3, 9);
    mesh.later_points.assign(3, mesh.points);
    mesh.later_normals.assign(3, mesh.normals);
    const scene::Scene scene = scene_of(mesh);
    const GeometrySet set(scene);
    EXPECT_EQ(set.shapes()[0].segments(), 0u);
    EXPECT_FALSE(set.has_motion());
    EXPECT_TRUE(set.shapes()[0].later_positions().empty());
    // One coordinate is enough
    mesh.later_points[1][4].z += 1e-3f;
    const scene::Scene moving = scene_of(mesh);
    EXPECT_EQ(GeometrySet(moving).shapes()[0].segments(), 3u);
    EXPECT_TRUE(GeometrySet(moving).has_motion());
}

TEST(MovingMesh, MovesWhenItIsALight) {
    scene::Scene scene = scene_of(moving_sheet(2, 10));
    scene.shapes[0].light = 0;
    const GeometrySet set(scene);
    EXPECT_EQ(set.shapes()[0].segments(), 2u);
    EXPECT_EQ(set.prototypes()[0][0].segments(), 2u);
}

TEST(MovingMesh, HasTheBoundsOfAllItsKeys) {
    scene::Mesh mesh = moving_sheet(3, 11);
    mesh.later_points[1][7] = Vec3(30, -40, 50);
    const scene::Scene scene = scene_of(mesh);
    const Box3 box = GeometrySet(scene).shapes()[0].bounds();
    EXPECT_EQ(box.max.x, 30);
    EXPECT_EQ(box.min.y, -40);
    EXPECT_EQ(box.max.z, 50);
}

TEST(MovingInstance, MatrixGoesLinearlyFromKeyToKey) {
    for (const size_t segments : {1, 2, 3}) {
        std::vector<Mat4> keys(segments + 1);
        for (size_t k = 0; k < keys.size(); ++k)
            for (int i = 0; i < 4; ++i)
                for (int j = 0; j < 3; ++j)
                    keys[k][i][j] = float((i == j) + int((7 * k + size_t(4 * i + j)) % 5)) / 4.0f;
        scene::Instance instance;
        instance.render_from_prototype = keys[0];
        instance.later_render_from_prototype.assign(keys.begin() + 1, keys.end());
        for (const float time : {0.0f, 0.1f, 0.3f, 0.5f, 0.75f, 0.9f}) {
            const double at = double(time) * double(segments);
            const auto k = size_t(at);
            const Mat4 found = render_from_prototype(instance, time);
            for (int i = 0; i < 4; ++i)
                for (int j = 0; j < 3; ++j) {
                    const double a = double(keys[k][i][j]), b = double(keys[k + 1][i][j]);
                    EXPECT_NEAR(double(found[i][j]), a + (b - a) * (at - double(k)), 1e-6)
                        << segments << " segments, time " << time;
                }
        }
    }
}

// Shading sees an instance that moves as the one that stays where it is at the time of the ray.
TEST(MovingInstance, IsTheOneThatStaysThereAtTheTimeOfTheRay) {
    std::mt19937 random(21);
    std::uniform_real_distribution<float> uniform(0, 1);
    scene::Scene moving = scene_of(moving_sheet(2, 22));
    scene::Gprim sphere;
    sphere.kind = scene::Gprim::Kind::Sphere;
    scene::Shape ball;
    ball.geometry = sphere;
    moving.prototypes[0].shapes.push_back(ball);
    scene::Instance& instance = moving.instances[0];
    for (int k = 0; k < 3; ++k) {
        Mat4 key = instance.render_from_prototype;
        for (int i = 0; i < 4; ++i)
            for (int j = 0; j < 3; ++j) key[i][j] += 0.2f * (uniform(random) - 0.5f);
        instance.later_render_from_prototype.push_back(key);
    }
    const GeometrySet set(moving);
    EXPECT_TRUE(set.has_motion());
    for (int trial = 0; trial < 300; ++trial) {
        const float time = trial % 4 == 0 ? float(int(random() % 3)) / 3.0f : uniform(random);
        scene::Scene stopped = moving;
        stopped.instances[0].render_from_prototype =
            render_from_prototype(moving.instances[0], time);
        stopped.instances[0].later_render_from_prototype.clear();
        const GeometrySet stopped_set(stopped);
        const bool is_ball = trial % 2 == 1;
        const Hit hit{4,
                      uniform(random) * 0.5f,
                      uniform(random) * 0.5f,
                      0,
                      is_ball ? 1u : 0u,
                      is_ball ? 0 : uint32_t(random() % set.prototypes()[0][0].triangle_count())};
        const Ray ray{Vec3(0.1f, 0.2f, 5), Vec3(0, 0, -1), 10, time};
        const SurfacePoint p = make_surface_point(moving, set, ray, hit);
        const SurfacePoint q = make_surface_point(stopped, stopped_set, ray, hit);
        EXPECT_EQ(p.p, q.p);
        EXPECT_EQ(p.p_error, q.p_error);
        EXPECT_EQ(p.ng, q.ng);
        EXPECT_EQ(p.ns, q.ns);
        EXPECT_EQ(tangents(moving, p).dpds, tangents(stopped, q).dpds);
        const auto above = lifted(set, p, p.ng), expected = lifted(stopped_set, q, q.ng);
        ASSERT_EQ(above.has_value(), expected.has_value());
        if (above) {
            EXPECT_EQ(above->p, expected->p);
        }
    }
}

// A face without area when the shutter opens may get one.
TEST(MovingMesh, KeepsTrianglesThatOpenLater) {
    scene::Mesh mesh;
    mesh.points = {Vec3(0), Vec3(0), Vec3(1, 0, 0)};
    mesh.face_vertex_counts = {3};
    mesh.face_vertex_indices = {0, 1, 2};
    mesh.primvars.resize(1);
    EXPECT_EQ(GeometrySet(scene_of(mesh)).shapes()[0].triangle_count(), 0u);
    mesh.later_points = {{Vec3(0), Vec3(0, 1, 0), Vec3(1, 0, 0)}};
    EXPECT_EQ(GeometrySet(scene_of(mesh)).shapes()[0].triangle_count(), 1u);
}

}  // namespace velatura::geometry
