// SPDX-License-Identifier: Apache-2.0
#include "support.h"

#include <gtest/gtest.h>

namespace velatura::translate {

namespace {

std::string settings(const std::string& extra) {
    return "#usda 1.0\n(\n renderSettingsPrimPath = \"/S\"\n)\n" +
           camera(
               "float horizontalAperture = 20\nfloat verticalAperture = 10\nfloat focalLength = "
               "40\n"
               "float horizontalApertureOffset = 2\nfloat verticalApertureOffset = -1\n") +
           "def RenderSettings \"S\" {\n rel camera = </Cam>\n" + extra + "\n}\n";
}

struct Window {
    double left, right, bottom, top;
};

void expect_window(const std::string& extra, const Window& w) {
    Translated t;
    translate_text(settings(extra), t);
    ASSERT_EQ(t.error, "");
    EXPECT_DOUBLE_EQ(t.scene.camera.window_left, w.left) << extra;
    EXPECT_DOUBLE_EQ(t.scene.camera.window_right, w.right) << extra;
    EXPECT_DOUBLE_EQ(t.scene.camera.window_bottom, w.bottom) << extra;
    EXPECT_DOUBLE_EQ(t.scene.camera.window_top, w.top) << extra;
}

}  // namespace

TEST(Camera, WindowsOfEveryConformPolicyMatchHandValues) {
    const std::string square =
        "uniform int2 resolution = (100, 100)\nuniform token aspectRatioConformPolicy = ";
    // 20 x 10 tenths, offsets (2, -1), focal length 40, square picture
    expect_window(square + "\"expandAperture\"", {-8 / 40., 12 / 40., -11 / 40., 9 / 40.});
    expect_window(square + "\"cropAperture\"", {-3 / 40., 7 / 40., -6 / 40., 4 / 40.});
    expect_window(square + "\"adjustApertureWidth\"", {-3 / 40., 7 / 40., -6 / 40., 4 / 40.});
    expect_window(square + "\"adjustApertureHeight\"", {-8 / 40., 12 / 40., -11 / 40., 9 / 40.});
    expect_window(square + "\"adjustPixelAspectRatio\"", {-8 / 40., 12 / 40., -6 / 40., 4 / 40.});
    // A picture wider than the aperture
    const std::string wide =
        "uniform int2 resolution = (400, 100)\nuniform token aspectRatioConformPolicy = ";
    expect_window(wide + "\"expandAperture\"", {-18 / 40., 22 / 40., -6 / 40., 4 / 40.});
    expect_window(wide + "\"cropAperture\"", {-8 / 40., 12 / 40., -3.5 / 40., 1.5 / 40.});
}

TEST(Camera, AdjustedPixelAspectMakesThePictureFitTheAperture) {
    Translated t;
    translate_text(settings("uniform int2 resolution = (100, 100)\n"
                            "uniform token aspectRatioConformPolicy = \"adjustPixelAspectRatio\""),
                   t);
    EXPECT_DOUBLE_EQ(t.scene.settings.pixel_aspect_ratio, 2.0);
}

TEST(Camera, LensAndOrthographicWindowAreInSceneUnits) {
    Translated t;
    translate_text(
        camera(
            "float focalLength = 50\nfloat fStop = 2\nfloat focusDistance = 7\nfloat exposure = 3\n"
            "float2 clippingRange = (0.5, 99)"),
        t);
    EXPECT_DOUBLE_EQ(t.scene.camera.lens_radius, 0.1 * 50 / 4);
    EXPECT_DOUBLE_EQ(t.scene.camera.focus_distance, 7);
    EXPECT_DOUBLE_EQ(t.scene.camera.exposure_scale, 8);
    EXPECT_DOUBLE_EQ(t.scene.camera.clip_near, 0.5);
    EXPECT_DOUBLE_EQ(t.scene.camera.clip_far, 99);
    Translated ortho;
    TranslateOptions options;
    options.resolution = {200, 100};
    translate_text(camera("token projection = \"orthographic\"\nfloat horizontalAperture = 20\n"
                          "float verticalAperture = 10"),
                   ortho, options);
    EXPECT_DOUBLE_EQ(ortho.scene.camera.window_right, 1.0);
    EXPECT_DOUBLE_EQ(ortho.scene.camera.window_top, 0.5);
}

TEST(Camera, UnknownCameraIsAnErrorThatListsTheOthers) {
    TranslateOptions options;
    options.camera = "/Nope";
    Translated t;
    translate_text("def Xform \"W\" {\n" + camera() + "}\n", t, options);
    EXPECT_EQ(t.error, "unknown-camera");
    EXPECT_NE(t.error_message.find("</W/Cam>"), std::string::npos) << t.error_message;
    options.camera = "/W";
    Translated wrong_type;
    translate_text("def Xform \"W\" {\n" + camera() + "}\n", wrong_type, options);
    EXPECT_EQ(wrong_type.error, "unknown-camera");
}

TEST(Camera, FramingCameraSeesEveryPoint) {
    Translated t;
    translate_text(
        "def Xform \"W\" {\n double3 xformOp:translate = (1073741824, 5, -9)\n"
        "uniform token[] xformOpOrder = [\"xformOp:translate\"]\n" +
            quad("Q") + "}\n",
        t);
    ASSERT_EQ(t.error, "");
    EXPECT_EQ(t.count("framing-camera"), 1u);
    ASSERT_EQ(t.scene.shapes.size(), 1u);
    const scene::Camera& c = t.scene.camera;
    for (const Vec3& p : t.mesh(0).points) {
        const Vec3d q(p);
        const auto along = [&](int r) {
            return q.x * c.render_from_camera[r][0] + q.y * c.render_from_camera[r][1] +
                   q.z * c.render_from_camera[r][2];
        };
        const double depth = -along(2);
        ASSERT_GT(depth, 0.0);
        EXPECT_LT(std::abs(along(0)), c.window_right * depth);
        EXPECT_LT(std::abs(along(1)), c.window_top * depth);
        EXPECT_LT(depth, 40.0);
    }
}

}  // namespace velatura::translate
