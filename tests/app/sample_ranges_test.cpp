// SPDX-License-Identifier: Apache-2.0
// One frame as several sample ranges, as farms render it: what parts state.
#include "base/atomic_file.h"
#include "command.h"
#include "image/exr.h"
#include "layers/layer_header.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include <array>
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

}  // namespace velatura::test
