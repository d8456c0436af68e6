// SPDX-License-Identifier: Apache-2.0
// One frame as several sample ranges, as farms render it: what parts state, what merge reports.
#include "base/atomic_file.h"
#include "command.h"
#include "image/exr.h"
#include "layers/layer_header.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace velatura::test {

namespace {

using Json = nlohmann::ordered_json;

class SampleRanges : public testing::Test {
  protected:
    void SetUp() override { w.write("s.usda", small_scene()); }

    CommandResult try_render(const std::string& arguments) {
        return w.velatura("render s.usda --res 24 18 " + arguments);
    }

    void render(const std::string& arguments) {
        const CommandResult r = try_render("--progress none -q " + arguments);
        ASSERT_EQ(r.exit_code, 0) << arguments << ": " << r.output;
    }

    std::string bytes(const std::string& name) {
        const Result<std::string> content = read_file(w.path(name));
        EXPECT_TRUE(content.has_value()) << name;
        return content ? *content : std::string();
    }

    /// Of `merge … --json`, and its exit code.
    std::pair<int, Json> merge(const std::string& arguments) {
        const CommandResult r = w.comp("merge --json " + arguments);
        const size_t begin = r.output.find("{\"schema\":\"velatura.merge/1\"");
        EXPECT_NE(begin, std::string::npos) << r.output;
        if (begin == std::string::npos) return {r.exit_code, Json()};
        const std::string line = r.output.substr(begin, r.output.find('\n', begin) - begin);
        return {r.exit_code, Json::parse(line, nullptr, false)};
    }

    Json settings_of(const std::string& name) {
        const Result<image::Image> file = image::read_exr(w.path(name));
        EXPECT_TRUE(file.has_value()) << name;
        return file ? Json::parse(file->text(layers::settings_attribute)) : Json();
    }

    Workplace w;
};

bool has(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

}  // namespace

TEST_F(SampleRanges, OpenJobDescriptionNamesTheReasonOfAFailure) {
    const CommandResult missing = w.velatura("render none.usda --progress openjd -o no.exr");
    EXPECT_EQ(missing.exit_code, 1);
    EXPECT_TRUE(has(missing.output, "\nopenjd_fail: ")) << missing.output;
    EXPECT_TRUE(has(missing.output, "none.usda")) << missing.output;
    EXPECT_TRUE(has(missing.output, "(exit code 1)\n")) << missing.output;

    const CommandResult missed =
        try_render("--spp 2 --target-error 0.01% --require-target --progress openjd -o no.exr");
    EXPECT_EQ(missed.exit_code, 3);
    EXPECT_TRUE(has(missed.output, "\nopenjd_fail: target missed")) << missed.output;

    // Also of a command line that ends before anything is read, and of a scene that cannot be
    for (const std::string wrong : {"--progress openjd --sppp 2", "--spp x --progress=openjd"}) {
        const CommandResult r = try_render(wrong + " -o no.exr");
        EXPECT_EQ(r.exit_code, 2);
        EXPECT_TRUE(has(r.output, "openjd_fail: ")) << r.output;
        EXPECT_TRUE(has(r.output, "--spp")) << r.output;
        EXPECT_TRUE(has(r.output, "[usage] (exit code 2)\n")) << r.output;
    }
    w.write("bad.usda", "#usda 1.0\ndef Sphere \"S\" {\n");
    const CommandResult bad = w.velatura("render bad.usda --strict --progress openjd -o no.exr");
    EXPECT_EQ(bad.exit_code, 1);
    EXPECT_TRUE(has(bad.output, "\nopenjd_fail: ")) << bad.output;

    for (const char* fine : {"--spp 2 --progress openjd", "--spp 2 --progress json"}) {
        const CommandResult r = try_render(std::string(fine) + " -o ok.exr");
        EXPECT_EQ(r.exit_code, 0);
        EXPECT_FALSE(has(r.output, "openjd_fail")) << r.output;
    }
    const CommandResult json = w.velatura("render none.usda --progress json -o no.exr");
    EXPECT_FALSE(has(json.output, "openjd_fail")) << json.output;
}

/// A part that judged itself by its own samples ended early with exit code 0, and left a gap.
TEST_F(SampleRanges, APartHasNoTargetErrorOfItsOwn) {
    const CommandResult r =
        try_render("--samples 0:64 --target-error 5% --progress openjd -o part.exr");
    EXPECT_EQ(r.exit_code, 2);
    EXPECT_TRUE(has(r.output, "--samples and --target-error cannot be combined")) << r.output;
    EXPECT_TRUE(has(r.output, "openjd_fail: --samples and --target-error")) << r.output;
    EXPECT_FALSE(w.exists("part.exr"));
}

TEST_F(SampleRanges, StatisticsStateWhatARenderCost) {
    render("--samples 0:20 --stats part.json -o part.exr");
    const Json stats = Json::parse(bytes("part.json"));
    std::array<char, 256> host{};
    ASSERT_EQ(::gethostname(host.data(), host.size() - 1), 0);
    EXPECT_EQ(stats["header"]["host"], host.data());
    EXPECT_EQ(stats["header"]["build"], settings_of("part.exr")["build"]);
    const double wall = stats["process_s"]["wall"], cpu = stats["process_s"]["cpu"],
                 render_s = stats["phases_s"]["render"], write_s = stats["phases_s"]["write"];
    EXPECT_GT(write_s, 0);
    EXPECT_GE(wall, render_s + write_s);
    // Clocks of the CPU tick up to ten milliseconds late
    EXPECT_GT(cpu, 0);
    EXPECT_LT(cpu, wall * double(stats["header"]["threads"]) + 0.2);
}

/// What a part was to have and whether it has it stands in its header, so that nothing that was
/// stopped is taken for a whole one.
TEST_F(SampleRanges, PartsStateTheirRangeAndWhetherTheyAreComplete) {
    render("--samples 0:20 -o a.exr");
    EXPECT_EQ(settings_of("a.exr")["part"], Json::parse(R"({"samples":[0,20],"complete":true})"));
    render("--samples 20:100000 --time 0.05s -o b.exr");
    EXPECT_EQ(settings_of("b.exr")["part"],
              Json::parse(R"({"samples":[20,100000],"complete":false})"));
    render("--spp 8 -o whole.exr");
    EXPECT_EQ(settings_of("whole.exr")["part"],
              Json::parse(R"({"samples":[0,8],"complete":true})"));
    // Budgets that end a render by themselves
    render("--time 0.05s -o timed.exr");
    const Json timed = settings_of("timed.exr")["part"];
    EXPECT_EQ(timed["complete"], true);
    EXPECT_GT(timed["samples"][1].get<uint64_t>(), 0u);

    const auto [code, refused] = merge("a.exr b.exr -o all.exr");
    EXPECT_EQ(code, 5);
    EXPECT_EQ(refused["merged"], false);
    ASSERT_EQ(refused["faults"].size(), 1u) << refused;
    EXPECT_EQ(refused["faults"][0]["kind"], "incomplete");
    EXPECT_EQ(refused["faults"][0]["files"], Json::array({"b.exr"}));
    EXPECT_EQ(refused["faults"][0]["samples"], Json::array({20, 100000}));
    EXPECT_FALSE(w.exists("all.exr"));

    const auto [accepted, report] = merge("--incomplete a.exr b.exr -o all.exr --resumable");
    EXPECT_EQ(accepted, 0) << report;
    EXPECT_EQ(report["complete"], false);
    EXPECT_EQ(settings_of("all.exr")["part"],
              Json::parse(R"({"samples":[0,100000],"complete":false})"));
    // It goes on where it was stopped, and is a whole one then
    render("--spp 8 -o first.exr --resumable");
    render("--spp 12 -o first.exr --resume");
    EXPECT_EQ(settings_of("first.exr")["part"],
              Json::parse(R"({"samples":[0,12],"complete":true})"));
}

TEST_F(SampleRanges, OnlyTheLastPartCanBeIncomplete) {
    render("--samples 0:100000 --time 0.05s -o a.exr");
    render("--samples 100000:100002 -o b.exr");
    const auto [code, report] = merge("--incomplete a.exr b.exr -o all.exr");
    EXPECT_EQ(code, 5);
    ASSERT_EQ(report["faults"].size(), 1u) << report;
    EXPECT_EQ(report["faults"][0]["kind"], "gap");
    EXPECT_EQ(report["faults"][0]["files"], Json::array({"a.exr"}));
    EXPECT_TRUE(has(report["faults"][0]["text"], "only the last part can be")) << report;
}

TEST_F(SampleRanges, MergeChecksTheRangeThatIsExpected) {
    render("--samples 0:4 -o a.exr");
    render("--samples 4:8 -o b.exr");
    render("--samples 12:16 -o d.exr");
    const auto [code, report] = merge("b.exr a.exr -o all.exr --expect 0:8");
    EXPECT_EQ(code, 0) << report;
    EXPECT_EQ(report["samples"], Json::array({0, 8}));
    EXPECT_EQ(report["complete"], true);
    EXPECT_EQ(report["sha256"], w.hash("all.exr"));
    ASSERT_EQ(report["parts"].size(), 2u);
    EXPECT_EQ(report["parts"][0]["file"], "a.exr");
    EXPECT_EQ(report["parts"][1]["samples"], Json::array({4, 8}));

    // Every gap is told, as a range
    const auto [lacking, gaps] = merge("a.exr b.exr d.exr -o no.exr --expect 0:20");
    EXPECT_EQ(lacking, 5);
    ASSERT_EQ(gaps["faults"].size(), 2u) << gaps;
    EXPECT_EQ(gaps["faults"][0]["samples"], Json::array({8, 12}));
    EXPECT_EQ(gaps["faults"][1]["samples"], Json::array({16, 20}));
    const auto [few, beyond] = merge("a.exr b.exr -o no.exr --expect 2:6");
    EXPECT_EQ(few, 5);
    EXPECT_EQ(beyond["faults"].size(), 2u) << beyond;
    EXPECT_EQ(beyond["faults"][0]["kind"], "unexpected");
    EXPECT_FALSE(w.exists("no.exr"));
    for (const char* wrong : {"8", "8:8", "a:b", "0:4x"})
        EXPECT_EQ(w.comp(fmt::format("merge a.exr -o no.exr --expect {}", wrong)).exit_code, 2);
}

/// All that keeps files from being parts of one render is told at once, by name.
TEST_F(SampleRanges, RefusalsNameEveryFault) {
    w.write("t.usda", small_scene() + textured_ball("wood.png"));
    const auto render_ball = [&](const std::string& arguments) {
        const CommandResult r = w.velatura(
            "render t.usda --res 12 9 -q --progress none --missing-assets ignore " + arguments);
        ASSERT_EQ(r.exit_code, 0) << r.output;
    };
    w.write("wood.png", "what is no picture gives its fallback");
    render_ball("--samples 0:2 -o a.exr");
    render_ball("--samples 2:4 -o b.exr");
    std::filesystem::remove(w.path("wood.png"));
    render_ball("--samples 4:6 --max-depth 3 --seed 4 -o c.exr");
    w.write("t.usda", small_scene() + textured_ball("wood.png") + "def Sphere \"More\" {}\n");
    render_ball("--samples 6:8 -o d.exr");
    const CommandResult r = w.comp("merge a.exr b.exr c.exr d.exr none.exr -o no.exr");
    EXPECT_EQ(r.exit_code, 5);
    for (const char* text :
         {"a.exr and c.exr, d.exr were rendered with different files: wood.png is missing in the "
          "second",
          "a.exr and c.exr were rendered with different settings: --max-depth 0 and 3, seed 0 and "
          "4",
          "a.exr and c.exr have different seeds: 0 and 4", "a.exr and d.exr show different scenes",
          "none.exr"})
        EXPECT_TRUE(has(r.output, text)) << text << " in: " << r.output;
    EXPECT_FALSE(w.exists("no.exr"));
}

TEST_F(SampleRanges, PartsOfAnotherOpinionFromTheShellDoNotMerge) {
    render("--samples 0:2 -o a.exr");
    render("--samples 2:4 --set /W/Ball.radius=0.25 -o b.exr");
    const CommandResult r = w.comp("merge a.exr b.exr -o no.exr");
    EXPECT_EQ(r.exit_code, 5);
    EXPECT_TRUE(has(r.output, "a.exr and b.exr show different scenes")) << r.output;
    EXPECT_FALSE(w.exists("no.exr"));
    // The same opinion is the same scene
    render("--samples 0:2 --set /W/Ball.radius=0.25 -o a.exr");
    EXPECT_EQ(w.comp("merge a.exr b.exr -o all.exr").exit_code, 0);
}

/// The file that differs is named, not all the others.
TEST_F(SampleRanges, PartsAreComparedWithMostOfThem) {
    render("--samples 0:2 --filter box -o a.exr");
    render("--samples 2:4 -o b.exr");
    render("--samples 4:6 -o c.exr");
    const auto [code, report] = merge("a.exr b.exr c.exr -o no.exr");
    EXPECT_EQ(code, 5);
    ASSERT_EQ(report["faults"].size(), 1u) << report;
    EXPECT_EQ(report["faults"][0]["files"], Json::array({"a.exr"}));
    EXPECT_TRUE(has(report["faults"][0]["text"], "--filter blackman-harris and box")) << report;
}

TEST_F(SampleRanges, MergeSaysWhatThePartsWereRenderedWithout) {
    w.write("s.usda", small_scene() + textured_ball("none.png") +
                          "def \"A\" (references = @none.usda@) {}\n");
    render("--missing-assets ignore --samples 0:2 -o a.exr");
    render("--missing-assets ignore --samples 2:4 -o b.exr");
    const Json lacks = {"layer none.usda", "texture none.png"};
    EXPECT_EQ(settings_of("a.exr")["lacks"], lacks);
    const auto [code, report] = merge("a.exr b.exr -o all.exr");
    EXPECT_EQ(code, 0);
    EXPECT_EQ(report["parts"][1]["lacks"], lacks);
    const CommandResult r = w.comp("merge a.exr b.exr -o all.exr");
    EXPECT_TRUE(has(r.output, "warning: all parts were rendered without texture none.png"))
        << r.output;
    EXPECT_EQ(settings_of("all.exr")["lacks"], lacks);
}

/// The header of a merged file, its error and biased settings included, is that of one render.
TEST_F(SampleRanges, AMergedFileIsThatOfOneRenderByteForByte) {
    for (const char* options :
         {"", "--max-depth 4 --bounces 4", "--halves --clamp-indirect 0.5",
          "--sampler stratified --cryptomatte object", "--adaptive off --sampler independent"}) {
        const std::string common = std::string(options) + " ";
        render(common + "--spp 40 -o whole.exr");
        render(common + "--spp 40 --resumable -o sums.exr");
        render(common + "--samples 0:18 -o a.exr");
        render(common + "--samples 18:32 -o b.exr");
        render(common + "--samples 32:40 -o c.exr");
        EXPECT_EQ(merge("a.exr b.exr c.exr -o all.exr").first, 0);
        EXPECT_TRUE(bytes("all.exr") == bytes("whole.exr")) << options;
        EXPECT_EQ(merge("b.exr c.exr a.exr --resumable -o all.exr").first, 0);
        EXPECT_TRUE(bytes("all.exr") == bytes("sums.exr")) << options;
    }
}

TEST_F(SampleRanges, RatesOfTheFirstPartTakeThePlaceOfThePilot) {
    render("--samples 0:20 -o a.exr");
    render("--samples 20:36 --stats own.json -o own.exr");
    render("--samples 20:36 --rates-from a.exr --stats taken.json -o taken.exr");
    EXPECT_TRUE(bytes("taken.exr") == bytes("own.exr"));
    const uint64_t own = Json::parse(bytes("own.json"))["samples"]["total"],
                   taken = Json::parse(bytes("taken.json"))["samples"]["total"];
    EXPECT_EQ(own, taken + 16u * 24 * 18);
    render("--samples 20:36 --rates-from a.exr --mode tile -o tile.exr");
    EXPECT_TRUE(bytes("tile.exr") == bytes("own.exr"));
    // Of whatever layout
    for (const std::string layout : {"single", "split"}) {
        const std::string first = layout + ".exr", others = " --exr-layout " + layout;
        render("--samples 0:20 -o " + first + others);
        render("--samples 20:36 -o own/b.exr" + others);
        render("--samples 20:36 -o taken/b.exr --rates-from " + first + others);
        EXPECT_TRUE(bytes("taken/b.exr") == bytes("own/b.exr")) << layout;
    }
    // And on from a part of it
    render("--samples 20:24 --rates-from a.exr -o part.exr");
    render("--samples 20:36 --rates-from a.exr --resume -o part.exr");
    EXPECT_TRUE(bytes("part.exr") == bytes("own.exr"));
}

TEST_F(SampleRanges, RatesOfAnotherRenderAreRefused) {
    render("--samples 0:16 -o short.exr");
    render("--samples 0:18 --seed 3 -o seed.exr");
    render("--samples 0:18 --layers none -o layers.exr");
    render("--samples 0:18 --crop 0 0.5 0 1 -o crop.exr");
    render("--spp 18 -o plain.exr");
    render("--samples 0:18 -o damaged.exr");
    auto damaged = image::read_exr(w.path("damaged.exr"));
    for (image::Part& part : damaged->parts)
        for (image::Channel& c : part.channels)
            if (c.name == "sums_rate") std::get<std::vector<uint32_t>>(c.data)[7] ^= 1;
    ASSERT_TRUE(image::write_exr(w.path("damaged.exr"), *damaged).has_value());
    const auto expect = [&](int code, const std::string& arguments, const std::string& why) {
        const CommandResult r = try_render("--progress none " + arguments + " -o no.exr");
        EXPECT_EQ(r.exit_code, code) << arguments << ": " << r.output;
        EXPECT_TRUE(has(r.output, why)) << arguments << ": " << r.output;
        EXPECT_FALSE(w.exists("no.exr"));
    };
    const std::string later = "--samples 18:20 --rates-from ";
    expect(5, later + "short.exr", "has no rates of adaptive sampling");
    expect(5, later + "seed.exr", "seed was 3, now 0");
    expect(5, later + "layers.exr", "it stores other light layers");
    expect(5, later + "crop.exr", "it has the pixels [0, 12) x [0, 18)");
    expect(5, later + "plain.exr", "it has no sums");
    expect(5, later + "damaged.exr", "the stored sums are damaged");
    expect(5, later + "none.exr", "none.exr");
    expect(2, "--spp 20 --rates-from seed.exr", "--rates-from needs --samples");
    expect(2, later + "seed.exr --adaptive off", "cannot be combined");
}

TEST_F(SampleRanges, SppBoundsTheRange) {
    render("--spp 8 --samples 4:8 -o a.exr");
    render("--samples 4:8 -o b.exr");
    EXPECT_TRUE(bytes("a.exr") == bytes("b.exr"));
    const CommandResult r = try_render("--spp 8 --samples 4:9 -o no.exr");
    EXPECT_EQ(r.exit_code, 2);
    EXPECT_TRUE(has(r.output, "--samples 4:9 reaches beyond --spp 8")) << r.output;
}

TEST_F(SampleRanges, WithoutAnAssetNothingIsRenderedWhereAllAreRequired) {
    w.write("s.usda", small_scene() + textured_ball("none.png"));
    const CommandResult r = try_render("--samples 0:2 --require-assets --progress json -o no.exr");
    EXPECT_EQ(r.exit_code, 1);
    EXPECT_TRUE(has(r.output, "missing: texture none.png; --require-assets renders nothing"))
        << r.output;
    EXPECT_FALSE(has(r.output, "percent")) << r.output;
    EXPECT_FALSE(w.exists("no.exr"));
    w.write("s.usda", small_scene());
    render("--samples 0:2 --require-assets -o a.exr");
    render("--samples 0:2 -o b.exr");
    EXPECT_TRUE(bytes("a.exr") == bytes("b.exr")) << "no setting of the image";
    EXPECT_EQ(try_render("--require-assets --missing-assets ignore -o x.exr").exit_code, 2);
}

/// Subdivision has a fallback, control meshes, with which hours of rendering are of no use.
TEST_F(SampleRanges, StrictRendersNothingWithoutAPlugin) {
    w.write("s.usda", small_scene() + R"(def Mesh "Smooth"
{
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    uniform token subdivisionScheme = "catmullClark"
}
)");
    // Plugins are found beside the program's own folder
    std::filesystem::create_directory(w.path("bin"));
    std::filesystem::copy_file(std::string(VELATURA_BIN_DIR) + "/velatura", w.path("bin/velatura"));
    const auto render_alone = [&](const std::string& arguments) {
        CommandResult r;
        const std::string line = fmt::format(
            "cd '{}' && bin/velatura render s.usda --res 8 6 --samples 0:2 {} > out.txt 2>&1",
            w.path(""), arguments);
        const int status = std::system(line.c_str());
        r.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
        r.output = bytes("out.txt");
        return r;
    };
    const CommandResult lax = render_alone("-o lax.exr");
    EXPECT_EQ(lax.exit_code, 1) << lax.output;
    EXPECT_EQ(settings_of("lax.exr")["lacks"], Json::array({"plugin subdivision"}));
    const CommandResult strict = render_alone("--strict --progress openjd -o strict.exr");
    EXPECT_EQ(strict.exit_code, 1) << strict.output;
    EXPECT_TRUE(has(strict.output, "plugin subdivision is missing; --strict renders nothing"))
        << strict.output;
    EXPECT_TRUE(has(strict.output, "openjd_fail: ")) << strict.output;
    EXPECT_FALSE(w.exists("strict.exr"));
}

}  // namespace velatura::test
