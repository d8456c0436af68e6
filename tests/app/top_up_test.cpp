// SPDX-License-Identifier: Apache-2.0
// From a mix to a request to further samples, through the two programs.
#include "base/atomic_file.h"
#include "command.h"
#include "image/exr.h"
#include "layers/layer_header.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <string>

namespace velatura::test {

namespace {

class TopUpCommands : public testing::Test {
  protected:
    void SetUp() override {
        w.write("s.usda", small_scene());
        render("--spp 20 --resumable -o base.exr");
    }

    CommandResult try_render(const std::string& arguments) {
        return w.velatura("render s.usda --res " + resolution + " --halves --progress none -q " +
                          arguments);
    }

    void render(const std::string& arguments) {
        const CommandResult r = try_render(arguments);
        ASSERT_EQ(r.exit_code, 0) << r.output;
    }

    void plan(const std::string& arguments) {
        const CommandResult r = w.comp("request base.exr " + arguments);
        ASSERT_EQ(r.exit_code, 0) << r.output;
    }

    std::string bytes(const std::string& name) {
        const Result<std::string> content = read_file(w.path(name));
        EXPECT_TRUE(content.has_value()) << name;
        return content ? *content : std::string();
    }

    void copy(const std::string& from, const std::string& to) {
        ASSERT_TRUE(write_file_atomically(w.path(to), bytes(from)).has_value());
    }

    double mean_samples(const std::string& name) {
        const Result<image::Image> file = image::read_exr(w.path(name));
        const image::Channel* counts = file ? file->find("sampleCount") : nullptr;
        EXPECT_NE(counts, nullptr);
        double sum = 0;
        for (size_t i = 0; counts && i < counts->size(); ++i) sum += double(counts->value(i));
        return counts ? sum / double(counts->size()) : 0;
    }

    Workplace w;
    std::string resolution = "40 34";
};

}  // namespace

TEST_F(TopUpCommands, OneFileHoweverTheRequestIsServed) {
    // Tiles of smaller images judge too few pixels to meet the mean
    resolution = "80 68";
    render("--spp 20 --resumable -o base.exr");
    plan("--gain lamp=+3st --samples-factor 3 -o look.json");
    copy("base.exr", "whole.exr");
    render("--resume --for-mix look.json -o whole.exr");
    const nlohmann::json request = nlohmann::json::parse(bytes("look.json"));
    EXPECT_NEAR(mean_samples("whole.exr"), request.at("samples").get<double>(),
                0.04 * request.at("samples").get<double>());
    EXPECT_EQ(w.comp("verify whole.exr").exit_code, 0);
    for (const char* how :
         {"--threads 1 --mode tile", "--threads 3 --tile 16", "--snapshot 0.01s"}) {
        copy("base.exr", "other.exr");
        render(fmt::format("--resume --for-mix look.json {} -o other.exr", how));
        EXPECT_TRUE(bytes("other.exr") == bytes("whole.exr")) << how;
    }
    // Stopped on the way, and asked again when all is done
    copy("base.exr", "other.exr");
    const CommandResult stopped =
        try_render("--resume --for-mix look.json --time 0.01s -o other.exr");
    EXPECT_TRUE(stopped.exit_code == 0) << stopped.output;
    for (int i = 0; i < 2; ++i) {
        render("--resume --for-mix look.json -o other.exr");
        EXPECT_TRUE(bytes("other.exr") == bytes("whole.exr")) << i;
    }
    // The header says for which look; --spp beats the request
    const Result<image::Image> file = image::read_exr(w.path("whole.exr"));
    const nlohmann::json settings = nlohmann::json::parse(file->text(layers::settings_attribute));
    ASSERT_EQ(settings.at("topUps").size(), 1u);
    EXPECT_EQ(settings["topUps"][0].at("look"), request.at("look"));
    render("--resume --for-mix look.json --spp 100 -o other.exr");
    EXPECT_NEAR(mean_samples("other.exr"), 100, 4);
    // And a topped-up file goes on evenly
    render("--resume --spp 128 -o other.exr");
    EXPECT_GE(mean_samples("other.exr"), 120);
}

TEST_F(TopUpCommands, TheForecastHolds) {
    // Errors of independent points fall as the root of their number; those of Sobol' points sooner
    render("--spp 40 --sampler independent --resumable -o base.exr");
    plan("--gain indirect=+3st --target 6% -o look.json");
    render("--sampler independent --resume --for-mix look.json -o base.exr");
    const CommandResult noise = w.comp("noise base.exr --gain indirect=+3st --json");
    ASSERT_EQ(noise.exit_code, 0) << noise.output;
    EXPECT_NEAR(nlohmann::json::parse(noise.output)["mix"]["value"].get<double>(), 0.06, 0.009);
}

TEST_F(TopUpCommands, RequestsOfOtherRendersAreRefused) {
    plan("--gain lamp=+3st --samples-factor 2 -o look.json");
    const std::string before = bytes("base.exr");
    const auto expect = [&](int code, const std::string& arguments, const std::string& why) {
        const CommandResult r = try_render(arguments);
        EXPECT_EQ(r.exit_code, code) << arguments << ": " << r.output;
        EXPECT_NE(r.output.find(why), std::string::npos) << arguments << ": " << r.output;
    };
    render("--spp 4 --seed 3 --resumable -o seed.exr");
    expect(5, "--seed 3 --resume --for-mix look.json -o seed.exr",
           "look.json was written for other render settings");
    render("--spp 4 --crop 0 0.5 0 1 --resumable -o crop.exr");
    expect(5, "--crop 0 0.5 0 1 --resume --for-mix look.json -o crop.exr",
           "look.json was written for the pixels");
    expect(5, "--resume --for-mix look.json -o nowhere.exr",
           "file not found; --for-mix continues an existing file");
    expect(2, "--for-mix look.json -o base.exr", "--for-mix needs --resume");
    expect(1, "--resume --for-mix missing.json -o base.exr", "missing.json");
    w.write("preset.json", R"({"schema": "velatura.look/1", "controls": []})");
    expect(1, "--resume --for-mix preset.json -o base.exr",
           "not a request file of `velatura-comp request`");
    EXPECT_TRUE(bytes("base.exr") == before);
}

TEST_F(TopUpCommands, PlansThatCannotBe) {
    const auto expect = [&](int code, const std::string& arguments, const std::string& why) {
        const CommandResult r = w.comp("request " + arguments);
        EXPECT_EQ(r.exit_code, code) << arguments << ": " << r.output;
        EXPECT_NE(r.output.find(why), std::string::npos) << arguments << ": " << r.output;
    };
    render("--spp 4 -o plain.exr");
    expect(1, "plain.exr -o look.json", "render with --resumable");
    ASSERT_EQ(
        w.velatura("render s.usda --res 20 17 --spp 4 --resumable -q -o halfless.exr").exit_code,
        0);
    expect(1, "halfless.exr -o look.json", "render with --halves");
    expect(2, "base.exr -o look.txt", "is not .json");
    expect(2, "base.exr --target 0 -o look.json", "--target: cannot read '0'");
    expect(2, "base.exr --gain nobody=2 -o look.json", "nobody");
    EXPECT_NE(w.comp("request base.exr --time 10m -o look.json").exit_code, 0);
    EXPECT_NE(w.comp("request base.exr --spp 9 --target 1% -o look.json").exit_code, 0);
    EXPECT_FALSE(w.exists("look.json"));
    const CommandResult reached = w.comp("request base.exr --target 90% -o look.json");
    EXPECT_NE(reached.output.find("90 % is already reached"), std::string::npos) << reached.output;
}

}  // namespace velatura::test
