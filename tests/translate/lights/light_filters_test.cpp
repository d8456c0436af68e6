// SPDX-License-Identifier: Apache-2.0
// Light filters of other renderers in Velatura's terms. Oracle: the documentation of RenderMan,
// Arnold, Karma and MoonRay (docs/reference/light_filters.md).
#include "translate/support.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <variant>

namespace velatura::translate::lights {

namespace {

/// A light of intensity 1 with a filter of the type, and what the filter says.
std::string filtered(const std::string& type,
                     const std::string& body,
                     const std::string& light = "") {
    return camera() + quad("Q") +
           "def SphereLight \"L\" (prepend apiSchemas = [\"ShapingAPI\"]) {\n" + light +
           "rel light:filters = </F>\n}\ndef " + type + " \"F\" {\n" + body + "\n}\n";
}

std::string with_id(const std::string& id, const std::string& body) {
    return "uniform token lightFilter:shaderId = \"" + id + "\"\n" + body;
}

/// Notes, of what is not authored, are none.
size_t warnings_of(const Translated& t) {
    size_t count = 0;
    for (const Diagnostic& diagnostic : t.diagnostics.all())
        count += diagnostic.severity != Severity::Note;
    return count;
}

struct Filters {
    Translated t;

    explicit Filters(const std::string& text) {
        translate_text(text, t);
        EXPECT_EQ(t.error, "");
        EXPECT_FALSE(t.scene.lights.empty());
    }

    const std::vector<scene::LightFilter>& all() const { return t.scene.lights.at(0).filters; }

    template <class Shape>
    const Shape& shape(size_t i = 0) const {
        return std::get<Shape>(all().at(i).shape);
    }

    size_t warnings() const { return warnings_of(t); }
};

Vec3d origin_of(const scene::LightFilter& filter) {
    const Mat4d& m = filter.parent_from_filter;
    return {m[3][0], m[3][1], m[3][2]};
}

const char* const placed =
    "double3 xformOp:translate = (1, 2, 3)\nuniform token[] xformOpOrder = "
    "[\"xformOp:translate\"]\n";
const char* const cone = "float inputs:shaping:cone:angle = 45\n";

}  // namespace

TEST(LightFilters, OfRenderManByItsOldAndNewNames) {
    for (const bool is_new : {false, true}) {
        const std::string prefix = is_new ? "inputs:ri:lightFilter:" : "inputs:";
        const auto name = [&](const char* old_name, const char* new_name) {
            return "float " + prefix + (is_new ? new_name : old_name) + " = ";
        };
        const Filters f(filtered(
            "LightFilter",
            with_id("PxrBarnLightFilter",
                    placed + name("width", "width") + "2\n" + name("height", "height") + "3\n" +
                        name("edgeThickness", "edge") + "0.25\n" + name("refine:left", "left") +
                        "0.5\n" + name("edgeScale:top", "topEdge") + "2\n" +
                        name("scale:width", "scaleWidth") + "4\n" + name("ri:density", "density") +
                        "0.75\n" + name("radius", "radius") + "0.1\n")));
        EXPECT_EQ(f.warnings(), 0u);
        ASSERT_EQ(f.all().size(), 1u);
        const auto& doors = f.shape<scene::BarnDoorFilter>();
        EXPECT_EQ(doors.projection.kind, scene::FilterProjection::Kind::Segment);
        EXPECT_EQ(doors.opening.lower, Vec3(-1.5f, -1.5f, 0));
        EXPECT_EQ(doors.opening.upper, Vec3(1.0f, 1.5f, 0));
        EXPECT_EQ(doors.opening.radius, 0.1f);
        EXPECT_EQ(doors.opening.edge, 0.25f);
        EXPECT_EQ(doors.opening.edge_upper.y, 2.0f);
        EXPECT_EQ(doors.opening.scale, Vec3(4, 1, 1));
        EXPECT_EQ(f.all()[0].density, 0.75f);
        EXPECT_EQ(f.all()[0].name, "/F");
        EXPECT_EQ(origin_of(f.all()[0]), Vec3d(1, 2, 3));
    }
}

TEST(LightFilters, OfRenderManInAllKinds) {
    const Filters intensity(filtered(
        "PxrIntMultLightFilter",
        "float inputs:ri:lightFilter:intensity = 3\nfloat inputs:ri:lightFilter:exposure = "
        "1\nfloat inputs:ri:lightFilter:saturation = 0.5\nfloat inputs:ri:lightFilter:diffuse = "
        "1"));
    EXPECT_EQ(intensity.all().at(0).tint, Rgb(6.0f));
    EXPECT_EQ(intensity.all().at(0).saturation, 0.5f);
    EXPECT_EQ(intensity.warnings(), 0u);

    const Filters rod(filtered("PxrRodLightFilter",
                               "float inputs:ri:lightFilter:depth = 4\nbool "
                               "inputs:ri:lightFilter:invert = 1"));
    EXPECT_EQ(rod.shape<scene::RodFilter>().box.upper, Vec3(0.5f, 0.5f, 2.0f));
    EXPECT_EQ(rod.all()[0].tint, Rgb(0.0f));
    EXPECT_TRUE(rod.all()[0].is_inverted);

    const Filters ramp(filtered(
        "PxrRampLightFilter",
        "int inputs:ri:lightFilter:rampType = 2\nfloat inputs:ri:lightFilter:beginDist = 1\nfloat "
        "inputs:ri:lightFilter:endDist = 5\nfloat[] inputs:ri:lightFilter:ramp_Knots = [0, 0.5, "
        "1]\nfloat[] inputs:ri:lightFilter:ramp_Floats = [1, 0.75, 0]\ncolor3f[] "
        "inputs:ri:lightFilter:colorRamp_Colors = [(1, 0, 0), (0, 1, 0)]\nfloat[] "
        "inputs:ri:lightFilter:colorRamp_Knots = [0, 1]"));
    ASSERT_EQ(ramp.all().size(), 2u);
    const auto& colors = ramp.shape<scene::RampFilter>(0);
    EXPECT_EQ(colors.measure, scene::RampFilter::Measure::FromPoint);
    EXPECT_EQ(colors.begin, 1.0f);
    EXPECT_EQ(colors.end, 5.0f);
    EXPECT_EQ(colors.colors[1], Rgb(0, 1, 0));
    EXPECT_EQ(ramp.shape<scene::RampFilter>(1).colors[1], Rgb(0.75f));

    const Filters gobo(filtered(
        "PxrCookieLightFilter",
        "string inputs:ri:lightFilter:map = \"/leaves.tex\"\nfloat inputs:ri:lightFilter:width = "
        "2\ncolor3f inputs:ri:lightFilter:fillColor = (1, 0, 0)\nint "
        "inputs:ri:lightFilter:tileMode = 2"));
    EXPECT_EQ(gobo.shape<scene::GoboFilter>().texture_file, "/leaves.tex");
    EXPECT_EQ(gobo.shape<scene::GoboFilter>().fill, Rgb(1, 0, 0));
    EXPECT_EQ(gobo.shape<scene::GoboFilter>().outside, scene::GoboFilter::Outside::Repeat);
    EXPECT_EQ(gobo.warnings(), 0u);
}

TEST(LightFilters, OfArnoldAsTargetsAndByNodeGraphs) {
    const std::string doors =
        "uniform token info:id = \"arnold:barndoor\"\nfloat inputs:barndoor_top_left = "
        "0.25\nfloat inputs:barndoor_top_right = 0.25\nfloat inputs:barndoor_top_edge = "
        "0.125\nfloat inputs:barndoor_right_top = 1\nfloat inputs:barndoor_left_top = 0.25\n";
    const std::string graph =
        "def \"G\" {\ntoken outputs:filters:i1.connect = "
        "</G/F.outputs:shader>\ndef Shader \"F\" {\n" +
        doors + "token outputs:shader\n}\n}\n";
    const std::string by_graph =
        camera() + quad("Q") + "def SphereLight \"L\" (prepend apiSchemas = [\"ShapingAPI\"]) {\n" +
        cone + "string primvars:arnold:shaders = \"/G\"\n}\n" + graph;
    for (const std::string& text : {filtered("Shader", doors, cone), by_graph}) {
        const Filters f(text);
        ASSERT_EQ(f.all().size(), 1u);
        EXPECT_EQ(f.warnings(), 0u) << f.t.messages("unsupported-light-filter-input");
        const auto& b = f.shape<scene::BarnDoorFilter>();
        EXPECT_EQ(b.projection.kind, scene::FilterProjection::Kind::Point);
        // The square around the cone is 2 wide at distance 1; the edge lies within the flap's line
        EXPECT_NEAR(b.opening.upper.y, 0.5f - 0.25f, 1e-6);
        EXPECT_NEAR(b.opening.edge * b.opening.edge_upper.y, 0.25f, 1e-6);
        EXPECT_TRUE(std::isinf(b.opening.lower.y));
        EXPECT_TRUE(std::isinf(b.opening.upper.x));
        // From −0.5 at the top to −1 at the bottom
        EXPECT_NEAR(b.opening.lower.x, -0.75f, 1e-6);
        EXPECT_NEAR(b.slope_lower.x, 0.25f, 1e-6);
        EXPECT_EQ(origin_of(f.all()[0]), Vec3d(0, 0, -1));
    }
    const Filters open(filtered("Shader", doors));
    EXPECT_TRUE(open.all().empty());
    EXPECT_EQ(open.t.count("unsupported-light-filter"), 1u);
}

TEST(LightFilters, OfArnoldInAllKinds) {
    const Filters decay(filtered(
        "LightFilter",
        with_id("arnold:light_decay",
                "bool inputs:use_near_atten = 1\nfloat inputs:near_start = 1\nfloat "
                "inputs:near_end = 2\nbool inputs:use_far_atten = 0\nfloat inputs:far_end = 9\n")));
    ASSERT_EQ(decay.all().size(), 1u);
    EXPECT_EQ(decay.shape<scene::RampFilter>().begin, 1.0f);
    EXPECT_EQ(decay.shape<scene::RampFilter>().end, 2.0f);
    EXPECT_EQ(decay.shape<scene::RampFilter>().colors[0], Rgb(0.0f));

    const Filters blocker(filtered(
        "LightFilter",
        with_id("arnold:light_blocker",
                "token inputs:geometry_type = \"sphere\"\nfloat inputs:density = 0.5\nmatrix4d "
                "inputs:geometry_matrix = ( (2, 0, 0, 0), (0, 2, 0, 0), (0, 0, 2, 0), (4, 5, 6, 1) "
                ")\nfloat inputs:width_edge = 0.5")));
    ASSERT_EQ(blocker.all().size(), 1u);
    EXPECT_EQ(blocker.shape<scene::RodFilter>().box.radius, 0.5f);
    EXPECT_EQ(blocker.shape<scene::RodFilter>().box.upper, Vec3(0.0f));
    EXPECT_EQ(blocker.all()[0].density, 0.5f);
    EXPECT_EQ(origin_of(blocker.all()[0]), Vec3d(4, 5, 6));
    EXPECT_EQ(blocker.t.count("unsupported-light-filter-input"), 1u);

    const Filters gobo(
        filtered("LightFilter",
                 with_id("arnold:gobo",
                         "asset inputs:slidemap.connect = "
                         "</F/Image.outputs:rgb>\nfloat inputs:rotate = 30\nfloat2 "
                         "inputs:offset = (0.25, 0)\ntoken inputs:swrap = "
                         "\"periodic\"\ntoken inputs:twrap = \"periodic\"\ndef Shader "
                         "\"Image\" {\nuniform token info:id = \"arnold:image\"\nasset "
                         "inputs:filename = @/leaves.exr@\ncolor3f outputs:rgb\n}"),
                 cone));
    ASSERT_EQ(gobo.all().size(), 1u);
    const auto& shape = gobo.shape<scene::GoboFilter>();
    EXPECT_EQ(shape.texture_file, "/leaves.exr");
    EXPECT_NEAR(shape.width, 2.0f, 1e-6);
    EXPECT_EQ(shape.rotation_deg, 30.0f);
    EXPECT_EQ(shape.uv_offset, Vec2(0.25f, 0.0f));
    EXPECT_EQ(shape.outside, scene::GoboFilter::Outside::Repeat);
}

TEST(LightFilters, OfHoudiniAreAttributesOfTheLight) {
    const std::string text = camera() + quad("Q") +
                             "def SphereLight \"L\" (prepend apiSchemas = [\"ShapingAPI\"]) {\n" +
                             cone + "float barndoorleft = 0.25\nfloat barndoorbottom = 0\n}\n";
    const Filters f(text);
    ASSERT_EQ(f.all().size(), 1u);
    EXPECT_NEAR(f.shape<scene::BarnDoorFilter>().opening.lower.x, -0.5f, 1e-6);
    EXPECT_EQ(f.shape<scene::BarnDoorFilter>().slope_lower, Vec2(0.0f));
    EXPECT_EQ(f.warnings(), 0u);
    const Filters karma(filtered("LightFilter",
                                 with_id("kma_lfilter_barndoor",
                                         "float inputs:top = 0.5\nfloat inputs:topedge = "
                                         "0.25\ncolor3f inputs:tint = (1, 0.5, 0)"),
                                 cone));
    EXPECT_NEAR(karma.shape<scene::BarnDoorFilter>().opening.upper.y, -0.5f, 1e-6);
    EXPECT_EQ(karma.all()[0].tint, Rgb(1, 0.5f, 0));
}

TEST(LightFilters, OfMoonRay) {
    const auto moonray = [](const std::string& kind, const std::string& body,
                            const std::string& light = "") {
        return Filters(filtered("MoonrayLightFilter",
                                "uniform token moonray:class = \"" + kind + "\"\n" + placed + body,
                                light));
    };
    const Filters decay = moonray("DecayLightFilter",
                                  "bool moonray:falloff_near = true\nbool moonray:falloff_far = "
                                  "true\nfloat moonray:near_start = 3\nfloat moonray:near_end = "
                                  "5\nfloat moonray:far_start = 4\nfloat moonray:far_end = 9\n");
    ASSERT_EQ(decay.all().size(), 2u);
    EXPECT_EQ(decay.shape<scene::RampFilter>(1).begin, 5.0f);
    EXPECT_EQ(decay.shape<scene::RampFilter>(1).end, 9.0f);
    EXPECT_EQ(decay.warnings(), 0u);

    const Filters rod = moonray("RodLightFilter",
                                "float moonray:depth = 10\nfloat moonray:radius = 2\ncolor3f "
                                "moonray:color = (1, 0, 0.25)\nfloat moonray:edge = 2");
    EXPECT_EQ(rod.shape<scene::RodFilter>().box.upper, Vec3(0.5f, 0.5f, 5.0f));
    EXPECT_EQ(rod.all()[0].tint, Rgb(1, 0, 0.25f));
    EXPECT_EQ(origin_of(rod.all()[0]), Vec3d(1, 2, 3));

    const Filters doors = moonray("BarnDoorLightFilter",
                                  "float moonray:projector_height = 0.5\nfloat "
                                  "moonray:projector_focal_distance = 8\ntoken moonray:mode = "
                                  "\"physical\"\nfloat moonray:radius = 0.5\nfloat moonray:edge = "
                                  "0.25\ntoken moonray:pre_barn_mode = \"black\"");
    const auto& opening = doors.shape<scene::BarnDoorFilter>().opening;
    // 8 wide and 4 high, the corners within
    EXPECT_EQ(opening.radius, 1.0f);
    EXPECT_EQ(opening.upper, Vec3(3.0f, 1.0f, 0));
    EXPECT_EQ(opening.edge, 1.0f);
    EXPECT_EQ(origin_of(doors.all()[0]), Vec3d(0, 0, -8));
    EXPECT_EQ(doors.shape<scene::BarnDoorFilter>().projection.before,
              scene::FilterProjection::Before::Black);

    const Filters ramp = moonray("ColorRampLightFilter",
                                 "color3f[] moonray:colors = [(0, 0, 1), (1, 0, 0)]\nfloat[] "
                                 "moonray:distances = [4, 8]\nint[] moonray:interpolation_types = "
                                 "[0, 0]");
    EXPECT_EQ(ramp.shape<scene::RampFilter>().interpolation,
              scene::RampFilter::Interpolation::Constant);
    EXPECT_EQ(origin_of(ramp.all()[0]), Vec3d(0.0));
    EXPECT_EQ(ramp.warnings(), 0u);
}

TEST(LightFilters, ThatAreNotSimulatedAreNamed) {
    const Filters unknown(filtered("LightFilter", with_id("VdbLightFilter", "")));
    EXPECT_TRUE(unknown.all().empty());
    EXPECT_EQ(unknown.t.count("unsupported-light-filter"), 1u);
    EXPECT_NE(unknown.t.messages("unsupported-light-filter").find("</L>"), std::string::npos);
    const Filters input(filtered("PxrRodLightFilter",
                                 "float inputs:ri:lightFilter:specular = 0\nfloat "
                                 "inputs:ri:lightFilter:shiny = 1\nstring "
                                 "inputs:ri:lightFilter:linkingGroups = \"\""));
    EXPECT_EQ(input.t.count("unsupported-light-filter-input"), 2u);
    EXPECT_EQ(input.all().size(), 1u);
    Translated missing;
    translate_text(camera() + quad("Q") + "def SphereLight \"L\" { rel light:filters = </N>; }\n",
                   missing);
    EXPECT_EQ(missing.count("bad-light-filter"), 1u);
    Translated itself;
    translate_text(camera() + quad("Q") + "def SphereLight \"L\" { rel light:filters = </L>; }\n",
                   itself);
    EXPECT_EQ(itself.count("bad-light-filter"), 1u);
    EXPECT_NE(itself.messages("bad-light-filter").find("the light itself"), std::string::npos);
    const Filters flat(filtered("PxrRodLightFilter",
                                "double3 xformOp:scale = (1, 0, 1)\nuniform token[] xformOpOrder "
                                "= [\"xformOp:scale\"]"));
    EXPECT_TRUE(flat.all().empty());
    EXPECT_EQ(flat.t.count("bad-transform"), 1u);
}

/// The rest of the light goes on, and the message names the filter.
TEST(LightFilters, NumbersThatAreNoneAreRefused) {
    for (const char* inputs : {"float inputs:ri:lightFilter:exposure = 200",
                               "float inputs:ri:lightFilter:exposure = inf",
                               "color3f inputs:ri:lightFilter:color = (1e38, 1, 1)\nfloat "
                               "inputs:ri:lightFilter:intensity = 1e30"}) {
        const Filters filter(filtered("PxrIntMultLightFilter", inputs));
        EXPECT_GE(filter.t.count("bad-light-filter"), 1u) << inputs;
        for (const scene::LightFilter& f : filter.all()) EXPECT_TRUE(is_finite(f.tint)) << inputs;
    }
    const auto ramp = [](const std::string& knots, const std::string& values) {
        return Filters(filtered("PxrRampLightFilter",
                                "float[] inputs:ri:lightFilter:ramp_Knots = " + knots +
                                    "\nfloat[] inputs:ri:lightFilter:ramp_Floats = " + values));
    };
    EXPECT_EQ(ramp("[0, 1]", "[1, 0.5]").warnings(), 0u);
    for (const Filters& wrong :
         {ramp("[0, 1]", "[nan, 1]"), ramp("[0, nan]", "[0, 1]"), ramp("[1, 0]", "[0, 1]"),
          ramp("[0, 0.5, 1]", "[0, 1]"), ramp("[0, 1]", "[inf, 1]")}) {
        EXPECT_EQ(wrong.t.count("bad-light-filter"), 1u);
        for (const scene::LightFilter& f : wrong.all())
            for (const Rgb& color : std::get<scene::RampFilter>(f.shape).colors)
                EXPECT_TRUE(is_finite(color));
    }
}

TEST(LightFilters, StandRelativeToTheCameraAndGoWithInstances) {
    const std::string lamp =
        "def Xform \"Lamp\" {\ndef SphereLight \"L\" { rel light:filters = <../F>; }\ndef "
        "PxrRodLightFilter \"F\" {\n" +
        std::string(placed) + "}\n}\n";
    const std::string far_camera =
        "def Camera \"Cam\" {\ndouble3 xformOp:translate = (0, 0, 10)\nuniform token[] "
        "xformOpOrder = [\"xformOp:translate\"]\n}\n";
    Translated direct;
    translate_text(far_camera + lamp, direct);
    ASSERT_EQ(direct.scene.lights.size(), 1u);
    EXPECT_EQ(origin_of(direct.scene.lights[0].filters.at(0)), Vec3d(1, 2, -7));
    Translated instanced;
    translate_text(far_camera + "def \"Class\" {\n" + lamp + "}\n" +
                       "def Xform \"A\" (instanceable = true\nreferences = </Class>) {\ndouble3 "
                       "xformOp:translate = (5, 0, 0)\nuniform token[] xformOpOrder = "
                       "[\"xformOp:translate\"]\n}\n",
                   instanced);
    bool is_found = false;
    for (const scene::Light& light : instanced.scene.lights) {
        ASSERT_EQ(light.filters.size(), 1u);
        const Vec3d at = origin_of(light.filters[0]);
        is_found = is_found || (at - Vec3d(6, 2, -7)).length() < 1e-12;
    }
    EXPECT_TRUE(is_found);
}

TEST(LightFilters, ActOnWhatTheyAreLinkedTo) {
    const std::string links =
        "uniform bool collection:filterLink:includeRoot = 0\nrel collection:filterLink:includes = "
        "</A>\n";
    const std::string body = camera() + quad("A") + quad("B") +
                             "def SphereLight \"L\" { rel light:filters = [</F>, </G>]; }\ndef "
                             "PxrRodLightFilter \"F\" {\n" +
                             links + "}\ndef PxrIntMultLightFilter \"G\" {\n}\n";
    Translated t;
    translate_text(body, t);
    ASSERT_EQ(t.scene.lights.size(), 2u);
    const scene::Light &first = t.scene.lights[0], &second = t.scene.lights[1];
    EXPECT_EQ(first.filters.size(), 2u);
    EXPECT_EQ(second.filters.size(), 1u);
    EXPECT_FALSE(first.is_filter_copy);
    EXPECT_TRUE(second.is_filter_copy);
    EXPECT_TRUE(first.is_camera_visible);
    EXPECT_FALSE(second.is_camera_visible);
    EXPECT_EQ(first.group, second.group);
    const scene::LinkClass a = t.scene.shapes[0].link, b = t.scene.shapes[1].link;
    const auto& sets = t.scene.linking.sets;
    EXPECT_TRUE(sets.at(first.links.lit).holds(a));
    EXPECT_FALSE(sets.at(first.links.lit).holds(b));
    EXPECT_FALSE(sets.at(second.links.lit).holds(a));
    EXPECT_TRUE(sets.at(second.links.lit).holds(b));
    EXPECT_EQ(warnings_of(t), 0u);
    // A filter of nothing is none, one of everything needs no links
    Translated none, all;
    translate_text(
        filtered("PxrRodLightFilter", "uniform bool collection:filterLink:includeRoot = 0"), none);
    ASSERT_EQ(none.scene.lights.size(), 1u);
    EXPECT_TRUE(none.scene.lights[0].filters.empty());
    translate_text(filtered("PxrRodLightFilter", "rel collection:filterLink:excludes = </Nobody>"),
                   all);
    ASSERT_EQ(all.scene.lights.size(), 1u);
    EXPECT_EQ(all.scene.lights[0].filters.size(), 1u);
    EXPECT_TRUE(all.scene.linking.sets.empty());
}

}  // namespace velatura::translate::lights
