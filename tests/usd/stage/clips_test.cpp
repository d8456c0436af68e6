// SPDX-License-Identifier: Apache-2.0
#include "usd/stage/clips.h"

#include "stage_fixture.h"
#include "test_assets.h"
#include "usd/stage/prim_data.h"
#include "usd/stage/stage.h"

#include <gtest/gtest.h>

#include <filesystem>

namespace velatura::usd::stage {
namespace {

// ---- The AOUSD suite: value_resolution/tests/test_value_resolution.py ----

namespace fs = std::filesystem;

fs::path suite() {
    return test_assets() / "aousd/value_resolution/tests/assets";
}

struct Expected {
    const char* layers;
    const char* attribute;
    double time;
    double value;
};

/// 16 less the least step, as the suite has it.
constexpr double before_16 = 16.0 - clip_jump_step;

const Expected expected_values[] = {
    {"timesamples", "/Root.root", 1, 5},
    {"timesamples", "/Root.root", 40, 15},
    {"timesamples", "/Root.root", 15, 5.0 + 5.0 * 14.0 / 29.0},
    {"timesamples", "/Root.root", 60, 15},
    {"timesamples", "/Root.root", 0.5, 5},
    {"clip_timings", "/Model.size", 0, 10},
    {"clip_timings", "/Model.size", 15, 17.5},
    {"clip_timings", "/Model.size", 30, 15},
    {"clip_timings", "/Model.size", 40, 20},
    {"clip_basic", "/Model.size", 0, 0},
    {"clip_basic", "/Model.size", 5, 5},
    {"clip_advanced", "/Model.local", 0, 0},
    {"clip_advanced", "/Model.local", 5, 5},
    {"clip_advanced", "/Model.local", 10, 10},
    {"clip_advanced", "/Model.local", 15, 15},
    {"clip_advanced", "/Model.local", 20, 20},
    {"clip_advanced", "/Model.local", 25, 20},
    {"clip_advanced", "/Model.ref", 0, 0},
    {"clip_advanced", "/Model.ref", 5, -5},
    {"clip_advanced", "/Model.ref", 10, -10},
    {"clip_advanced", "/Model.ref", 20, -20},
    {"clip_advanced", "/Model.ref", 25, -25},
    {"clip_advanced", "/Model.ref", 30, -25},
    {"clip_sets", "/DefaultOrderTest.attr", 0, 10},
    {"clip_sets", "/DefaultOrderTest.attr", 1, 20},
    {"clip_sets", "/DefaultOrderTest.attr", 2, 30},
    {"clip_multi", "/Model_1.size", 5, -5},
    {"clip_multi", "/Model_1.size", 10, -10},
    {"clip_multi", "/Model_1.size", before_16, -15},
    {"clip_multi", "/Model_1.size", 16, -23},
    {"clip_multi", "/Model_1.size", 19, -23},
    {"clip_multi", "/Model_1.size", 22, -26},
    {"clip_multi", "/Model_1.size", 25, -29},
};

/// Outside of the timing curve the suite's sample code reads the ends of the clip (25 and 0); the
/// standard's text is silent, OpenUSD and its stored dump hold the ends of the curve, and so do we.
const Expected other_values[] = {
    {"clip_timings", "/Model.size", 50, 20},
    {"clip_timings", "/Model.size", -1, 10},
};

Attribute attribute_at(const Stage& stage, const char* text) {
    const layer::Path path = layer::Path::from(text);
    return {stage.prim_at(path.prim_path()), path.name()};
}

void expect(const Expected& one) {
    Diagnostics diagnostics;
    const auto stage = Stage::open((suite() / one.layers / "entry.usd").string(), {}, diagnostics);
    ASSERT_TRUE(stage.has_value()) << one.layers;
    const Attribute attribute = attribute_at(*stage, one.attribute);
    const auto value = attribute.get<double>(one.time);
    ASSERT_TRUE(value.has_value()) << one.layers << " " << one.attribute;
    EXPECT_NEAR(*value, one.value, 1e-6) << one.layers << " " << one.attribute << " " << one.time;
}

TEST(AousdValueResolution, HasTheExpectedNumbers) {
    if (!fs::exists(suite())) GTEST_SKIP() << "no assets at " << suite();
    for (const Expected& one : expected_values) expect(one);
    for (const Expected& one : other_values) expect(one);
    Diagnostics diagnostics;
    const auto plain = Stage::open((suite() / "default/entry.usd").string(), {}, diagnostics);
    ASSERT_TRUE(plain.has_value());
    EXPECT_EQ(attribute_at(*plain, "/Root.root").get<double>(), 2.0);
    const auto samples = Stage::open((suite() / "timesamples/entry.usd").string(), {}, diagnostics);
    ASSERT_TRUE(samples.has_value());
    EXPECT_FALSE(attribute_at(*samples, "/Root.root").get<double>().has_value());
}

// ---- Rules of clips one by one ----

using ClipsTest = StageTest;

double at(const Stage& stage, const char* attribute, double time) {
    return attribute_at(stage, attribute).get<double>(time).value_or(-999.0);
}

TEST_F(ClipsTest, ComeRightBelowTheLayerThatAnchorsThem) {
    write("clip.usda",
          "def \"M\" { double a.timeSamples = { 0: 1 } double b.timeSamples = { 0: 1 } "
          "double c.timeSamples = { 0: 1 } }\n");
    write("ref.usda", "def \"R\" { double a = 100; double b = 100; double c = 100 }\n");
    open(R"(
def "P" (
    references = @ref.usda@</R>
    clips = { dictionary default = {
        asset[] assetPaths = [@./clip.usda@]
        string primPath = "/M"
        double2[] active = [(0, 0)]
    } }
) {
    double b = 5
    double c.timeSamples = { 0: 6 }
}
)");
    EXPECT_EQ(at(stage(), "/P.a", 0), 1);
    EXPECT_EQ(at(stage(), "/P.b", 0), 5);
    EXPECT_EQ(at(stage(), "/P.c", 0), 6);
    // Clips say nothing at the default time
    EXPECT_EQ(stage().prim_at("/P").attribute("a").get<double>(), 100.0);
    EXPECT_EQ(stage().prim_at("/P").attribute("a").value_source(), ValueSource::Clips);
}

TEST_F(ClipsTest, ReachDescendantsThatHaveNoSpecHere) {
    write("clip.usda", "def \"M\" { def \"C\" { double a.timeSamples = { 0: 1, 10: 2 } } }\n");
    write("ref.usda", "def \"R\" { def \"C\" { double a = 100 } }\n");
    open(R"(
def "P" (
    references = @ref.usda@</R>
    clips = { dictionary default = {
        asset[] assetPaths = [@./clip.usda@]
        string primPath = "/M"
        double2[] active = [(0, 0)]
    } }
) {}
)");
    EXPECT_EQ(at(stage(), "/P/C.a", 5), 1.5);
}

TEST_F(ClipsTest, NearerPrimsGoFirst) {
    write("far.usda", "def \"M\" { def \"C\" { double a.timeSamples = { 0: 1 } } }\n");
    write("near.usda", "def \"N\" { double a.timeSamples = { 0: 2 } }\n");
    open(R"(
def "P" (
    clips = { dictionary default = {
        asset[] assetPaths = [@./far.usda@]; string primPath = "/M"; double2[] active = [(0, 0)]
    } }
) {
    def "C" (
        clips = { dictionary default = {
            asset[] assetPaths = [@./near.usda@]; string primPath = "/N"; double2[] active = [(0,
                0)]
        } }
    ) { double a }
}
)");
    EXPECT_EQ(at(stage(), "/P/C.a", 0), 2);
}

TEST_F(ClipsTest, TemplatesNameFilesByTime) {
    for (const char* n : {"101", "102", "103"}) {
        write("c." + std::string(n) + ".usda",
              "def \"M\" { double a.timeSamples = { " + std::string(n) + ": " + n + " } }\n");
    }
    open(R"(
def "P" (
    clips = { dictionary default = {
        string templateAssetPath = "./c.###.usda"
        double templateStartTime = 101
        double templateEndTime = 103
        double templateStride = 1
        double templateActiveOffset = 0.5
        string primPath = "/M"
    } }
) { double a }
)");
    const auto& sets = *stage().prim_at("/P").data()->clips;
    ASSERT_EQ(sets.size(), 1u);
    // The figures of AOUSD Core Specification 12.3.4.1.3.5
    std::vector<std::pair<double, double>> times, active;
    for (const ClipTiming& t : sets[0]->definition().times)
        times.emplace_back(t.external, t.internal);
    EXPECT_EQ(times, (std::vector<std::pair<double, double>>{
                         {100.5, 100.5}, {101, 101}, {102, 102}, {103, 103}, {103.5, 103.5}}));
    std::vector<double> starts;
    for (const Clip& clip : sets[0]->definition().clips) starts.push_back(clip.authored_start);
    EXPECT_EQ(starts, (std::vector<double>{101.5, 102.5, 103.5}));
    EXPECT_EQ(at(stage(), "/P.a", 102), 101);
    EXPECT_EQ(at(stage(), "/P.a", 103), 102);
}

TEST_F(ClipsTest, LayerOffsetsMoveClips) {
    write("clip.usda", "def \"M\" { double a.timeSamples = { 0: 0, 10: 10 } }\n");
    write("ref.usda", R"(
def "R" (
    clips = { dictionary default = {
        asset[] assetPaths = [@./clip.usda@]; string primPath = "/M"
        double2[] active = [(0, 0)]; double2[] times = [(0, 0), (10, 10)]
    } }
) { double a }
)");
    open("def \"P\" ( references = @ref.usda@</R> (offset = 100; scale = 2) ) {}\n");
    EXPECT_EQ(at(stage(), "/P.a", 110), 5);
    EXPECT_EQ(stage().prim_at("/P").attribute("a").time_samples(), (std::vector<double>{100, 120}));
}

TEST_F(ClipsTest, MissingValuesAreDefaultsOfTheManifestOrInterpolated) {
    write("one.usda", "def \"M\" { double a.timeSamples = { 0: 10 } }\n");
    write("two.usda", "def \"M\" { }\n");
    write("three.usda", "def \"M\" { double a.timeSamples = { 20: 30 } }\n");
    write("manifest.usda", "def \"M\" { double a; double d = 7 }\n");
    write("root.usda", "");
    const std::string clips = R"(
        asset[] assetPaths = [@./one.usda@, @./two.usda@, @./three.usda@]
        asset manifestAssetPath = @./manifest.usda@
        string primPath = "/M"
        double2[] active = [(0, 0), (10, 1), (20, 2)]
)";
    open("def \"Gap\" ( clips = { dictionary default = {" + clips +
         "} } ) { double a; double d }\ndef \"Bridge\" ( clips = { dictionary default = {" + clips +
         "bool interpolateMissingClipValues = true } } ) { double a; double d }\n");
    EXPECT_EQ(at(stage(), "/Bridge.a", 15), 25);
    EXPECT_EQ(at(stage(), "/Bridge.d", 15), 7);
    EXPECT_EQ(at(stage(), "/Gap.d", 15), 7);
    // A clip without samples and default blocks
    EXPECT_EQ(at(stage(), "/Gap.a", 15), -999);
    EXPECT_EQ(at(stage(), "/Gap.a", 20), 30);
}

TEST_F(ClipsTest, ManifestDecidesWhatIsVarying) {
    write("clip.usda",
          "def \"M\" { double a.timeSamples = { 0: 1 } double b.timeSamples = { 0: 1 } "
          "}\n");
    write("manifest.usda", "def \"M\" { double a; uniform double b }\n");
    open(R"(
def "P" (
    clips = { dictionary default = {
        asset[] assetPaths = [@./clip.usda@]; asset manifestAssetPath = @./manifest.usda@
        string primPath = "/M"; double2[] active = [(0, 0)]
    } }
) { double a = 8; double b = 8 }
)");
    // The local default is stronger than the clips of its own layer
    EXPECT_EQ(at(stage(), "/P.a", 0), 8);
    const auto& set = *stage().prim_at("/P").data()->clips->front();
    EXPECT_TRUE(set.has_attribute(layer::Path::from("/P.a")));
    EXPECT_FALSE(set.has_attribute(layer::Path::from("/P.b")));
}

TEST_F(ClipsTest, BadSetsAreNamedAndIgnored) {
    open(R"(
def "P" (
    clips = {
        dictionary twice = { asset[] assetPaths = [@./a.usda@]; string primPath = "/M";
        double2[] active = [(0, 0), (0, 0)] }
        dictionary where = { asset[] assetPaths = [@./a.usda@]; string primPath = "M";
        double2[] active = [(0, 0)] }
        dictionary which = { asset[] assetPaths = [@./a.usda@]; string primPath = "/M";
        double2[] active = [(0, 3)] }
        dictionary huge = { string templateAssetPath = "./a.#.usda"; string primPath = "/M";
        double templateStartTime = 0; double templateEndTime = 1e12; double templateStride = 0.001 }
    }
) { double a = 1 }
)");
    EXPECT_EQ(at(stage(), "/P.a", 0), 1);
    size_t warnings = 0;
    for (const Diagnostic& d : stage().diagnostics().all()) warnings += d.code == "usd-bad-clips";
    EXPECT_EQ(warnings, 4u);
}

}  // namespace
}  // namespace velatura::usd::stage
