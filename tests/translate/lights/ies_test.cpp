// SPDX-License-Identifier: Apache-2.0
#include "base/math.h"
#include "translate/lights/ies_file.h"
#include "translate/support.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

namespace velatura::translate::lights {

namespace {

constexpr double degree = pi_d / 180.0;

/// A file with the vertical angles 0, 90 and 180 and the given horizontal ones; row i is (i + 1, 10
/// (i + 1), 0).
std::string file(const std::string& horizontal, int count, const std::string& tilt = "TILT=NONE") {
    std::string text = "IESNA:LM-63-2002\r\n[TEST] one\r\n" + tilt + "\r\n1 -1 2.0 3 " +
                       std::to_string(count) + " 1 2 0.1 0 0\r\n1.5 1.0 20\r\n0 90, 180\r\n" +
                       horizontal + "\r\n";
    for (int i = 0; i < count; ++i) text += fmt::format("{} {} 0\r\n", i + 1, 10 * (i + 1));
    return text;
}

double at(const scene::IesProfile& profile, double vertical, double horizontal) {
    return scene::intensity(profile, vertical * degree, horizontal * degree);
}

std::string error_of(const std::string& text) {
    const Result<scene::IesProfile> profile = parse_ies(text);
    return profile ? "" : profile.error().code + " " + profile.error().message;
}

}  // namespace

TEST(Ies, OneRowIsTheSameAllAround) {
    const Result<scene::IesProfile> p = parse_ies(file("0", 1));
    ASSERT_TRUE(p);
    for (const double h : {0.0, 77.0, 359.0, -20.0}) {
        // Candela times multiplier 2 times ballast 1.5
        EXPECT_DOUBLE_EQ(at(*p, 0, h), 3.0);
        EXPECT_DOUBLE_EQ(at(*p, 45, h), 16.5);
        EXPECT_DOUBLE_EQ(at(*p, 135, h), 15.0);
    }
}

TEST(Ies, SymmetricTablesAreCompleted) {
    struct Case {
        const char* horizontal;
        int count;
        double angle, same_as;
    };

    // Reflected by the planes of the symmetry
    for (const Case& c :
         {Case{"0 30 90", 3, 160, 20}, Case{"0 30 90", 3, 200, 20}, Case{"0 30 90", 3, 340, 20},
          Case{"0 30 180", 3, 260, 100}, Case{"90 120 270", 3, 10, 170},
          Case{"90 120 270", 3, 350, 190}, Case{"0 90 270 360", 4, 370, 10}}) {
        const Result<scene::IesProfile> p = parse_ies(file(c.horizontal, c.count));
        ASSERT_TRUE(p) << p.error().message;
        EXPECT_NEAR(at(*p, 60, c.angle), at(*p, 60, c.same_as), 1e-9)
            << c.horizontal << " " << c.angle;
        EXPECT_GT(at(*p, 60, c.angle), 0.0);
    }
}

TEST(Ies, ATableWithoutItsLastRowMeetsItsFirst) {
    const Result<scene::IesProfile> p = parse_ies(file("0 90 180 270", 4));
    ASSERT_TRUE(p);
    EXPECT_NEAR(at(*p, 0, 315), 0.5 * (at(*p, 0, 270) + at(*p, 0, 0)), 1e-9);
}

TEST(Ies, TheMeanIsThatOfASumOverDirections) {
    for (const char* horizontal : {"0 30 90", "90 120 270"}) {
        const Result<scene::IesProfile> p = parse_ies(file(horizontal, 3));
        ASSERT_TRUE(p);
        double sum = 0.0, weight = 0.0;
        for (double v = 0.25; v < 180.0; v += 0.5) {
            for (double h = 0.5; h < 360.0; h += 1.0)
                sum += at(*p, v, h) * std::sin(v * degree) / 360.0;
            weight += std::sin(v * degree);
        }
        EXPECT_NEAR(scene::mean_intensity(*p), sum / weight, 2e-5 * sum / weight);
    }
}

TEST(Ies, TiltFactorsAreReadOver) {
    const Result<scene::IesProfile> p =
        parse_ies(file("0", 1, "TILT=INCLUDE\r\n1\r\n2\r\n0 90\r\n1 0.9"));
    ASSERT_TRUE(p) << p.error().message;
    EXPECT_DOUBLE_EQ(at(*p, 0, 0), 3.0);
}

TEST(Ies, BadFilesNameTheLine) {
    EXPECT_EQ(error_of(""), "ies-syntax line 1: not an IES file: no line starts with \"TILT=\"");
    EXPECT_NE(error_of("TILT=NONE\n1 2 x").find("line 2: expected a number"), std::string::npos);
    EXPECT_NE(error_of("TILT=NONE\n1 1 1 2 1 2 2 0 0 0\n1 1 1\n0 90\n0\n1 1")
                  .find("ies-unsupported line 2: photometry of type B"),
              std::string::npos);
    EXPECT_NE(error_of("TILT=NONE\n1 1 1 90000 90000 1 2 0 0 0\n1 1 1\n0")
                  .find("the file ends before its table"),
              std::string::npos);
    EXPECT_NE(
        error_of("TILT=NONE\n1 1 1 2.5 1 1 2 0 0 0\n1 1 1\n0 90\n0\n1 1").find("whole number"),
        std::string::npos);
    EXPECT_NE(error_of("TILT=NONE\n1 1 1 2 1 1 2 0 0 0\n1 1 1\n90 0\n0\n1 1").find("ascend"),
              std::string::npos);
    EXPECT_NE(error_of("TILT=NONE\n1 1 1 2 1 1 2 0 0 0\n1 1 1\n0 190\n0\n1 1").find("[0, 180]"),
              std::string::npos);
    EXPECT_NE(error_of("TILT=NONE\n1 1 1 2 1 1 2 0 0 0\n1 1 1\n0 90\n0\n1 -1")
                  .find("a candela value is -1"),
              std::string::npos);
    // Beyond floats: the light would be infinite
    EXPECT_NE(error_of("TILT=NONE\n1 1 1e200 2 1 1 2 0 0 0\n1 1 1\n0 90\n0\n1 1")
                  .find("a candela value is 1e+200"),
              std::string::npos);
    EXPECT_NE(
        error_of("TILT=NONE\n1 1 1 2 1 1 2 0 0 0\n1 1 1\n0 90\n0\n1 nan").find("expected a number"),
        std::string::npos);
    EXPECT_NE(error_of("TILT=NONE\n1 1 1 2 2 1 2 0 0 0\n1 1 1\n0 90\n0 70\n1 1\n1 1")
                  .find("from 0 to 70"),
              std::string::npos);
    EXPECT_NE(error_of("TILT=INCLUDE\n1 90000\n").find("expected a number"), std::string::npos);
}

TEST(Ies, AMissingProfileIsAnErrorOfItsLight) {
    Translated t;
    translate_text(camera() +
                       "def SphereLight \"L\" (prepend apiSchemas = [\"ShapingAPI\"]) {\n asset "
                       "inputs:shaping:ies:file = @nowhere.ies@\n}\n",
                   t);
    ASSERT_EQ(t.scene.lights.size(), 1u);
    EXPECT_EQ(t.scene.lights[0].shaping.ies, nullptr);
    EXPECT_EQ(t.count("ies-unreadable"), 1u);
}

}  // namespace velatura::translate::lights
