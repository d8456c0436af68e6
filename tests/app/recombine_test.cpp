// SPDX-License-Identifier: Apache-2.0
// From a USD file to a recombined image, through the two programs alone.
#include "command.h"
#include "image/exr.h"
#include "layers/deep_file.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace velatura::test {

namespace {

constexpr const char* small = " --progress none -q ";

image::Image read(const Workplace& w, const std::string& name) {
    Result<image::Image> image = image::read_exr(w.path(name));
    if (!image) throw std::runtime_error(image.error().message);
    return std::move(*image);
}

std::vector<float> channel(const image::Image& image, const std::string& name) {
    const image::Channel* c = image.find(name);
    EXPECT_NE(c, nullptr) << name;
    std::vector<float> out;
    for (size_t i = 0; c && i < c->size(); ++i) out.push_back(c->value(i));
    return out;
}

class Recombine : public testing::Test {
  protected:
    void SetUp() override { w.write("s.usda", small_scene()); }

    void render(const std::string& arguments) {
        const CommandResult r = w.velatura("render s.usda --res " + size + small + arguments);
        ASSERT_EQ(r.exit_code, 0) << r.output;
    }

    Workplace w;
    std::string size = "40 34";
};

}  // namespace

TEST_F(Recombine, OneImageHoweverItWasMade) {
    render("--spp 12 -o reference.exr");
    const std::string expected = w.hash("reference.exr");
    ASSERT_EQ(expected.size(), 64u);
    for (const char* how : {"--mode tile --tile 16", "--mode tile --tile 64", "--threads 1",
                            "--threads 2", "--threads 3 --mode tile", "--snapshot 0.01s"}) {
        render(fmt::format("--spp 12 -o other.exr {}", how));
        EXPECT_EQ(w.hash("other.exr"), expected) << how;
    }
}

TEST_F(Recombine, SplitBySamplesAndMergedIsTheWhole) {
    render("--samples 0:12 -o whole.exr");
    for (const int split : {1, 5, 8}) {
        render(fmt::format("--samples 0:{} -o a.exr", split));
        render(fmt::format("--samples {}:12 -o b.exr", split));
        const CommandResult merged = w.comp("merge a.exr b.exr -o merged.exr");
        ASSERT_EQ(merged.exit_code, 0) << merged.output;
        EXPECT_EQ(w.hash("merged.exr"), w.hash("whole.exr")) << "split at " << split;
        EXPECT_EQ(w.comp("verify merged.exr").exit_code, 0);
    }
    // The image itself is also that of a plain render
    render("--spp 12 -o plain.exr");
    EXPECT_EQ(channel(read(w, "merged.exr"), "R"), channel(read(w, "plain.exr"), "R"));
}

TEST_F(Recombine, AdaptiveImagesSplitAndMergeToo) {
    // Indices past the pilot's 16: pixels differ in how many samples a part holds, some have none
    // in the second one
    render("--samples 0:40 -o whole.exr");
    render("--samples 0:18 -o a.exr");
    render("--samples 18:20 --mode tile -o b.exr");
    render("--samples 20:40 --threads 1 -o c.exr");
    const CommandResult merged = w.comp("merge a.exr c.exr b.exr -o merged.exr");
    ASSERT_EQ(merged.exit_code, 0) << merged.output;
    EXPECT_EQ(w.hash("merged.exr"), w.hash("whole.exr"));
    const image::Channel* counts = nullptr;
    const image::Image whole = read(w, "whole.exr");
    counts = whole.find("sampleCount");
    ASSERT_NE(counts, nullptr);
    const auto& n = std::get<std::vector<uint32_t>>(counts->data);
    EXPECT_GT(*std::max_element(n.begin(), n.end()), 2 * *std::min_element(n.begin(), n.end()));
    render("--samples 18:40 --adaptive off -o uniform.exr");
    const CommandResult refused = w.comp("merge a.exr uniform.exr -o m.exr");
    EXPECT_EQ(refused.exit_code, 5) << refused.output;
    // --adaptive off: the same number everywhere
    render("--spp 40 --adaptive off -o off.exr");
    const image::Image off = read(w, "off.exr");
    const auto& m = std::get<std::vector<uint32_t>>(off.find("sampleCount")->data);
    EXPECT_TRUE(std::all_of(m.begin(), m.end(), [](uint32_t v) { return v == 40; }));
}

/// Tiles of a farm, with what else a file can hold; of deep images too.
TEST_F(Recombine, CropsMergeIntoTheWhole) {
    const std::string how =
        "--adaptive off --resumable --cryptomatte object,material "
        "--layers near=depth:closest,Neye --deep ";
    render(how + "--spp 6 -o whole.exr");
    const char* const crops[] = {"0 0.31 0 1", "0.31 1 0 0.5", "0.31 1 0.5 1"};
    std::string files, deep;
    for (int i = 0; i < 3; ++i) {
        render(fmt::format("{} --spp 6 --crop {} -o c{}.exr", how, crops[i], i));
        files = fmt::format("c{}.exr {}", i, files);
        deep += fmt::format(" c{}.deep.exr", i);
    }
    const CommandResult merged = w.comp("merge " + files + " -o merged.exr --resumable");
    ASSERT_EQ(merged.exit_code, 0) << merged.output;
    EXPECT_EQ(w.hash("merged.exr"), w.hash("whole.exr"));
    EXPECT_EQ(w.comp("verify merged.exr").exit_code, 0);
    const auto a = image::read_exr(w.path("merged.exr")), b = image::read_exr(w.path("whole.exr"));
    for (const char* name : {"cryptomatte/3ae39a5/manifest", "velatura/samples", "velatura/layers",
                             "velatura/settings", "velatura/lights", "velatura/scene"})
        EXPECT_EQ(a->text(name), b->text(name)) << name;
    // It goes on as the whole would
    render(
        "--adaptive off --resumable --cryptomatte object,material "
        "--layers near=depth:closest,Neye --spp 9 --resume -o merged.exr");

    const CommandResult of_deep = w.comp("merge" + deep + " -o merged.deep.exr");
    ASSERT_EQ(of_deep.exit_code, 0) << of_deep.output;
    const auto c = layers::read_deep_file(w.path("merged.deep.exr")),
               d = layers::read_deep_file(w.path("whole.deep.exr"));
    ASSERT_TRUE(c.has_value() && d.has_value());
    EXPECT_EQ(c->data, d->data);
    EXPECT_EQ(c->counts, d->counts);
    EXPECT_TRUE(c->samples == d->samples);
    EXPECT_EQ(w.comp("merge c0.deep.exr c1.deep.exr -o refused.deep.exr").exit_code, 5);
    EXPECT_EQ(w.comp("merge c0.deep.exr c0.deep.exr -o refused.deep.exr").exit_code, 5);
    EXPECT_NE(w.comp("merge c0.deep.exr c1.exr -o refused.deep.exr").exit_code, 0);
}

TEST_F(Recombine, GuidedImagesSplitAndMergeToo) {
    render("--samples 0:12 --guiding on -o whole.exr");
    render("--samples 0:5 --guiding on --mode tile -o a.exr");
    render("--samples 5:12 --guiding on --threads 1 -o b.exr");
    const CommandResult merged = w.comp("merge a.exr b.exr -o merged.exr");
    ASSERT_EQ(merged.exit_code, 0) << merged.output;
    EXPECT_EQ(w.hash("merged.exr"), w.hash("whole.exr"));
    render("--samples 0:12 --guiding off -o unguided.exr");
    EXPECT_NE(w.hash("unguided.exr"), w.hash("whole.exr")) << "nothing was guided";
}

TEST_F(Recombine, MergeRefusesWhatDoesNotBelongTogether) {
    render("--samples 0:4 -o a.exr");
    render("--samples 2:8 -o overlap.exr");
    render("--samples 4:8 --seed 9 -o seed.exr");
    render("--samples 8:12 -o gap.exr");
    render("--samples 4:8 --purpose proxy -o purpose.exr");
    render("--samples 4:8 --guiding on -o guiding.exr");
    for (const char* other : {"overlap.exr", "seed.exr", "gap.exr", "purpose.exr", "guiding.exr"}) {
        const CommandResult r = w.comp(fmt::format("merge a.exr {} -o m.exr", other));
        EXPECT_EQ(r.exit_code, 5) << other << ": " << r.output;
        EXPECT_FALSE(w.exists("m.exr"));
    }
}

// The profile of a lamp is part of the scene, in whatever file it stands
TEST_F(Recombine, MergeRefusesAnotherProfile) {
    w.write("lamp.usda",
            "#usda 1.0\ndef Camera \"Cam\" {\n}\ndef SphereLight \"L\" (prepend apiSchemas = "
            "[\"ShapingAPI\"]) {\n asset "
            "inputs:shaping:ies:file = @lamp.ies@\n double3 xformOp:translate = (0, 0, -5)\n "
            "uniform token[] "
            "xformOpOrder = [\"xformOp:translate\"]\n}\n");
    const auto render_lamp = [&](const char* candela, const char* samples, const char* file) {
        w.write(
            "lamp.ies",
            fmt::format("TILT=NONE\n1 -1 1 2 1 1 2 0 0 0\n1 1 1\n0 180\n0\n{0} {0}\n", candela));
        const CommandResult r = w.velatura(
            fmt::format("render lamp.usda --res 8 8 -q --samples {} -o {}", samples, file));
        ASSERT_EQ(r.exit_code, 0) << r.output;
    };
    render_lamp("100", "0:2", "a.exr");
    render_lamp("100", "2:4", "same.exr");
    render_lamp("200", "2:4", "other.exr");
    const CommandResult same = w.comp("merge a.exr same.exr -o m.exr"),
                        other = w.comp("merge a.exr other.exr -o n.exr");
    EXPECT_EQ(same.exit_code, 0) << same.output;
    EXPECT_EQ(other.exit_code, 5) << other.output;
}

TEST_F(Recombine, UnitMixIsTheBeautyBitForBit) {
    render("--spp 4 -o s.exr");
    const CommandResult r = w.comp("mix s.exr -o m.exr --gain all=1 --gain indirect=+0st");
    ASSERT_EQ(r.exit_code, 0) << r.output;
    const image::Image before = read(w, "s.exr"), after = read(w, "m.exr");
    for (const char* c : {"R", "G", "B", "A"})
        EXPECT_EQ(channel(after, c), channel(before, c)) << c;
}

TEST_F(Recombine, OneStopDoublesTheIndirectLight) {
    render("--spp 4 --bounces 2 -o s.exr");
    ASSERT_EQ(w.comp("mix s.exr -o one.exr --mute b0 --mute b1").exit_code, 0);
    const CommandResult r = w.comp("mix s.exr -o two.exr --gain indirect=+1st --mute b0 --mute b1");
    ASSERT_EQ(r.exit_code, 0) << r.output;
    const std::vector<float> one = channel(read(w, "one.exr"), "G"),
                             two = channel(read(w, "two.exr"), "G");
    double sum = 0;
    for (size_t i = 0; i < one.size(); ++i) {
        EXPECT_EQ(two[i], 2.0f * one[i]) << "pixel " << i;
        sum += double(one[i]);
    }
    EXPECT_GT(sum, 0.0);
}

TEST_F(Recombine, LightGroupsSplitTheBeauty) {
    render("--spp 4 -o s.exr");
    ASSERT_EQ(w.comp("verify s.exr").exit_code, 0);
    const image::Image all = read(w, "s.exr");
    std::vector<double> sum(channel(all, "R").size(), 0.0);
    for (const char* group : {"key", "lamp", "sky"}) {
        const CommandResult r = w.comp(fmt::format("mix s.exr -o solo.exr --solo {}", group));
        ASSERT_EQ(r.exit_code, 0) << r.output;
        const std::vector<float> solo = channel(read(w, "solo.exr"), "R");
        for (size_t i = 0; i < sum.size(); ++i) sum[i] += double(solo[i]);
    }
    const std::vector<float> beauty = channel(all, "R");
    for (size_t i = 0; i < sum.size(); ++i)
        EXPECT_NEAR(sum[i], double(beauty[i]), 1e-5 * (1.0 + double(beauty[i])));
}

TEST_F(Recombine, MutedLightIsARenderWithoutIt) {
    // The same seeds need not pick the same lights, so this compares images of many samples
    size = "12 10";
    render("--spp 256 -o s.exr");
    ASSERT_EQ(w.comp("mix s.exr -o muted.exr --mute lamp").exit_code, 0);
    std::string without = small_scene();
    const size_t at = without.find("float inputs:intensity = 10");
    ASSERT_NE(at, std::string::npos);
    without.replace(at, 27, "float inputs:intensity = 0 ");
    w.write("s.usda", without);
    render("--spp 256 -o without.exr");
    const std::vector<float> a = channel(read(w, "muted.exr"), "G"),
                             b = channel(read(w, "without.exr"), "G");
    double sum_a = 0, sum_b = 0;
    for (size_t i = 0; i < a.size(); ++i) {
        sum_a += double(a[i]);
        sum_b += double(b[i]);
    }
    EXPECT_NEAR(sum_a / sum_b, 1.0, 0.01);
}

TEST_F(Recombine, CropIsThatPartOfTheImage) {
    render("--spp 3 -o whole.exr");
    render("--spp 3 --crop 0.25 0.75 0 0.5 -o crop.exr");
    const image::Image whole = read(w, "whole.exr"), crop = read(w, "crop.exr");
    ASSERT_EQ(crop.data, (image::Window{10, 17, 30, 34}));
    const image::Channel* a = whole.find("R");
    const image::Channel* b = crop.find("R");
    for (int y = crop.data.y0; y < crop.data.y1; ++y) {
        for (int x = crop.data.x0; x < crop.data.x1; ++x) {
            EXPECT_EQ(b->value(crop.data.index(x, y)), a->value(whole.data.index(x, y)))
                << x << ", " << y;
        }
    }
}

TEST_F(Recombine, FramesGetNumbers) {
    render("--spp 1 -f 1-3x2 -o shot.####.exr");
    EXPECT_TRUE(w.exists("shot.0001.exr"));
    EXPECT_FALSE(w.exists("shot.0002.exr"));
    EXPECT_TRUE(w.exists("shot.0003.exr"));
}

TEST_F(Recombine, TimeBudgetEndsWithCode0AndAValidFile) {
    const CommandResult r =
        w.velatura("render s.usda --res " + size + " --spp 1000000 --time 0.3s -o s.exr");
    EXPECT_EQ(r.exit_code, 0) << r.output;
    EXPECT_NE(r.output.find("stopped at --time 0.3s before all 1000000 samples per pixel after "),
              std::string::npos)
        << r.output;
    EXPECT_EQ(w.comp("verify s.exr").exit_code, 0);
}

TEST_F(Recombine, ReachedTargetEndsWithCode0) {
    const CommandResult r =
        w.velatura("render s.usda --res " + size + small + "--spp 64 --target-error 90% -o s.exr");
    EXPECT_EQ(r.exit_code, 0) << r.output;
    for (const std::string strict : {"", " --require-target"}) {
        const CommandResult missed = w.velatura("render s.usda --res " + size +
                                                " --spp 2 --target-error 0.01% -o s.exr" + strict);
        EXPECT_EQ(missed.exit_code, strict.empty() ? 0 : 3);
        EXPECT_NE(
            missed.output.find("stopped at --spp 2 before --target-error 0.01% after 2 samples "
                               "per pixel: the error is "),
            std::string::npos)
            << missed.output;
    }
}

TEST_F(Recombine, OptionsOutOfRangeAreUsageErrors) {
    for (const char* option : {"--target-error 20", "--target-error 0", "--time 0", "--snapshot 0s",
                               "--seed -1", "--purpose renders", "--search-path nowhere"})
        EXPECT_EQ(
            w.velatura("render s.usda --res " + size + small + "--spp 1 " + option + " -o no.exr")
                .exit_code,
            2)
            << option;
    EXPECT_FALSE(w.exists("no.exr"));
}

TEST_F(Recombine, DefaultTimeIsNotTimeZero) {
    // Default green, red at time 0
    w.write("t.usda", R"usda(#usda 1.0
def Sphere "S"
{
    color3f[] primvars:displayColor = [(0, 1, 0)]
    color3f[] primvars:displayColor.timeSamples = {
        0: [(1, 0, 0)],
    }
}
def DomeLight "D"
{
}
)usda");
    const std::string common = std::string(" --res 9 9 --spp 2") + small;
    ASSERT_EQ(w.velatura("render t.usda -o d.exr -f default" + common).exit_code, 0);
    ASSERT_EQ(w.velatura("render t.usda -o f.exr -f 0" + common).exit_code, 0);
    const size_t middle = 40;
    EXPECT_EQ(channel(read(w, "d.exr"), "albedo.R")[middle], 0.0f);
    EXPECT_EQ(channel(read(w, "f.exr"), "albedo.G")[middle], 0.0f);
    EXPECT_GT(channel(read(w, "d.exr"), "albedo.G")[middle], 0.9f);
}

TEST_F(Recombine, StatisticsHaveTheKeysOfTheSchema) {
    render("--spp 2 -o s.exr --stats s.json");
    const CommandResult r =
        w.velatura("render s.usda --res " + size + small + "--spp 2 --replay 20,30,1");
    EXPECT_EQ(r.exit_code, 0) << r.output;
    EXPECT_NE(r.output.find("pixel (20, 30) sample 1: radiance"), std::string::npos) << r.output;
    EXPECT_TRUE(w.exists("s.json"));
}

}  // namespace velatura::test
