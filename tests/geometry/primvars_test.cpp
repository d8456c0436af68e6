// SPDX-License-Identifier: Apache-2.0
#include "geometry/geometry_set.h"

#include <gtest/gtest.h>

namespace velatura::geometry {

namespace {

using scene::Interpolation;

/// Two quads side by side over six points; quad 1 comes second.
scene::Mesh two_quads() {
    scene::Mesh mesh;
    mesh.points = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {0, 1, 0}, {1, 1, 0}, {2, 1, 0}};
    mesh.face_vertex_counts = {4, 4};
    mesh.face_vertex_indices = {0, 1, 4, 3, 1, 2, 5, 4};
    return mesh;
}

float value(const scene::Mesh& mesh, uint32_t triangle, float b1, float b2) {
    scene::Shape shape;
    shape.geometry = mesh;
    float out[4] = {-1, -1, -1, -1};
    EXPECT_TRUE(make_triangle_mesh(shape).primvar(0, triangle, b1, b2, out));
    return out[0];
}

}  // namespace

TEST(Primvars, EveryInterpolationMatchesHandValues) {
    scene::Mesh mesh = two_quads();
    // Triangles: 0 = (0,1,4), 1 = (0,4,3), 2 = (1,2,5), 3 = (1,5,4)
    scene::Primvar primvar;
    primvar.name = 0;
    primvar.interpolation = Interpolation::Constant;
    primvar.values = {7};
    mesh.primvars = {primvar};
    EXPECT_EQ(value(mesh, 3, 0.25f, 0.5f), 7.0f);
    primvar.interpolation = Interpolation::Uniform;
    primvar.values = {3, 5};
    mesh.primvars = {primvar};
    EXPECT_EQ(value(mesh, 1, 0.25f, 0.5f), 3.0f);
    EXPECT_EQ(value(mesh, 2, 0.25f, 0.5f), 5.0f);
    primvar.interpolation = Interpolation::Vertex;
    primvar.values = {0, 1, 2, 4, 8, 16};
    for (const Interpolation same : {Interpolation::Vertex, Interpolation::Varying}) {
        primvar.interpolation = same;
        mesh.primvars = {primvar};
        EXPECT_EQ(value(mesh, 0, 0.25f, 0.5f), 0.25f * 1 + 0.5f * 8);
        EXPECT_EQ(value(mesh, 3, 0.25f, 0.5f), 0.25f * 1 + 0.25f * 16 + 0.5f * 8);
    }
    primvar.interpolation = Interpolation::FaceVarying;
    primvar.values = {0, 1, 2, 3, 10, 20, 30, 40};
    mesh.primvars = {primvar};
    EXPECT_EQ(value(mesh, 1, 0.25f, 0.5f), 0.25f * 2 + 0.5f * 3);
    EXPECT_EQ(value(mesh, 3, 0.25f, 0.5f), 0.25f * 10 + 0.25f * 30 + 0.5f * 40);
}

TEST(Primvars, IndicesApplyBeforeInterpolation) {
    scene::Mesh mesh = two_quads();
    scene::Primvar primvar;
    primvar.name = 0;
    primvar.interpolation = Interpolation::FaceVarying;
    primvar.width = 2;
    primvar.values = {0, 100, 4, 104, 8, 108};
    primvar.indices = {0, 1, 2, 0, 2, 2, 1, 1};
    mesh.primvars = {primvar};
    scene::Shape shape;
    shape.geometry = mesh;
    const TriangleMesh triangles = make_triangle_mesh(shape);
    float out[4] = {-1, -1, -1, -1};
    ASSERT_TRUE(triangles.primvar(0, 0, 0.25f, 0.5f, out));
    EXPECT_EQ(out[0], 0.25f * 4 + 0.5f * 8);
    EXPECT_EQ(out[1], 100 + 0.25f * 4 + 0.5f * 8);
    EXPECT_EQ(out[2], -1.0f);
    EXPECT_FALSE(triangles.primvar(1, 0, 0.25f, 0.5f, out));
}

TEST(Primvars, TooFewNumbersAreReportedNotRead) {
    scene::Mesh mesh = two_quads();
    scene::Primvar primvar;
    primvar.name = 0;
    primvar.interpolation = Interpolation::Vertex;
    primvar.values = {0, 1, 2};
    mesh.primvars = {primvar};
    scene::Shape shape;
    shape.geometry = mesh;
    float out[4];
    EXPECT_FALSE(make_triangle_mesh(shape).primvar(0, 0, 0.25f, 0.5f, out));
}

TEST(Primvars, NormalsInterpolateAsDirections) {
    scene::Mesh mesh = two_quads();
    mesh.normal_interpolation = Interpolation::Uniform;
    mesh.normals = {{0, 0, 3}, {0, 2, 0}};
    scene::Shape shape;
    shape.geometry = mesh;
    const TriangleMesh triangles = make_triangle_mesh(shape);
    EXPECT_EQ(triangles.normal(0, 0.25f, 0.5f), Vec3d(0, 0, 1));
    EXPECT_EQ(triangles.normal(2, 0.25f, 0.5f), Vec3d(0, 1, 0));
}

TEST(Primvars, InstanceColorStandsInWhereTheMeshHasNone) {
    scene::Scene scene;
    const scene::PrimvarId color = scene::intern_primvar(scene, scene::display_color_primvar);
    scene::Prototype prototype;
    prototype.shapes.resize(2);
    prototype.shapes[0].geometry = two_quads();
    scene::Mesh colored = two_quads();
    scene::Primvar own;
    own.name = color;
    own.width = 3;
    own.values = {0.125f, 0.25f, 0.5f};
    colored.primvars = {own};
    prototype.shapes[1].geometry = colored;
    scene.prototypes = {prototype};
    scene::Instance instance;
    scene::set_value(scene, instance, {color, 3, false, {0.75f, 0.5f, 0.25f, 0}});
    scene.instances = {instance};
    const GeometrySet geometry(scene);
    Hit hit{1.0f, 0.25f, 0.25f, 0, 0, 0};
    float out[4] = {0, 0, 0, 0};
    ASSERT_TRUE(primvar(scene, make_surface_point(scene, geometry, Ray(), hit), color, out));
    EXPECT_EQ(out[0], 0.75f);
    hit.shape = 1;
    ASSERT_TRUE(primvar(scene, make_surface_point(scene, geometry, Ray(), hit), color, out));
    EXPECT_EQ(out[0], 0.125f);

    // What the mesh inherits from above the prototype is further away than the instance
    auto& inherited = std::get<scene::Mesh>(scene.prototypes[0].shapes[1].geometry).primvars[0];
    inherited.yields_to_instance = true;
    const GeometrySet yielding(scene);
    ASSERT_TRUE(primvar(scene, make_surface_point(scene, yielding, Ray(), hit), color, out));
    EXPECT_EQ(out[0], 0.75f);
    scene.instances[0].value_count = 0;
    ASSERT_TRUE(primvar(scene, make_surface_point(scene, yielding, Ray(), hit), color, out));
    EXPECT_EQ(out[0], 0.125f);
}

}  // namespace velatura::geometry
