// SPDX-License-Identifier: Apache-2.0
#include "support.h"

#include <gtest/gtest.h>

namespace velatura::translate {

namespace {

const char* const with_products = R"(#usda 1.0
(
    renderSettingsPrimPath = "/Render/S"
)
def Camera "A" {}
def Camera "B" {}
def Scope "Render" {
    def RenderSettings "S" {
        rel camera = </A>
        uniform int2 resolution = (640, 480)
        uniform bool disableDepthOfField = 1
        rel products = [</Render/P>]
    }
    def RenderProduct "P" {
        rel camera = </B>
        token productName = "out.exr"
        rel orderedVars = [</Render/Key>, </Render/Nope>]
    }
    def RenderVar "Key" {
        uniform string sourceName = "C.{2}<L.'key'>"
        uniform token sourceType = "lpe"
        string driver:parameters:aov:name = "b2_key"
    }
}
)";

}  // namespace

TEST(Settings, ProductsOverrideOnlyWhatTheyAuthor) {
    Translated t;
    translate_text(with_products, t);
    ASSERT_EQ(t.error, "");
    EXPECT_EQ(t.scene.settings.width, 640);
    EXPECT_EQ(t.scene.settings.height, 480);
    EXPECT_TRUE(t.scene.settings.disable_depth_of_field);
    EXPECT_EQ(t.scene.settings.camera, "/B");
    ASSERT_EQ(t.scene.settings.products.size(), 1u);
    EXPECT_EQ(t.scene.settings.products[0].name, "out.exr");
    ASSERT_EQ(t.scene.settings.products[0].vars.size(), 1u);
    EXPECT_EQ(t.scene.settings.products[0].vars[0].name, "b2_key");
    EXPECT_EQ(t.scene.settings.products[0].vars[0].source_type, "lpe");
    EXPECT_EQ(t.scene.settings.products[0].vars[0].source_name, "C.{2}<L.'key'>");
    EXPECT_EQ(t.count("unknown-render-var"), 1u);
}

namespace {

/// Two balls, of which a pass shows one.
std::string pass(const std::string& rules) {
    return camera() + R"(def Xform "A" {
    def Sphere "S" {}
}
def Sphere "B" {}
def RenderSettings "R" {
    uniform int2 resolution = (40, 30)
}
def RenderPass "P" {
    rel renderSource = </R>
)" + rules +
           "}\n";
}

}  // namespace

TEST(Settings, RenderPassesShowWhatTheirCollectionsHold) {
    struct Case {
        const char* rules;
        size_t shapes;
    };

    const Case cases[] = {
        {"", 2},
        {"uniform bool collection:renderVisibility:includeRoot = 0\n", 0},
        {"uniform bool collection:renderVisibility:includeRoot = 0\nrel "
         "collection:renderVisibility:includes = </A>\n",
         1},
        {"rel collection:renderVisibility:excludes = </B>\n", 1},
        {"rel collection:prune:includes = </A>\n", 1},
        {"rel collection:matte:includes = </A>\n", 2},
        {"rel collection:cameraVisibility:excludes = </A>\n", 2},
    };
    TranslateOptions options;
    options.settings = "/P";
    for (const Case& c : cases) {
        Translated t;
        translate_text(pass(c.rules), t, options);
        ASSERT_EQ(t.error, "") << t.error_message;
        EXPECT_EQ(t.scene.shapes.size(), c.shapes) << c.rules;
        EXPECT_EQ(t.scene.settings.pass, "/P") << c.rules;
        EXPECT_EQ(t.scene.settings.width, 40) << c.rules;
        EXPECT_EQ(t.scene.settings.name, "/R") << c.rules;
    }
    Translated lost;
    translate_text(camera() + "def RenderPass \"P\" { rel renderSource = </Nope>\n}\n", lost,
                   options);
    EXPECT_EQ(lost.error, "");
    EXPECT_EQ(lost.count("unknown-settings"), 1u);
}

TEST(Settings, PassesHideFromTheCameraAndHoldOut) {
    const auto translated = [](const std::string& rules) {
        TranslateOptions options;
        options.pass = "/P";
        Translated t;
        translate_text(pass(rules + "}\ndef SphereLight \"L\" {\n"), t, options);
        EXPECT_EQ(t.error, "") << t.error_message;
        EXPECT_EQ(t.scene.settings.name, "/R");
        std::string text;
        const auto holds = [&](scene::LinkSetId set, size_t shape, bool otherwise) {
            return set == scene::none ? otherwise
                                      : t.scene.linking.sets[set].holds(t.scene.shapes[shape].link);
        };
        for (size_t i = 0; i < t.scene.shapes.size(); ++i) {
            text += holds(t.scene.linking.visible_to(scene::RayKind::Camera), i, true) ? 'c' : '-';
            text += holds(t.scene.linking.visible_to(scene::RayKind::Diffuse), i, true) ? 'd' : '-';
            text += holds(t.scene.linking.mattes, i, false) ? 'M' : '-';
            text += ' ';
        }
        return text + (t.scene.lights.at(0).is_camera_visible ? "L" : "-");
    };
    // The shapes A/S and B, and the light L
    EXPECT_EQ(translated(""), "cd- cd- L");
    EXPECT_EQ(translated("rel collection:matte:includes = </A>\n"), "cdM cd- L");
    EXPECT_EQ(translated("rel collection:cameraVisibility:excludes = [</A>, </L>]\n"), "-d- cd- -");
    EXPECT_EQ(translated("uniform bool collection:cameraVisibility:includeRoot = 0\nrel "
                         "collection:cameraVisibility:includes = </B>\nrel "
                         "collection:matte:includes = </B>\n"),
              "-d- cdM -");
}

TEST(Settings, APassIsNamedByItsOwnOption) {
    TranslateOptions options;
    options.pass = "/B";
    Translated wrong;
    translate_text(pass(""), wrong, options);
    EXPECT_EQ(wrong.error, "unknown-pass");
    EXPECT_NE(wrong.error_message.find("</B> is not a RenderPass; passes of the stage: </P>"),
              std::string::npos)
        << wrong.error_message;
    // Settings of the command line come before those of the pass
    options.pass = "/P";
    options.settings = "/Other";
    Translated other;
    translate_text(pass("}\ndef RenderSettings \"Other\" {\nuniform int2 resolution = (20, 10)\n"),
                   other, options);
    EXPECT_EQ(other.error, "") << other.error_message;
    EXPECT_EQ(other.scene.settings.width, 20);
    EXPECT_EQ(other.scene.settings.pass, "/P");
    options.settings = "/P";
    Translated twice;
    translate_text(pass(""), twice, options);
    EXPECT_EQ(twice.error, "unknown-settings");
}

TEST(Settings, OptionsBeatSettings) {
    TranslateOptions options;
    options.resolution = {32, 16};
    options.camera = "/A";
    Translated t;
    translate_text(with_products, t, options);
    EXPECT_EQ(t.scene.settings.width, 32);
    EXPECT_EQ(t.scene.settings.height, 16);
    EXPECT_EQ(t.scene.camera.name, "/A");
}

TEST(Settings, BadOnesAreErrors) {
    TranslateOptions options;
    options.resolution = {0, 0};
    Translated t;
    translate_text(with_products, t, options);
    EXPECT_EQ(t.error, "bad-resolution");
    TranslateOptions missing;
    missing.settings = "/Render/P";
    Translated u;
    translate_text(with_products, u, missing);
    EXPECT_EQ(u.error, "unknown-settings");
}

TEST(Settings, ResolutionsOutOfRangeAreErrorsUnlessOverridden) {
    const auto text = [](const char* size) {
        return "#usda 1.0\n(\n renderSettingsPrimPath = \"/R\"\n)\n" + camera() +
               "def RenderSettings \"R\" {\n uniform int2 resolution = " + size + "\n}\n";
    };
    for (const char* size : {"(65537, 4)", "(4, 0)", "(-3, 4)", "(2147483647, 2147483647)"}) {
        Translated t;
        translate_text(text(size), t);
        EXPECT_EQ(t.error, "bad-resolution") << size;
        EXPECT_NE(t.error_message.find(":9:"), std::string::npos) << t.error_message;
        TranslateOptions options;
        options.resolution = {32, 16};
        Translated asked;
        translate_text(text(size), asked, options);
        EXPECT_EQ(asked.error, "");
        EXPECT_EQ(asked.scene.settings.width, 32);
    }
    Translated largest;
    translate_text(text("(65536, 1)"), largest);
    EXPECT_EQ(largest.error, "");
    EXPECT_EQ(largest.scene.settings.width, 65536);
}

TEST(Settings, WhatIsNotFiniteGivesWayToFallbacks) {
    Translated t;
    translate_text("#usda 1.0\n(\n renderSettingsPrimPath = \"/R\"\n)\n" +
                       camera("float horizontalAperture = inf\nfloat fStop = nan\n"
                              "float horizontalApertureOffset = nan") +
                       R"(def RenderSettings "R" {
    uniform float4 dataWindowNDC = (nan, 0, 1, 1)
    uniform float pixelAspectRatio = inf
}
)",
                   t);
    ASSERT_EQ(t.error, "");
    EXPECT_EQ(t.scene.settings.data_window_ndc, (std::array<double, 4>{0, 0, 1, 1}));
    EXPECT_EQ(t.scene.settings.pixel_aspect_ratio, 1.0);
    EXPECT_EQ(t.scene.camera.lens_radius, 0.0);
    EXPECT_EQ(t.scene.camera.window_left, -t.scene.camera.window_right);
    EXPECT_EQ(t.count("bad-data-window"), 1u);
    EXPECT_EQ(t.count("bad-pixel-aspect"), 1u);
    EXPECT_EQ(t.count("bad-camera-value"), 3u);
}

TEST(Settings, PurposesChooseWhatIsSeen) {
    const std::string text = camera() + "def Xform \"G\" {\n token purpose = \"guide\"\n" +
                             quad("Q") + "}\ndef Xform \"R\" {\n token purpose = \"render\"\n" +
                             quad("Q") + "}\n";
    Translated t;
    translate_text(text, t);
    ASSERT_EQ(t.scene.shapes.size(), 1u);
    EXPECT_EQ(t.scene.provenance[t.scene.shapes[0].provenance].prim_path, "/R/Q");
    TranslateOptions options;
    options.purposes = {"guide"};
    Translated guides;
    translate_text(text, guides, options);
    ASSERT_EQ(guides.scene.shapes.size(), 1u);
    EXPECT_EQ(guides.scene.provenance[guides.scene.shapes[0].provenance].prim_path, "/G/Q");
}

}  // namespace velatura::translate
