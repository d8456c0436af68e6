// SPDX-License-Identifier: Apache-2.0
// Points that velocities carry on, against closed forms and the same motion by samples.
#include "translate/support.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

namespace velatura::translate::motion {

namespace {

/// Seconds are 32 time codes: times of the tests below are exact in binary.
std::string stage_text(double close, const std::string& text) {
    return "#usda 1.0\n(\n timeCodesPerSecond = 32\n framesPerSecond = 32\n)\n" +
           camera(fmt::format("double shutter:open = 0\ndouble shutter:close = {}\n", close)) +
           "def DomeLight \"Sky\" {}\n" + text;
}

/// A triangle with these lines.
std::string triangle(const std::string& rows) {
    return R"(def Mesh "M" {
    int[] faceVertexCounts = [3]
    int[] faceVertexIndices = [0, 1, 2]
    uniform token subdivisionScheme = "none"
)" + rows + "}\n";
}

const std::vector<Vec3>& key(const scene::Mesh& mesh, size_t k) {
    return k == 0 ? mesh.points : mesh.later_points[k - 1];
}

const char* const start = "(0, 0, -9), (1, 0, -9), (0, 1, -9)";

}  // namespace

TEST(Velocities, CarryPointsAlongParabolas) {
    Translated t;
    translate_at(1.5,
                 stage_text(16, triangle(fmt::format(R"(
    point3f[] points.timeSamples = {{ 1: [{}] }}
    vector3f[] velocities.timeSamples = {{ 1: [(4, 0, 0), (0, -8, 0), (0, 0, 2)] }}
    vector3f[] accelerations.timeSamples = {{ 1: [(0, 16, 0), (0, 0, 0), (0, 0, -4)] }}
)",
                                                     start))),
                 t);
    EXPECT_EQ(t.diagnostics.warning_count(), 0u);
    const scene::Mesh& mesh = t.mesh(0);
    ASSERT_EQ(mesh.later_points.size(), 16u);
    const Vec3d from[] = {{0, 0, -9}, {1, 0, -9}, {0, 1, -9}};
    const Vec3d v[] = {{4, 0, 0}, {0, -8, 0}, {0, 0, 2}};
    const Vec3d a[] = {{0, 16, 0}, {0, 0, 0}, {0, 0, -4}};
    for (size_t k = 0; k <= 16; ++k) {
        const double s = (0.5 + double(k)) / 32;
        for (size_t i = 0; i < 3; ++i)
            EXPECT_EQ(key(mesh, k)[i], to_float(from[i] + v[i] * s + a[i] * (0.5 * s * s))) << k;
    }
}

TEST(Velocities, AreTheSameAsSamples) {
    const std::string samples = fmt::format("1: [{}]", start);
    Translated by_velocities, by_samples, closed;
    const std::string moving = triangle(
        "point3f[] points.timeSamples = { " + samples +
        " }\nvector3f[] velocities.timeSamples = { 1: [(32, 0, 0), (0, 64, 0), (0, 0, 16)] }\n");
    translate_at(1, stage_text(0.5, moving), by_velocities);
    translate_at(1,
                 stage_text(0.5, triangle("point3f[] points.timeSamples = { " + samples +
                                          ", 2: [(1, 0, -9), (1, 2, -9), (0, 1, -8.5)] }\n")),
                 by_samples);
    const scene::Mesh &a = by_velocities.mesh(0), &b = by_samples.mesh(0);
    ASSERT_EQ(a.later_points.size(), 1u);
    EXPECT_EQ(a.points, b.points);
    EXPECT_EQ(a.later_points, b.later_points);
    EXPECT_EQ(a.later_points[0][1], Vec3(1, 1, -9));
    // The frame's instant is one of them
    translate_at(1.5, stage_text(0, moving), closed);
    EXPECT_EQ(closed.mesh(0).points, a.later_points[0]);
    EXPECT_TRUE(closed.mesh(0).later_points.empty());
}

TEST(Velocities, DoNotMindOtherTopology) {
    Translated t;
    translate_at(1.5, stage_text(1, R"(def Mesh "M" {
    int[] faceVertexCounts.timeSamples = { 1: [3], 2: [4] }
    int[] faceVertexIndices.timeSamples = { 1: [0, 1, 2], 2: [0, 1, 2, 3] }
    point3f[] points.timeSamples = { 1: [(0, 0, -9), (1, 0, -9), (0, 1, -9)], 2: [(7, 0, -9), (8,
        0, -9), (7, 1, -9), (7, 2, -9)] }
    vector3f[] velocities.timeSamples = { 1: [(32, 0, 0), (32, 0, 0), (32, 0, 0)], 2: [(0, 0, 0),
        (0, 0, 0), (0, 0, 0), (0, 0, 0)] }
    normal3f[] normals.timeSamples = { 1: [(0, 0, 1), (0, 1, 0), (0, 0, 1)], 2: [(1, 0, 0), (1, 0,
        0), (1, 0, 0), (1, 0, 0)] }
    uniform token subdivisionScheme = "none"
}
)"),
                 t);
    EXPECT_EQ(t.diagnostics.warning_count(), 0u);
    const scene::Mesh& mesh = t.mesh(0);
    ASSERT_EQ(mesh.points.size(), 3u);
    ASSERT_EQ(mesh.later_points.size(), 1u);
    EXPECT_EQ(mesh.points[0].x, 0.5f);
    EXPECT_EQ(mesh.later_points[0][0].x, 1.5f);
    // Normals are those of the sample
    EXPECT_EQ(mesh.normals[1], Vec3(0, 1, 0));
    EXPECT_TRUE(mesh.later_normals.empty());
}

TEST(Velocities, ThatDoNotFitAreNamed) {
    const std::string points = fmt::format("point3f[] points.timeSamples = {{ 1: [{}] }}\n", start);
    for (const char* velocities :
         {"vector3f[] velocities.timeSamples = { 1: [(9, 9, 9)] }\n",
          "vector3f[] velocities.timeSamples = { 2: [(9, 9, 9), (9, 9, 9), (9, 9, 9)] }\n",
          "vector3f[] velocities = [(9, 9, 9), (9, 9, 9), (9, 9, 9)]\n"}) {
        Translated t;
        translate_at(1, stage_text(0.5, triangle(points + velocities)), t);
        EXPECT_EQ(t.count("unused-velocities"), 1u) << velocities;
        EXPECT_EQ(t.diagnostics.warning_count(), 1u) << velocities;
        EXPECT_TRUE(t.mesh(0).later_points.empty());
        EXPECT_EQ(t.mesh(0).points[1], Vec3(1, 0, -9));
    }
}

TEST(Velocities, AreScaledByWhatIsAbove) {
    const std::string moving = triangle(
        fmt::format("point3f[] points.timeSamples = {{ 1: [{}] }}\nvector3f[] "
                    "velocities.timeSamples = {{ 1: [(32, 0, 0), (0, 64, 0), (0, 0, 16)] }}\n",
                    start));
    Translated scaled, nearer, bad;
    translate_at(
        1, stage_text(0.5, "def Xform \"X\" {\n float motion:velocityScale = 2\n" + moving + "}\n"),
        scaled);
    EXPECT_EQ(scaled.mesh(0).later_points[0][1], Vec3(1, 2, -9));
    translate_at(1,
                 stage_text(0.5,
                            "def Xform \"X\" {\n float motion:velocityScale = 2\ndef Xform \"Y\" "
                            "{\n float motion:velocityScale = 0\n" +
                                moving + "}\n}\n"),
                 nearer);
    EXPECT_TRUE(nearer.mesh(0).later_points.empty());
    translate_at(
        1,
        stage_text(0.5, "def Xform \"X\" {\n float motion:velocityScale = inf\n" + moving + "}\n"),
        bad);
    EXPECT_EQ(bad.mesh(0).later_points[0][1], Vec3(1, 1, -9));
    EXPECT_EQ(bad.count("bad-motion-scale"), 1u);
}

TEST(Velocities, CarryStrandsAndBallsToTheFrame) {
    Translated t;
    translate_at(1.5, stage_text(0, R"(def Points "B" {
    point3f[] points.timeSamples = { 1: [(0, 0, -9)], 2: [(0, 0, -9)] }
    vector3f[] velocities.timeSamples = { 1: [(32, 0, 0)], 2: [(0, 0, 0)] }
    float[] widths = [1]
}
def BasisCurves "C" {
    uniform token type = "linear"
    int[] curveVertexCounts = [2]
    point3f[] points.timeSamples = { 1: [(0, 0, -9), (0, 1, -9)] }
    vector3f[] velocities.timeSamples = { 1: [(0, 0, 0), (0, 0, 64)] }
    float[] widths = [1]
}
)"),
                 t);
    EXPECT_EQ(t.diagnostics.warning_count(), 0u);
    EXPECT_EQ(std::get<scene::Points>(t.scene.shapes[0].geometry).points[0], Vec3(0.5f, 0, -9));
    EXPECT_EQ(std::get<scene::Curves>(t.scene.shapes[1].geometry).points[1], Vec3(0, 1, -8));
}

}  // namespace velatura::translate::motion
