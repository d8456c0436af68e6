// SPDX-License-Identifier: Apache-2.0
// How finely a scene is cut: by the size of edges in its image, within a limit, prototypes once.
#include "geometry/refinement.h"

#include "cages.h"
#include "geometry/geometry_set.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace velatura::subdivision::test {
namespace {

using geometry::DicingOptions;
using geometry::DicingView;
using geometry::Refinement;

/// Looks along −z from the origin, one unit wide at distance 1.
scene::Camera camera() {
    scene::Camera camera;
    camera.window_left = camera.window_bottom = -0.5;
    camera.window_right = camera.window_top = 0.5;
    return camera;
}

class Dicing : public testing::Test {
  protected:
    void SetUp() override {
        subdivider_ = open_subdivider();
        if (subdivider_ == nullptr) GTEST_SKIP() << "built without the plugin subdivision";
    }

    Refinement refine(const scene::Scene& scene, const DicingOptions& options, int pixels = 100) {
        return geometry::refine(scene, {subdivider_, displacer_}, options,
                                DicingView(camera(), pixels, pixels), diagnostics_);
    }

    const geometry::Subdivider* subdivider_ = nullptr;
    const geometry::Displacer* displacer_ = nullptr;
    Diagnostics diagnostics_;
};

scene::Shape shape_of(scene::Mesh mesh, const Vec3& offset, float scale = 1) {
    for (Vec3& p : mesh.points) p = p * scale + offset;
    scene::Shape shape;
    shape.geometry = std::move(mesh);
    return shape;
}

TEST(DicingView, CountsPixels) {
    const DicingView view(camera(), 200, 100);
    EXPECT_DOUBLE_EQ(view.density(Vec3d(0, 0, -1)), 200.0);
    EXPECT_DOUBLE_EQ(view.density(Vec3d(0.5, 0, -4)), 50.0);
    EXPECT_DOUBLE_EQ(view.density(Vec3d(0, 0, 2)), 200.0);  // behind: by half the distance
    const auto shows = [&](const Vec3d& center) {
        return view.can_show(Box3d(center - Vec3d(0.1), center + Vec3d(0.1)));
    };
    EXPECT_TRUE(shows(Vec3d(0, 0, -2)));
    EXPECT_FALSE(shows(Vec3d(0, 0, 2)));
    EXPECT_FALSE(shows(Vec3d(2, 0, -2)));
    EXPECT_FALSE(shows(Vec3d(0, -2, -2)));
    EXPECT_TRUE(view.can_show(Box3d(Vec3d(-9), Vec3d(9))));
}

TEST_F(Dicing, EdgesInTheImageCoverAboutTheirRate) {
    scene::Scene scene;
    scene.shapes.push_back(shape_of(cube(), Vec3(0, 0, -6)));
    const DicingView view(camera(), 100, 100);
    for (const double rate : {0.5, 1.0, 3.0}) {
        Refinement refined = refine(scene, {.rate = rate});
        const auto& data = **refined.find(scene::none, 0);
        std::vector<double> lengths;
        for (const auto& t : data.triangles)
            for (size_t k = 0; k < 3; ++k) {
                const Vec3d a(data.positions[t[k]]), b(data.positions[t[(k + 1) % 3]]);
                lengths.push_back((b - a).length() * view.density((a + b) * 0.5));
            }
        std::sort(lengths.begin(), lengths.end());
        // Half of them at the least are sides of quads: about the rate, in the middle of a bulging
        // face more than at its edges
        EXPECT_LT(lengths[lengths.size() / 2], 1.25 * rate);
        EXPECT_LT(lengths.back(), 2.0 * rate);
        EXPECT_GT(lengths[lengths.size() / 2], 0.5 * rate);
    }
}

TEST_F(Dicing, WhatIsOutOfTheImageIsCoarser) {
    scene::Scene scene;
    scene.shapes.push_back(shape_of(cube(), Vec3(0, 0, -10)));
    scene.shapes.push_back(shape_of(cube(), Vec3(0, 0, 10)));
    Refinement refined = refine(scene, {.rate = 0.25});
    const size_t seen = (*refined.find(scene::none, 0))->triangles.size();
    const size_t unseen = (*refined.find(scene::none, 1))->triangles.size();
    // 1/64, but for the half distance that counts behind the camera
    EXPECT_GT(double(seen), 12.0 * double(unseen));
}

TEST_F(Dicing, LightsAreCoarser) {
    scene::Scene scene;
    scene.shapes.assign(2, shape_of(cube(), Vec3(0, 0, -10)));
    scene.materials.emplace_back().emissive_color = scene::Input(Rgb(1.0f));
    scene.shapes[1].material = 0;
    Refinement refined = refine(scene, {.rate = 0.1});
    const size_t plain = (*refined.find(scene::none, 0))->triangles.size();
    const size_t light = (*refined.find(scene::none, 1))->triangles.size();
    EXPECT_NEAR(double(plain) / double(light), 16.0, 1.0);
}

TEST_F(Dicing, LevelsAreUniform) {
    scene::Scene scene;
    scene.shapes.push_back(shape_of(cube(), Vec3(0, 0, -10)));
    Refinement refined = refine(scene, {.level = 3});
    EXPECT_EQ((*refined.find(scene::none, 0))->triangles.size(), 6u * 64u * 2u);
    EXPECT_EQ(refined.stats.level, 3);
    EXPECT_EQ(refined.stats.faces, 6u);
    EXPECT_EQ(refined.stats.triangles, 768u);
}

TEST_F(Dicing, PrototypesAreCutForTheirLargestInstance) {
    scene::Scene alone;
    alone.shapes.push_back(shape_of(cube(), Vec3(0, 0, -4)));
    scene::Scene many;
    many.prototypes.push_back({"p", {shape_of(cube(), Vec3(0))}});
    for (const float z : {-40.0f, -4.0f, -12.0f, 3.0f}) {
        scene::Instance instance;
        instance.render_from_prototype.setTranslation(Vec3(0, 0, z));
        many.instances.push_back(instance);
    }
    Refinement a = refine(alone, {}), b = refine(many, {});
    EXPECT_EQ((*a.find(scene::none, 0))->triangles.size(), (*b.find(0, 0))->triangles.size());
}

TEST_F(Dicing, TooManyTrianglesAreFewerWithAWarning) {
    scene::Scene scene;
    scene.shapes.push_back(shape_of(cube(), Vec3(0, 0, -4)));
    Refinement fine = refine(scene, {.rate = 0.1});
    EXPECT_EQ(diagnostics_.warning_count(), 0u);
    EXPECT_GT(fine.stats.triangles, 10000u);
    Refinement coarse = refine(scene, {.rate = 0.1, .max_triangles = 5000});
    EXPECT_EQ(diagnostics_.warning_count(), 1u);
    EXPECT_LT(coarse.stats.triangles, 5500u);
    EXPECT_GT(coarse.stats.triangles, 2000u);
    Refinement level = refine(scene, {.level = 8, .max_triangles = 5000});
    EXPECT_EQ(level.stats.level, 4);
}

TEST_F(Dicing, TheLimitHoldsForEdgesOfAnyNumberOfPixels) {
    scene::Scene scene;
    scene.shapes.push_back(shape_of(cube(), Vec3(0, 0, -4)));
    scene::Camera far_zoom = camera();
    far_zoom.projection = scene::Camera::Projection::Orthographic;
    for (const double window : {1e-6, 1e-20, 1e-200}) {
        far_zoom.window_left = far_zoom.window_bottom = -window;
        far_zoom.window_right = far_zoom.window_top = window;
        Refinement refined =
            geometry::refine(scene, {subdivider_, displacer_}, {.max_triangles = 5000},
                             DicingView(far_zoom, 100, 100), diagnostics_);
        EXPECT_LT(refined.stats.triangles, 5500u) << window;
        EXPECT_GT(refined.stats.triangles, 1000u) << window;
    }
}

TEST_F(Dicing, OneBadMeshIsPolygonsAndTheOthersAreNot) {
    scene::Scene scene;
    scene::Mesh bad = cube();
    bad.subdivision = scene::SubdivisionScheme::Loop;
    scene.shapes.push_back(shape_of(bad, Vec3(0, 0, -4)));
    scene.shapes.push_back(shape_of(cube(), Vec3(0, 0, -4)));
    Refinement refined = refine(scene, {});
    EXPECT_EQ(diagnostics_.warning_count(), 1u);
    EXPECT_EQ(refined.stats.polygon_meshes, 1u);
    EXPECT_EQ(refined.stats.meshes, 1u);
    const uint64_t triangles = refined.stats.triangles;
    const geometry::GeometrySet set(scene, {}, std::move(refined));
    EXPECT_EQ(set.shapes()[0].triangle_count(), 12u);
    EXPECT_EQ(set.shapes()[1].triangle_count(), triangles);
    EXPECT_TRUE(set.shapes()[1].has_normals());
}

}  // namespace
}  // namespace velatura::subdivision::test
