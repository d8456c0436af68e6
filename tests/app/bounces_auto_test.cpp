// SPDX-License-Identifier: Apache-2.0
// Which bounces --bounces auto stores, in a closed room that shines by itself: bounce k has the
// share (1 − ρ) ρ^k of the light, ρ its albedo (the furnace's series).
#include "command.h"
#include "image/exr.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <fstream>
#include <string>
#include <vector>

namespace velatura::test {

namespace {

using Json = nlohmann::json;

constexpr double albedo = 0.5;

constexpr const char* room = R"usda(#usda 1.0
def Camera "Cam" { float focalLength = 20
}
def Sphere "Room" (prepend apiSchemas = ["MaterialBindingAPI"]) {
    double radius = 5
    rel material:binding = </M>
}
def Material "M" {
    token outputs:surface.connect = </M/S.outputs:surface>
    def Shader "S" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor = (0.5, 0.5, 0.5)
        color3f inputs:emissiveColor = (0.5, 0.5, 0.5)
        int inputs:useSpecularWorkflow = 1
        color3f inputs:specularColor = (0, 0, 0)
        float inputs:roughness = 1
        token outputs:surface
    }
}
)usda";

/// 2.58 standard deviations of the mean of so many numbers that are 1 with that chance, else 0: as
/// much as a roulette may do to paths of which a part ends.
double by_chance(double mean, int count) {
    const double deviation = std::sqrt(mean * (1 - mean) / count);
    fmt::print("mean {:.4f}, detectable {:.2g}\n", mean, 3.86 * deviation);
    return 2.58 * deviation;
}

class BouncesAuto : public testing::Test {
  protected:
    void SetUp() override { w.write("s.usda", room); }

    CommandResult render(const std::string& options) {
        return w.velatura("render s.usda --res 40 30 --layers bounce --progress none -q " +
                          options);
    }

    Json stats() {
        std::ifstream file(w.path("s.json"));
        return Json::parse(file);
    }

    double mean_of(const std::string& file, const std::string& layer) {
        const auto image = image::read_exr(w.path(file));
        const image::Channel* const channel = image ? image->find(layer + ".G") : nullptr;
        if (!channel) return -1;
        double sum = 0;
        for (size_t i = 0; i < channel->size(); ++i) sum += double(channel->value(i));
        return sum / double(channel->size());
    }

    Workplace w;
};

}  // namespace

TEST_F(BouncesAuto, StoresThoseThatHaveTheShare) {
    struct Case {
        const char* typed;
        int last;
    };

    // Shares: 0.5 0.25 0.125 0.0625 0.0313 0.0156 0.0078; b6 is the most
    for (const Case& c :
         {Case{"auto", 5}, Case{"auto=5%", 3}, Case{"auto=0.2", 1}, Case{"auto=0.1%", 6}}) {
        SCOPED_TRACE(c.typed);
        const CommandResult r =
            render(fmt::format("--spp 4 --bounces {} --stats s.json -o a.exr", c.typed));
        ASSERT_EQ(r.exit_code, 0) << r.output;
        EXPECT_EQ(stats().at("bounces").at("last"), c.last);
        EXPECT_GE(mean_of("a.exr", fmt::format("b{}", c.last)), 0);
        EXPECT_LT(mean_of("a.exr", fmt::format("b{}", c.last + 1)), 0);
        // The tail has what follows: all light, which is 1, times ρ^(last + 1)
        const double rest = std::pow(albedo, c.last + 1);
        EXPECT_NEAR(mean_of("a.exr", "tail"), rest, by_chance(rest, 1200 * 4));
        EXPECT_EQ(w.comp("verify a.exr").exit_code, 0);
    }
    const std::vector<double> shares = stats().at("bounces").at("shares");
    ASSERT_EQ(shares.size(), 8u);
    for (size_t k = 0; k < 7; ++k) {
        const double right = (1 - albedo) * std::pow(albedo, double(k));
        EXPECT_NEAR(shares[k], right, by_chance(right, 1200 * 8)) << k;
    }
    EXPECT_NEAR(shares[7], std::pow(albedo, 7), by_chance(std::pow(albedo, 7), 1200 * 8));
}

/// A range of samples, a part of the frame and a render that goes on choose as the whole does.
TEST_F(BouncesAuto, PartsAgreeWithTheWhole) {
    ASSERT_EQ(render("--spp 8 --bounces auto=5% -o whole.exr").exit_code, 0);
    ASSERT_EQ(render("--samples 0:4 --bounces auto=5% -o a.exr").exit_code, 0);
    ASSERT_EQ(render("--samples 4:8 --bounces auto=5% -o b.exr").exit_code, 0);
    const CommandResult merged = w.comp("merge a.exr b.exr -o merged.exr");
    ASSERT_EQ(merged.exit_code, 0) << merged.output;
    EXPECT_EQ(w.hash("merged.exr"), w.hash("whole.exr"));
    ASSERT_EQ(render("--spp 4 --resumable --bounces auto=5% -o on.exr").exit_code, 0);
    const CommandResult on = render("--spp 8 --resumable --resume --bounces auto=5% -o on.exr");
    ASSERT_EQ(on.exit_code, 0) << on.output;
    EXPECT_EQ(mean_of("on.exr", "b3"), mean_of("whole.exr", "b3"));
    ASSERT_EQ(render("--spp 8 --bounces auto=5% --crop 0 0.5 0 1 -o crop.exr").exit_code, 0);
    EXPECT_GE(mean_of("crop.exr", "b3"), 0);
    EXPECT_LT(mean_of("crop.exr", "b4"), 0);
}

TEST_F(BouncesAuto, WhatIsNoNumberOrShareIsRefused) {
    for (const char* typed : {"-1", "65", "2.5", "many", "auto=", "auto=0", "auto=200%", "auto5"}) {
        const CommandResult r = render(fmt::format("--bounces={} -o x.exr", typed));
        EXPECT_EQ(r.exit_code, 2) << typed << r.output;
        EXPECT_NE(r.output.find("expected 0 to 64, auto or auto=1%"), std::string::npos)
            << r.output;
        EXPECT_FALSE(w.exists("x.exr"));
    }
}

}  // namespace velatura::test
