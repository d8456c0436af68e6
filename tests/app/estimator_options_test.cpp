// SPDX-License-Identifier: Apache-2.0
// The options that choose the estimator, from the outside. That the estimators agree is
// tests/transport's.
#include "command.h"
#include "image/exr.h"
#include "layers/layer_header.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace velatura::test {

namespace {

/// small_scene() with a perfect mirror on the wall behind.
std::string scene_with_mirror() {
    std::string text = small_scene();
    text += R"usda(
def Mesh "Mirror" (
    prepend apiSchemas = ["MaterialBindingAPI"]
)
{
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(0.8, 0.2, -1.5), (2.5, 0.2, -1.5), (2.5, 2.5, -1.5), (0.8, 2.5, -1.5)]
    uniform token subdivisionScheme = "none"
    rel material:binding = </Silver>
}
def Material "Silver"
{
    token outputs:surface.connect = </Silver/P.outputs:surface>
    def Shader "P"
    {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor = (1, 1, 1)
        float inputs:metallic = 1
        float inputs:roughness = 0
        token outputs:surface
    }
}
)usda";
    return text;
}

class EstimatorOptions : public testing::Test {
  protected:
    void SetUp() override { w.write("s.usda", scene_with_mirror()); }

    void render(const std::string& arguments) {
        const CommandResult r =
            w.velatura("render s.usda --res 40 34 --progress none -q " + arguments);
        ASSERT_EQ(r.exit_code, 0) << r.output;
    }

    /// Mean of a channel of a file.
    double mean(const std::string& file, const std::string& name) const {
        const Result<image::Image> image = image::read_exr(w.path(file));
        const image::Channel* c = image ? image->find(name) : nullptr;
        EXPECT_NE(c, nullptr) << file << ' ' << name;
        double sum = 0;
        for (size_t i = 0; c && i < c->size(); ++i) sum += double(c->value(i)) / double(c->size());
        return sum;
    }

    /// Of the file's header.
    nlohmann::json stats(const std::string& file) const {
        const Result<image::Image> image = image::read_exr(w.path(file));
        return image ? nlohmann::json::parse(image->text(layers::stats_attribute))
                     : nlohmann::json();
    }

    Workplace w;
};

}  // namespace

TEST_F(EstimatorOptions, ContradictionsAreUsageErrors) {
    for (const char* arguments :
         {"--roulette none", "--integrator naive --light-sampling light",
          "--integrator nee --light-sampling mis", "--integrator whitted --light-sampling bsdf",
          "--integrator bdpt", "--light-sampling both",
          "--light-sampling global-area --light-selection power", "--cutoff 0.1",
          "--roulette none --max-depth 4 --cutoff 0.1", "--sampler halton", "--caustics photons",
          "--integrator whitted --caustics manifold"}) {
        EXPECT_EQ(w.velatura(std::string("render s.usda -o x.exr --res 8 8 --spp 1 ") + arguments)
                      .exit_code,
                  2)
            << arguments;
    }
    EXPECT_FALSE(w.exists("x.exr"));
}

TEST_F(EstimatorOptions, NamesForOneEstimatorGiveOneImage) {
    render("--spp 4 -o a.exr --integrator naive");
    render("--spp 4 -o b.exr --light-sampling bsdf");
    EXPECT_EQ(w.hash("a.exr"), w.hash("b.exr"));
    render("--spp 4 -o c.exr --integrator nee");
    render("--spp 4 -o d.exr --integrator path --light-sampling light");
    EXPECT_EQ(w.hash("c.exr"), w.hash("d.exr"));
}

TEST_F(EstimatorOptions, EachChangesTheImageAndCannotBeMergedWithAnother) {
    render("--samples 0:4 -o usual.exr");
    const std::string usual = w.hash("usual.exr");
    for (const char* other :
         {"--integrator nee", "--integrator whitted", "--light-selection uniform",
          "--light-sampling light", "--light-sampling area", "--light-sampling hemisphere",
          "--light-sampling cosine", "--light-selection area", "--roulette constant",
          "--roulette albedo", "--roulette throughput", "--roulette cutoff",
          "--sampler independent", "--sampler stratified", "--caustics manifold"}) {
        render(std::string("--samples 0:4 -o same_range.exr ") + other);
        EXPECT_NE(w.hash("same_range.exr"), usual) << other;
        render(std::string("--samples 4:8 -o rest.exr ") + other);
        EXPECT_EQ(w.comp("merge usual.exr rest.exr -o both.exr").exit_code, 5) << other;
    }
}

/// What is requested is used, or a warning states why it is not.
TEST_F(EstimatorOptions, LightTracingIsUsedOrAWarningStatesWhyNot) {
    const std::string sizes = "render s.usda --res 24 16 --spp 2 ",
                      how = sizes + "--progress none -o o.exr ";
    EXPECT_NE(w.velatura(how + "-v --caustics light").output.find("caustics by light tracing"),
              std::string::npos);
    EXPECT_NE(
        w.velatura(sizes + "--caustics light --replay 3,4,0").output.find("camera path alone"),
        std::string::npos);
    const std::string by_light = w.velatura(how + "--caustics light --integrator nee").output;
    EXPECT_NE(by_light.find("--caustics light: light tracing is not used"), std::string::npos)
        << by_light;
    w.write("s.usda", small_scene());
    const std::string nothing = w.velatura(how + "--caustics light").output;
    EXPECT_NE(nothing.find("no glass, mirror or glossy surface"), std::string::npos) << nothing;
}

TEST_F(EstimatorOptions, PlansCountTheSplatsOfLightTracing) {
    const auto splats = [this](const std::string& arguments) {
        const std::string plan =
            w.velatura("plan s.usda --json -q --res 400 300 " + arguments).output;
        return nlohmann::json::parse(plan)["needs"]["memory_bytes"]["light_tracing_expected"]
            .get<uint64_t>();
    };
    EXPECT_EQ(splats("--caustics path"), 0u);
    const uint64_t usual = splats(""), by_expressions = splats("--lpe 'all=C.*L'");
    EXPECT_GT(usual, 0u);
    EXPECT_GE(by_expressions, usual);
    EXPECT_LE(usual, uint64_t(256) << 20);
}

TEST_F(EstimatorOptions, GlobalAreaIsAreaOfLightsChosenByArea) {
    render("--spp 4 -o a.exr --light-sampling global-area");
    render("--spp 4 -o b.exr --light-sampling area --light-selection area");
    const auto beauty = [this](const char* file) { return mean(file, "R"); };
    EXPECT_EQ(beauty("a.exr"), beauty("b.exr"));
}

TEST_F(EstimatorOptions, CutoffIsABiasThatTheLedgerNames) {
    render("--spp 16 -o cut.exr --roulette cutoff --cutoff 0.3");
    const nlohmann::json ledger = stats("cut.exr")["ledger"];
    const auto named = [](const nlohmann::json& line) {
        return line["approximation"] == "throughput-cutoff" && line["kind"] == "bias" &&
               line["value"].get<float>() == 0.3f;
    };
    EXPECT_EQ(std::count_if(ledger.begin(), ledger.end(), named), 1);
    render("--spp 16 -o whole.exr");
    const nlohmann::json none = stats("whole.exr")["ledger"];
    EXPECT_EQ(std::count_if(none.begin(), none.end(), named), 0);
    EXPECT_LT(mean("cut.exr", "tail.G"), 0.5 * mean("whole.exr", "tail.G"));
}

TEST_F(EstimatorOptions, GainsOfRouletteAreTheSameInEveryCrop) {
    const auto gains = [this](const std::string& arguments) {
        render("--spp 1 -o x.exr " + arguments);
        return stats("x.exr")["roulette"]["gains"];
    };
    const nlohmann::json whole = gains("");
    EXPECT_EQ(whole.size(), 4u);
    EXPECT_EQ(gains("--crop 0 0.5 0 0.5 --threads 2"), whole);
}

TEST_F(EstimatorOptions, WhittedFollowsMirrorsAlone) {
    render("--spp 64 --lights off -o whitted.exr --integrator whitted");
    render("--spp 64 --lights off -o path.exr --integrator nee");
    // Direct light is the same, what the mirror shows of it is there, light that two matte surfaces
    // pass on is not
    const double direct = mean("path.exr", "b1.G");
    EXPECT_NEAR(mean("whitted.exr", "b1.G"), direct, 0.02 * direct);
    const double whitted = mean("whitted.exr", "b2.G"), all = mean("path.exr", "b2.G");
    EXPECT_GT(whitted, 0.001 * direct);
    EXPECT_LT(whitted, 0.7 * all);
    EXPECT_LT(mean("whitted.exr", "b3.G"), 0.05 * mean("path.exr", "b3.G"));
}

}  // namespace velatura::test
