// SPDX-License-Identifier: Apache-2.0
// One frame as several sample ranges, as farms render it: what parts state.
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
