// SPDX-License-Identifier: Apache-2.0
// luxtest (https://github.com/anderslanglands/luxtest): UsdLux parameter sweeps. Every frame of
// every sheet, through composition, translation and the path tracer with the sheet's own camera,
// against irradiance in closed form. What comes out otherwise is listed here, with the reason.
#include "lux_forms.h"
#include "lux_render.h"
#include "lux_sheet.h"
#include "test_assets.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <set>

namespace velatura::test {

namespace {

using nlohmann::json;

// ---- Frames that differ, each with its reason ----

enum class Difference { None, FocusAboutAxis };

struct DifferentFrames {
    const char* sheet;
    int first, last;
    Difference difference;
};

/// Frames that are not what the schema's text says; every other frame must be.
constexpr DifferentFrames different_frames[] = {
    {"cylinder", 26, 30, Difference::FocusAboutAxis},
    {"cylinder", 37, 40, Difference::FocusAboutAxis},
    {"cylinder", 42, 45, Difference::FocusAboutAxis},
    {"cylinder", 46, 49, Difference::FocusAboutAxis},
    {"sphere", 26, 30, Difference::FocusAboutAxis},
    {"sphere", 37, 40, Difference::FocusAboutAxis},
    {"sphere", 42, 45, Difference::FocusAboutAxis},
    {"sphere", 46, 49, Difference::FocusAboutAxis},
    {"rect", 26, 30, Difference::FocusAboutAxis},
    {"disk", 26, 30, Difference::FocusAboutAxis},
};

const char* reason_of(Difference difference) {
    switch (difference) {
        case Difference::None:
            return "as UsdLux says";
        case Difference::FocusAboutAxis:
            return "focus turns around the light's -Z as in OpenUSD's hdEmbree, not around the "
                   "surface normal as in the schema's text";
    }
    return "";
}

Difference difference_of(const std::string& sheet, int frame) {
    for (const DifferentFrames& d : different_frames) {
        if (d.sheet == sheet && frame >= d.first && frame <= d.last) return d.difference;
    }
    return Difference::None;
}

// ---- Sheets ----

/// Relative deviation that every comparison must be able to see and must stay below; of the value,
/// or of `dim_share` of the brightest point of the frame where that is more.
constexpr double relative_bound = 1e-2;
constexpr double dim_share = 0.2;

/// A plane of the scene that is looked at.
struct Receiver {
    Vec3d normal;  ///< of the plane through the origin
    std::vector<Vec3d> points;
    double albedo = 0;  ///< of what lies there
};

/// Under the four area lights: on the axis, beside, behind, far along -Z for narrow cones, and on
/// the +Z side for lights that are turned around.
const std::vector<Vec3d> lit_points = {{0, 0, -1},      {0.8, 0, -0.45}, {-1.3, 0, -2.2},
                                       {0.15, 0, -3.6}, {0.5, 0, 1.1},   {-0.9, 0, 0.9}};
/// In front of the wall of the IES sheets.
const std::vector<Vec3d> wall_points = {{0.3, 0, -0.6}, {-0.4, 0, -0.9}};

const std::set<int> stripe_frames = {4, 9, 13, 14};  ///< of ies_scale

constexpr double no_material = 0.5;  ///< gray of shapes without material or color

const std::map<std::string, Receiver> receivers = {
    {"rect", {{0, 1, 0}, lit_points, no_material}},
    {"disk", {{0, 1, 0}, lit_points, no_material}},
    {"sphere", {{0, 1, 0}, lit_points, no_material}},
    {"cylinder", {{0, 1, 0}, lit_points, no_material}},
    {"distant", {{0, 1, 0}, {{0, 0, 0}, {2.5, 0, -3}}, no_material}},
    {"iesDown", {{0, 1, 0}, wall_points, no_material}},
    {"iesLibPreview", {{0, 1, 0}, wall_points, no_material}},
    {"iesUp", {{0, -1, 0}, wall_points, 1}},
    {"ies_scale", {{0, 1, 0}, {{0.3, 0, 0.2}, {-0.2, 0, 1.3}}, 1}},
};

// ---- Comparison ----

/// Below this share of the value noise says nothing: rounding in float, and what BSDF sampling
/// should find of a sun of half a degree (2e-5 by its MIS weight) and seldom does.
constexpr double unseen_share = 5e-5;

/// How far a frame is from what was expected, over its points and channels.
struct Comparison {
    double worst_sigma = 0;       ///< deviation ÷ standard error
    double worst_relative = 0;    ///< deviation ÷ scale
    double worst_detectable = 0;  ///< smallest error that would be seen ÷ scale
    bool agrees = true;
};

/// What deviations count against, per point and channel: the value, or dim_share of the brightest
/// point; 0 where nothing at all may come.
std::vector<Vec3d> scales(const std::vector<Irradiance>& expected) {
    Vec3d brightest(0.0);
    for (const Irradiance& e : expected) {
        for (int c = 0; c < 3; ++c) brightest[c] = std::max(brightest[c], e.value[c]);
    }
    std::vector<Vec3d> out;
    for (const Irradiance& e : expected) {
        out.emplace_back(0.0);
        for (int c = 0; c < 3; ++c) {
            if (e.value[c] > 0) out.back()[c] = std::max(e.value[c], dim_share * brightest[c]);
        }
    }
    return out;
}

Comparison compare(const std::vector<RadianceEstimate>& measured,
                   const std::vector<Irradiance>& expected,
                   const Receiver& receiver) {
    const std::vector<Vec3d> scale = scales(expected);
    const double to_irradiance = pi_d / receiver.albedo;
    Comparison result;
    for (size_t i = 0; i < expected.size(); ++i) {
        for (int c = 0; c < 3; ++c) {
            const double deviation =
                std::abs(measured[i].mean[c] * to_irradiance - expected[i].value[c]);
            const double error = measured[i].standard_error[c] * to_irradiance;
            if (!(scale[i][c] > 0)) {
                result.agrees &= deviation == 0;
                continue;
            }
            result.worst_relative = std::max(result.worst_relative, deviation / scale[i][c]);
            result.worst_detectable =
                std::max(result.worst_detectable, detectable_sigmas * error / scale[i][c]);
            if (deviation > unseen_share * scale[i][c] + expected[i].uncertainty)
                result.worst_sigma = std::max(result.worst_sigma, deviation / error);
        }
    }
    result.agrees &= result.worst_sigma <= 4.0 && result.worst_relative <= relative_bound;
    return result;
}

/// Scene of a frame without what stands in the light's way and with matte surfaces: what is
/// measured is the light.
scene::Scene prepared_scene(const LuxSheet& sheet, double frame, std::set<std::string>& warnings) {
    scene::Scene scene = translate_frame(sheet.stage(), frame, warnings);
    std::erase_if(scene.shapes, [&](const scene::Shape& shape) {
        return scene.provenance[shape.provenance].prim_path.starts_with("/smallAngledRect");
    });
    for (scene::Material& material : scene.materials) material.has_specular = false;
    return scene;
}

std::vector<Irradiance> expected_irradiance(const LuxLight& light,
                                            const std::vector<PixelWindow>& windows,
                                            const Vec3d& n,
                                            FocusAbout about) {
    std::vector<Irradiance> out;
    double brightest = 0, worst = 0;
    for (const PixelWindow& window : windows) {
        out.push_back(irradiance(light, window.position, n, about));
        for (int c = 0; c < 3; ++c) brightest = std::max(brightest, out.back().value[c]);
        worst = std::max(worst, out.back().uncertainty);
    }
    EXPECT_LE(worst, 0.2 * relative_bound * brightest) << "the quadrature is too coarse";
    return out;
}

/// Renders one frame and compares it with what its entry in the table above promises.
void check_frame(const LuxSheet& sheet, const Receiver& receiver, int frame) {
    const std::string what = fmt::format("{} frame {}", sheet.name(), frame);
    SCOPED_TRACE(what);
    std::set<std::string> warnings;
    const scene::Scene scene = prepared_scene(sheet, frame, warnings);
    const LuxLight light = sheet.light(frame);
    ASSERT_TRUE(!light.kelvin || usd_blackbody(*light.kelvin)) << "a temperature more";
    const Difference difference = difference_of(sheet.name(), frame);
    EXPECT_EQ(light.kelvin.value_or(6500) > 10000, warnings.contains("color-temperature-clamped"));

    const FrameRenderer renderer(scene);
    std::vector<PixelWindow> windows;
    for (const Vec3d& p : receiver.points)
        windows.push_back(renderer.window_at(p, receiver.normal));
    const bool is_about_axis = difference == Difference::FocusAboutAxis;
    const auto expected =
        expected_irradiance(light, windows, receiver.normal,
                            is_about_axis ? FocusAbout::LightAxis : FocusAbout::SurfaceNormal);
    const std::vector<Vec3d> scale = scales(expected);
    std::vector<RadianceEstimate> measured;
    for (size_t i = 0; i < windows.size(); ++i) {
        const Vec3d visible = scale[i] * (relative_bound * receiver.albedo / pi_d);
        measured.push_back(renderer.measure(windows[i], 1, visible));
    }
    const Comparison result = compare(measured, expected, receiver);
    fmt::print("{:14} {:3}  deviation {:.1e} ({:.1f} sigma) detectable {:.1e} bound {:.0e}  {}\n",
               sheet.name(), frame, result.worst_relative, result.worst_sigma,
               result.worst_detectable, relative_bound, reason_of(difference));
    EXPECT_TRUE(result.agrees) << reason_of(difference);
    // Where the edge of a stripe of a profile passes the point hardly two samples see the same
    const bool is_at_edge = sheet.name() == "ies_scale" && stripe_frames.contains(frame);
    EXPECT_LE(result.worst_detectable, is_at_edge ? 0.08 : relative_bound)
        << "more samples are needed";
    if (is_about_axis) {
        const auto as_written =
            expected_irradiance(light, windows, receiver.normal, FocusAbout::SurfaceNormal);
        EXPECT_FALSE(compare(measured, as_written, receiver).agrees)
            << "the frame is as the schema says: take it off the list";
    }
}

json descriptions() {
    std::ifstream file(luxtest_folder() / "light_descriptions.json");
    return json::parse(file);
}

class Luxtest : public ::testing::Test {
  protected:
    void SetUp() override {
#ifndef VELATURA_HAVE_OPENIMAGEIO_PLUGIN
        GTEST_SKIP() << "built without the plugin openimageio";
#endif
        if (!std::filesystem::exists(luxtest_folder() / "light_descriptions.json"))
            GTEST_SKIP() << "luxtest is not at " << luxtest_folder();
    }

    static void check_sheet(const std::string& name) {
        const LuxSheet sheet(name, descriptions().at(name));
        ASSERT_TRUE(sheet.light_prim().is_valid());
        sheet.expect_described_values();
        for (const int frame : sheet.frames()) check_frame(sheet, receivers.at(name), frame);
    }

    /// A few frames of every feature: the first, and every tenth of the sheet.
    static void check_some_of_sheet(const std::string& name) {
        const LuxSheet sheet(name, descriptions().at(name));
        ASSERT_TRUE(sheet.light_prim().is_valid());
        sheet.expect_described_values();
        const std::vector<int> frames = sheet.frames();
        for (size_t i = 0; i < frames.size(); i += 10)
            check_frame(sheet, receivers.at(name), frames[i]);
    }
};

TEST_F(Luxtest, EverySheetIsCheckedHere) {
    const std::set<std::string> others = {"dome", "visibleRect", "iesTest"};
    const json all = descriptions();
    for (const auto& [name, description] : all.items())
        EXPECT_TRUE(receivers.contains(name) || others.contains(name)) << name;
    for (const DifferentFrames& d : different_frames) {
        const std::vector<int> frames = LuxSheet(d.sheet, all.at(d.sheet)).frames();
        EXPECT_TRUE(std::ranges::count(frames, d.first) == 1 &&
                    std::ranges::count(frames, d.last) == 1)
            << d.sheet << " has no frames " << d.first << " to " << d.last;
    }
}

// The quick twin of the sheets below
TEST_F(Luxtest, EveryTenthFrameOfTheSheets) {
    for (const auto& [name, receiver] : receivers) check_some_of_sheet(name);
}

TEST_F(Luxtest, Rect) {
    check_sheet("rect");
}

TEST_F(Luxtest, Disk) {
    check_sheet("disk");
}

TEST_F(Luxtest, Sphere) {
    check_sheet("sphere");
}

TEST_F(Luxtest, Cylinder) {
    check_sheet("cylinder");
}

TEST_F(Luxtest, Distant) {
    check_sheet("distant");
}

TEST_F(Luxtest, IesDown) {
    check_sheet("iesDown");
}

TEST_F(Luxtest, IesUp) {
    check_sheet("iesUp");
}

TEST_F(Luxtest, IesScale) {
    check_sheet("ies_scale");
}

TEST_F(Luxtest, IesLibPreview) {
    check_sheet("iesLibPreview");
}

TEST_F(Luxtest, IesTest) {
    // Inside a ball of 50 x 50 facets, the light in its middle. The facets lie up to pi²/2500 of
    // the radius further in, which is what the bound is for
    const LuxSheet sheet("iesTest", descriptions().at("iesTest"));
    sheet.expect_described_values();
    for (const int frame : sheet.frames()) {
        std::set<std::string> warnings;
        const scene::Scene scene = prepared_scene(sheet, frame, warnings);
        const LuxLight light = sheet.light(frame);
        const FrameRenderer renderer(scene);
        for (const auto& [x, y] : {Vec2d(0.31, 0.42), Vec2d(0.62, 0.77), Vec2d(0.83, 0.36)}) {
            const std::string what = fmt::format("iesTest frame {} at {}, {}", frame, x, y);
            const PixelWindow window = renderer.window_along(x, y);
            const Vec3d n = -window.position;
            const double expected =
                irradiance(light, window.position * 0.5, n, FocusAbout::LightAxis).value.x / pi_d;
            const double visible = relative_bound * std::max(expected, 1e-12);
            const RadianceEstimate seen = renderer.measure(window, 1, Vec3d(visible));
            fmt::print("{}  {:.6g} expected {:.6g} detectable {:.1e}\n", what, seen.mean.x,
                       expected, detectable_sigmas * seen.standard_error.x);
            EXPECT_NEAR(seen.mean.x, expected, relative_bound * expected) << what;
            EXPECT_LE(detectable_sigmas * seen.standard_error.x, visible) << what;
        }
    }
}

TEST_F(Luxtest, ClosedFormsAgreeWithQuadrature) {
    for (const char* name : {"rect", "disk", "sphere", "cylinder"}) {
        const LuxSheet sheet(name, descriptions().at(name));
        for (const int frame : {1, 3, 6, 10, 15}) {
            const LuxLight light = sheet.light(frame);
            for (const Vec3d& p : lit_points) {
                const Vec3d exact =
                    irradiance(light, p, {0, 1, 0}, FocusAbout::SurfaceNormal).value;
                const Vec3d summed = irradiance_by_quadrature(light, p, {0, 1, 0}).value;
                EXPECT_NEAR(exact.x, summed.x, 2e-4 * exact.x + 1e-6) << name << " " << frame;
            }
        }
    }
}

// ---- Textures ----

TEST_F(Luxtest, DomeShowsItsTexture) {
    const LuxSheet sheet("dome", descriptions().at("dome"));
    const LuxImage image = read_image(luxtest_folder() / "dome_grid_2k.exr");
    std::set<std::string> warnings;
    const scene::Scene scene = translate_frame(sheet.stage(), 1, warnings);
    const FrameRenderer renderer(scene);
    int checked = 0;
    for (int y = 3; y < image.height; y += 7) {
        for (int x = 5; x < image.width; x += 9) {
            const auto seen = renderer.see(latlong_direction(image, x, y));
            if (seen && expect_texel(image, x, y, *seen)) ++checked;
        }
    }
    fmt::print("dome: {} texels in the camera's view\n", checked);
    EXPECT_GT(checked, 100);
    for (const Vec3d& n : {Vec3d(1, 0, 0), Vec3d(-1, 0, 0), Vec3d(0, 1, 0), Vec3d(0, -1, 0),
                           Vec3d(0, 0, 1), Vec3d(0, 0, -1), Vec3d(0.6, 0.64, -0.48)})
        expect_patch_irradiance(scene, -n, n, dome_irradiance(image, n), relative_bound);
}

TEST_F(Luxtest, VisibleRectShowsItsTexture) {
    const LuxSheet sheet("visibleRect", descriptions().at("visibleRect"));
    const LuxImage image = read_image(luxtest_folder() / "dome_grid_2k.exr");
    const LuxLight light = sheet.light(1);
    std::set<std::string> warnings;
    const scene::Scene scene = translate_frame(sheet.stage(), 1, warnings);
    const FrameRenderer renderer(scene);
    int checked = 0;
    for (int y = 3; y < image.height; y += 101) {
        for (int x = 5; x < image.width; x += 137) {
            const Vec3d at = transform_point(rect_texel(image, light.width, light.height, x, y),
                                             light.world_from_light);
            const auto seen = renderer.see(at - scene.camera.world_position);
            if (seen && expect_texel(image, x, y, *seen)) ++checked;
        }
    }
    fmt::print("visibleRect: {} texels in the camera's view\n", checked);
    EXPECT_GT(checked, 20);
    for (const Vec3d& p : {Vec3d(0, 0, -0.6), Vec3d(0.4, 0.3, -0.3), Vec3d(-0.4, 0.3, -0.3),
                           Vec3d(0.3, -0.4, -0.3)}) {
        const Vec3d n(0, 0, 1);
        expect_patch_irradiance(scene, p - scene.camera.world_position, n,
                                rect_irradiance(light, image, p, n), relative_bound);
    }
}

}  // namespace

}  // namespace velatura::test
