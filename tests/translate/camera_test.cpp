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
    // 20 x 10 tenths, offsets (2, -1), focal length 40, square image
    expect_window(square + "\"expandAperture\"", {-8 / 40., 12 / 40., -11 / 40., 9 / 40.});
    expect_window(square + "\"cropAperture\"", {-3 / 40., 7 / 40., -6 / 40., 4 / 40.});
    expect_window(square + "\"adjustApertureWidth\"", {-3 / 40., 7 / 40., -6 / 40., 4 / 40.});
    expect_window(square + "\"adjustApertureHeight\"", {-8 / 40., 12 / 40., -11 / 40., 9 / 40.});
    expect_window(square + "\"adjustPixelAspectRatio\"", {-8 / 40., 12 / 40., -6 / 40., 4 / 40.});
    // An image wider than the aperture
    const std::string wide =
        "uniform int2 resolution = (400, 100)\nuniform token aspectRatioConformPolicy = ";
    expect_window(wide + "\"expandAperture\"", {-18 / 40., 22 / 40., -6 / 40., 4 / 40.});
    expect_window(wide + "\"cropAperture\"", {-8 / 40., 12 / 40., -3.5 / 40., 1.5 / 40.});
}

TEST(Camera, AdjustedPixelAspectMakesTheImageFitTheAperture) {
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

/// linearExposureScale = responsivity · time · (iso / 100) · 2^exposure / fStop²
/// (UsdGeomCamera, Camera Exposure Model, OpenUSD 25.05).
TEST(Camera, ExposureIsThatOfAPhotograph) {
    struct Case {
        const char* authored;
        double scale;
    };

    const Case cases[] = {
        {"", 1},
        {"float exposure = -2\n", 0.25},
        {"float exposure:time = 0.5\n", 0.5},
        {"float exposure:iso = 400\n", 4},
        {"float exposure:fStop = 4\n", 1 / 16.},
        {"float exposure:responsivity = 3\n", 3},
        {"float exposure:time = 0.0078125\nfloat exposure:iso = 400\nfloat exposure:fStop = 2\n",
         0.0078125},
        // The aperture of the lens is another one
        {"float fStop = 4\nfloat focusDistance = 3\n", 1},
    };
    for (const Case& c : cases) {
        Translated t;
        translate_text(camera(c.authored), t);
        EXPECT_DOUBLE_EQ(t.scene.camera.exposure_scale, c.scale) << c.authored;
        EXPECT_EQ(t.count("bad-camera-value"), 0u) << c.authored;
    }
    for (const char* bad : {"float exposure:iso = 0\n", "float exposure:time = -1\n",
                            "float exposure:fStop = 0\n", "float exposure:responsivity = nan\n"}) {
        Translated t;
        translate_text(camera(bad), t);
        EXPECT_DOUBLE_EQ(t.scene.camera.exposure_scale, 1) << bad;
        EXPECT_EQ(t.count("bad-camera-value"), 1u) << bad;
    }
}

TEST(Camera, LensMayHaveBlades) {
    const std::string lens = "float fStop = 2\nfloat focusDistance = 5\n";
    Translated t;
    translate_text(camera(lens + "int velatura:lens:blades = 5\nfloat velatura:lens:rotation = 18\n"
                                 "float velatura:lens:roundness = 0.25\n"),
                   t);
    EXPECT_EQ(t.scene.camera.lens_blades, 5);
    EXPECT_EQ(t.scene.camera.lens_rotation_deg, 18.0);
    EXPECT_EQ(t.scene.camera.lens_roundness, 0.25);
    EXPECT_EQ(t.count("bad-camera-value"), 0u);
    Translated round, pinhole;
    translate_text(camera(lens), round);
    EXPECT_EQ(round.scene.camera.lens_blades, 0);
    translate_text(camera("int velatura:lens:blades = 5\n"), pinhole);
    EXPECT_EQ(pinhole.scene.camera.lens_radius, 0.0);
    for (const char* bad :
         {"int velatura:lens:blades = 2\n", "int velatura:lens:blades = -6\n",
          "float velatura:lens:blades = 5.5\n", "float velatura:lens:blades = nan\n"}) {
        Translated b;
        translate_text(camera(lens + bad), b);
        EXPECT_EQ(b.scene.camera.lens_blades, 0) << bad;
        EXPECT_EQ(b.count("bad-camera-value"), 1u) << bad;
    }
    Translated clamped;
    translate_text(camera(lens + "int velatura:lens:blades = 6\nfloat velatura:lens:roundness = 3\n"
                                 "float velatura:lens:rotation = inf\n"),
                   clamped);
    EXPECT_EQ(clamped.scene.camera.lens_roundness, 1.0);
    EXPECT_EQ(clamped.scene.camera.lens_rotation_deg, 0.0);
    EXPECT_EQ(clamped.count("bad-camera-value"), 2u);
}

TEST(Camera, ShutterMayOpenSlowly) {
    TranslateOptions options;
    options.time = 1.0;
    const std::string shutter = "double shutter:open = 0\ndouble shutter:close = 0.5\n";
    Translated t, plain;
    translate_text(camera(shutter + "float2 velatura:shutter:curve = (0.25, 0.5)\n"), t, options);
    EXPECT_EQ(t.scene.camera.shutter_full, 0.25);
    EXPECT_EQ(t.scene.camera.shutter_falling, 0.5);
    translate_text(camera(shutter), plain, options);
    EXPECT_EQ(plain.scene.camera.shutter_full, 0.0);
    EXPECT_EQ(plain.scene.camera.shutter_falling, 1.0);
    for (const char* bad : {"(0.5, 0.25)", "(-0.1, 1)", "(0, 1.5)", "(nan, 1)"}) {
        Translated b;
        translate_text(camera(shutter + "float2 velatura:shutter:curve = " + bad + "\n"), b,
                       options);
        EXPECT_EQ(b.count("bad-camera-value"), 1u) << bad;
        EXPECT_EQ(b.scene.camera.shutter_falling, 1.0) << bad;
    }
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

TEST(Camera, ThatSettingsNameAndIsMissingIsReplacedBySayingByWhich) {
    const std::string settings = "def RenderSettings \"S\" {\n rel camera = </Nope>\n}\n";
    for (const auto& [scene, consequence] :
         {std::pair(camera() + settings, "; </Cam> is used"),
          std::pair(settings, "; one that frames the scene is used")}) {
        Translated t;
        TranslateOptions options;
        options.settings = "/S";
        translate_text(scene, t, options);
        EXPECT_NE(t.messages("unknown-camera").find(consequence), std::string::npos)
            << t.messages("unknown-camera");
    }
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
