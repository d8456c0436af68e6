// SPDX-License-Identifier: Apache-2.0
// `velatura farm` on this machine: the image is that of one render, whatever happens to its pieces.
#include "base/atomic_file.h"
#include "command.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <filesystem>
#include <fstream>
#include <string>

namespace velatura::test {

namespace {

using nlohmann::json;

constexpr const char* options = " --res 24 20 --spp 24 --bounces 1 --layers bounce,light";

class FarmCommand : public ::testing::Test {
  protected:
    void SetUp() override { w.write("s.usda", small_scene()); }

    CommandResult submit(const std::string& more) const {
        return w.velatura(std::string("farm submit s.usda -o out.exr --pieces 3 --job j") +
                          options + " " + more);
    }

    /// A program in front of `velatura`: `script` runs before each render with its arguments.
    std::string program(const std::string& script) const {
        w.write("front.sh",
                "#!/bin/sh\n" + script + "\nexec " + VELATURA_BIN_DIR + "/velatura \"$@\"\n");
        std::filesystem::permissions(w.path("front.sh"), std::filesystem::perms::owner_all);
        return "--program " + w.path("front.sh");
    }

    json status() const {
        const CommandResult r = w.velatura("farm status j --json");
        EXPECT_EQ(r.exit_code, 0) << r.output;
        return json::parse(r.output, nullptr, false);
    }

    void expect_image_of_one_render() const {
        const CommandResult r =
            w.velatura(std::string("render s.usda -o one.exr --progress none -q") + options);
        ASSERT_EQ(r.exit_code, 0) << r.output;
        EXPECT_EQ(w.hash("out.exr"), w.hash("one.exr"));
    }

    void change_byte(const std::string& name) const {
        std::fstream file(w.path(name), std::ios::in | std::ios::out | std::ios::binary);
        file.seekg(0, std::ios::end);
        const std::streamoff middle = file.tellg() / 2;
        file.seekg(middle);
        const char byte = char(file.get());
        file.seekp(middle);
        file.put(char(byte ^ 0x20));
    }

    Workplace w;
};

void expect_words(const std::string& text, std::initializer_list<const char*> words) {
    for (const char* word : words)
        EXPECT_NE(text.find(word), std::string::npos) << "\"" << word << "\" in\n" << text;
}

TEST_F(FarmCommand, GivesTheImageOfOneRender) {
    const CommandResult r = submit("--slots 2");
    ASSERT_EQ(r.exit_code, 0) << r.output;
    expect_words(r.output, {"j: 3 pieces of 1 frame", "piece 1 (samples 8:16) done", "/out.exr"});
    expect_image_of_one_render();
    const json s = status();
    EXPECT_EQ(s["state"], "complete");
    EXPECT_EQ(s["pieces"]["done"], 3);
    EXPECT_GT(s["cpu_s"], 0);
    for (const json& piece : s["list"]) EXPECT_EQ(piece["attempts"], 1);
    EXPECT_EQ(w.velatura("farm wait j -q").exit_code, 0);
    const CommandResult watched = w.velatura("farm status j --watch");
    EXPECT_EQ(watched.exit_code, 0);
    expect_words(watched.output, {"complete, 3 of 3 pieces done", "error "});
    // A second job in the folder would overwrite it
    const CommandResult again = submit("");
    EXPECT_EQ(again.exit_code, 1);
    expect_words(again.output, {"[farm-job]", "farm retry"});
}

TEST_F(FarmCommand, RendersFramesIntoASequence) {
    const std::string render = " s.usda -o 'f.####.exr' --frames 1,3 --res 16 12 --spp 4";
    const CommandResult r = w.velatura("farm submit" + render + " --pieces 2");
    ASSERT_EQ(r.exit_code, 0) << r.output;
    EXPECT_TRUE(w.exists("f.farm/job.json")) << "the folder is named after the output";
    std::filesystem::rename(w.path("f.0003.exr"), w.path("farmed.exr"));
    ASSERT_EQ(w.velatura("render" + render + " --progress none -q").exit_code, 0);
    EXPECT_EQ(w.hash("f.0003.exr"), w.hash("farmed.exr"));
}

TEST_F(FarmCommand, RendersOnlyTheFailedPieceAgain) {
    const CommandResult r = submit(
        program("case \"$*\" in *--samples=8:16*) [ -e hit ] || { : > hit; kill -9 $$; };; esac"));
    ASSERT_EQ(r.exit_code, 0) << r.output;
    expect_words(r.output, {"warning: piece 1 (samples 8:16) failed on", "killed by signal 9",
                            "trying again", "[farm-piece-failed]"});
    expect_image_of_one_render();
    const json s = status();
    EXPECT_EQ(s["list"][0]["attempts"], 1);
    EXPECT_EQ(s["list"][1]["attempts"], 2);
    EXPECT_EQ(s["list"][2]["attempts"], 1);
}

TEST_F(FarmCommand, APieceThatAlwaysFailsIsNamedAndTheOthersAreKept) {
    const CommandResult r = submit("--retries 1 " + program("case \"$*\" in *--samples=8:16*) "
                                                            "[ -e mended ] || { echo 'error: no "
                                                            "plugin [x]' >&2; exit 1; };; esac"));
    EXPECT_EQ(r.exit_code, 1) << r.output;
    expect_words(r.output, {"giving up", "[farm-incomplete]", "missing: pieces 1", "no plugin [x]",
                            "exit code 1", "velatura farm retry", "logs/0001.2.log"});
    EXPECT_FALSE(w.exists("out.exr"));
    EXPECT_EQ(status()["state"], "incomplete");
    EXPECT_EQ(status()["list"][1]["attempts"], 2);
    EXPECT_EQ(w.velatura("farm wait j").exit_code, 1);
    const CommandResult merge = w.velatura("farm merge j");
    EXPECT_EQ(merge.exit_code, 1) << merge.output;

    w.write("mended", "");
    const CommandResult retry = w.velatura("farm retry j");
    EXPECT_EQ(retry.exit_code, 0) << retry.output;
    expect_image_of_one_render();
    EXPECT_EQ(status()["list"][0]["attempts"], 1) << "what was done stays";
}

TEST_F(FarmCommand, WhatAnotherTryRepeatsIsNotTriedAgain) {
    const CommandResult r =
        submit("--retries 5 " + program("case \"$*\" in *--samples=8:16*) exit 2;; esac"));
    EXPECT_EQ(r.exit_code, 1) << r.output;
    EXPECT_EQ(status()["list"][1]["attempts"], 1);
}

TEST_F(FarmCommand, ADamagedPartIsRenderedAgain) {
    ASSERT_EQ(submit("").exit_code, 0);
    std::filesystem::remove(w.path("out.exr"));
    change_byte("j/parts/0002.exr");
    const CommandResult merge = w.velatura("farm merge j");
    EXPECT_EQ(merge.exit_code, 1);
    expect_words(merge.output, {"missing: pieces 2", "parts/0002.exr is damaged"});
    EXPECT_FALSE(w.exists("out.exr"));
    const CommandResult retry = w.velatura("farm retry j");
    ASSERT_EQ(retry.exit_code, 0) << retry.output;
    expect_image_of_one_render();
    EXPECT_EQ(status()["list"][2]["attempts"], 2);
    EXPECT_EQ(status()["list"][1]["attempts"], 1);
}

TEST_F(FarmCommand, APartOfOtherSettingsIsNamedWithTheSetting) {
    const CommandResult r =
        submit("--retries 1 " +
               program("case \"$*\" in *--samples=8:16*) [ -e hit ] || { : > hit; exec " +
                       std::string(VELATURA_BIN_DIR) + "/velatura \"$@\" --seed 5; };; esac"));
    ASSERT_EQ(r.exit_code, 0) << r.output;
    expect_words(r.output, {"piece 1 (samples 8:16) failed", "other settings than piece 0",
                            "seed \"0\" and \"5\"", "trying again"});
    expect_image_of_one_render();
}

TEST_F(FarmCommand, AnotherBuildRendersNothing) {
    ASSERT_EQ(submit("--dry-run").exit_code, 0);
    EXPECT_EQ(status()["state"], "waiting");
    std::string job = *read_file(w.path("j/job.json"));
    const size_t at = job.find("\"build\": \"") + 10;
    job.replace(at, 4, "beef");
    w.write("j/job.json", job);
    const CommandResult r = w.velatura("farm run j 0");
    EXPECT_EQ(r.exit_code, 5) << r.output;
    expect_words(r.output, {"has build", "beef", "piece 0"});
    EXPECT_EQ(status()["list"][0]["state"], "gave-up");
}

TEST_F(FarmCommand, AStoppedJobContinues) {
    // The piece that starts second stops the job, as Ctrl-C does
    const CommandResult r = submit(program(
        "case \"$*\" in *--samples=8:16*) [ -e hit ] || { : > hit; kill -TERM $PPID; sleep 0.3; };;"
        " esac"));
    EXPECT_EQ(r.exit_code, 128 + 15) << r.output;
    expect_words(r.output, {"[farm-incomplete]", "velatura farm retry"});
    const json s = status();
    EXPECT_EQ(s["list"][0]["state"], "done");
    EXPECT_NE(s["list"][2]["state"], "done");
    EXPECT_EQ(s["pieces"]["gave-up"], 0) << s.dump(1);
    const CommandResult retry = w.velatura("farm retry j");
    ASSERT_EQ(retry.exit_code, 0) << retry.output;
    expect_image_of_one_render();
}

TEST_F(FarmCommand, ACanceledJobStartsNoPiece) {
    ASSERT_EQ(submit("--dry-run").exit_code, 0);
    ASSERT_EQ(w.velatura("farm cancel j").exit_code, 0);
    EXPECT_EQ(status()["state"], "canceled");
    const CommandResult r = w.velatura("farm run j 1");
    EXPECT_EQ(r.exit_code, 1);
    expect_words(r.output, {"[farm-canceled]", "farm retry"});
    EXPECT_EQ(w.velatura("farm wait j").exit_code, 1);
    ASSERT_EQ(w.velatura("farm retry j").exit_code, 0);
    expect_image_of_one_render();
}

/// Pieces one by one and the merge, as engines start them.
TEST_F(FarmCommand, PiecesCanRunInAnyOrder) {
    ASSERT_EQ(submit("--dry-run").exit_code, 0);
    for (const int piece : {2, 0, 1}) {
        const CommandResult merge = w.velatura("farm merge j");
        EXPECT_EQ(merge.exit_code, 1) << merge.output;
        const CommandResult r = w.velatura(fmt::format("farm run j {}", piece));
        ASSERT_EQ(r.exit_code, 0) << r.output;
    }
    ASSERT_EQ(w.velatura("farm run j 1").exit_code, 0);
    EXPECT_EQ(status()["list"][1]["attempts"], 1) << "a piece that is done is not rendered again";
    ASSERT_EQ(w.velatura("farm merge j").exit_code, 0);
    expect_image_of_one_render();
    const CommandResult none = w.velatura("farm run j 3");
    EXPECT_EQ(none.exit_code, 1);
    expect_words(none.output, {"no piece 3", "[farm-piece]"});
}

TEST_F(FarmCommand, ACheckFindsMachinesThatDiffer) {
    w.write("ball.usda", "#usda 1.0\n");
    w.write("s.usda", [] {
        std::string scene = small_scene();
        return scene.insert(scene.find("(\n") + 2, "    subLayers = [@ball.usda@]\n");
    }());
    ASSERT_EQ(submit("--dry-run").exit_code, 0);
    const auto check_on = [&](const std::string& node) {
        return w.velatura("--version > /dev/null; SLURMD_NODENAME=" + node + " '" +
                          VELATURA_BIN_DIR + "/velatura' farm check j");
    };
    for (const char* node : {"a", "b"}) {
        const CommandResult r = check_on(node);
        EXPECT_EQ(r.exit_code, 0) << r.output;
        expect_words(r.output, {node, "all alike"});
    }
    // The third machine sees another file
    w.write("ball.usda", "#usda 1.0\ndef Sphere \"S\"\n{\n}\n");
    const CommandResult other = check_on("c");
    EXPECT_EQ(other.exit_code, 1) << other.output;
    expect_words(other.output, {"error: c: files of the scene", "[farm-machine]"});
    EXPECT_EQ(other.output.find("error: a"), std::string::npos) << other.output;
    // The fourth sees none
    std::filesystem::remove(w.path("ball.usda"));
    const CommandResult none = check_on("d");
    EXPECT_EQ(none.exit_code, 1);
    expect_words(none.output, {"error: d: exit code 1", "ball.usda"});
    EXPECT_FALSE(w.exists("out.exr"));
}

/// The image of a job with a target is that of one render of as many samples.
TEST_F(FarmCommand, AddsRoundsUntilTheImageHasTheError) {
    const std::string render = " s.usda --res 24 20 --bounces 1 --layers bounce,light";
    const std::string front = program("echo \"$*\" >> calls");
    const auto farm = [&](const std::string& target) {
        std::filesystem::remove_all(w.path("j"));
        w.write("calls", "");
        const CommandResult r = w.velatura("farm submit" + render +
                                           " -o out.exr --job j --pieces "
                                           "2 --target-error " +
                                           target + " " + front);
        EXPECT_EQ(r.exit_code, 0) << r.output;
        return r.output;
    };
    // What 64 samples have, halved: by samples^-0.6 that takes about 3.2 times as many
    farm("90%");
    json s = status();
    EXPECT_EQ(s["pieces"]["done"], 2) << "it is reached at once";
    const double first = s["outputs"][0]["error"];
    EXPECT_EQ(s["outputs"][0]["spp"], 64);
    const std::string printed = farm(fmt::format("{:.4f}%", 100 * first / 2));
    expect_words(printed, {"another round for an error of", "2 pieces"});
    s = status();
    EXPECT_EQ(s["state"], "complete");
    EXPECT_LE(double(s["outputs"][0]["error"]), first / 2);
    EXPECT_GT(double(s["outputs"][0]["error"]), 0.75 * first / 2) << s.dump(1);
    const int spp = s["outputs"][0]["spp"];
    EXPECT_GT(spp, 128);
    const CommandResult one =
        w.velatura(fmt::format("render{} -o one.exr --progress none -q --spp {}", render, spp));
    ASSERT_EQ(one.exit_code, 0) << one.output;
    EXPECT_EQ(w.hash("out.exr"), w.hash("one.exr"));
    // The first part has the rates of adaptive sampling, and gives them to the others
    const std::string calls = *read_file(w.path("calls"));
    size_t with_rates = 0, all = 0;
    for (size_t at = 0; (at = calls.find("--rates-from=", at)) != std::string::npos; ++at)
        ++with_rates;
    for (size_t at = 0; (at = calls.find("--samples=", at)) != std::string::npos; ++at) ++all;
    EXPECT_EQ(with_rates, all - 1) << calls;
    // A job that ended there goes on where it was, and one whose limit comes first says so
    const CommandResult again = w.velatura("farm retry j");
    EXPECT_EQ(again.exit_code, 0) << again.output;
    expect_words(farm("0.1% --spp 96"), {"[budget]", "at the limit of 96 samples"});
    EXPECT_EQ(status()["state"], "complete");
}

/// Without --pieces a frame is split by what its first samples took.
TEST_F(FarmCommand, SplitsByMeasuredCost) {
    const auto ranges = [&](const std::string& piece_time) {
        std::filesystem::remove_all(w.path("j"));
        const CommandResult r = w.velatura(std::string("farm submit s.usda -o out.exr --job j") +
                                           options + " --spp 96 --piece-time " + piece_time);
        EXPECT_EQ(r.exit_code, 0) << r.output;
        expect_words(r.output, {"piece 0 (samples 0:32) done", "further pieces"});
        std::vector<std::pair<int, int>> found;
        const json s = status();
        for (const json& row : s["list"]) found.emplace_back(row["samples"][0], row["samples"][1]);
        EXPECT_EQ(s["state"], "complete");
        const CommandResult one = w.velatura(std::string("render s.usda -o one.exr --progress "
                                                         "none -q") +
                                             options + " --spp 96");
        EXPECT_EQ(one.exit_code, 0) << one.output;
        EXPECT_EQ(w.hash("out.exr"), w.hash("one.exr"));
        return found;
    };
    // An hour suffices for all others
    EXPECT_EQ(ranges("1h"), (std::vector<std::pair<int, int>>{{0, 32}, {32, 96}}));
    // A render that says that each sample took a second: 64 of them are four pieces of 16
    w.write("front.sh",
            std::string("#!/bin/sh\n") + VELATURA_BIN_DIR +
                "/velatura \"$@\" || exit $?\nfor word; do case $word in --stats=*) echo "
                "'{\"phases_s\": {\"render\": 32}}' > \"${word#--stats=}\";; esac; done\n");
    std::filesystem::permissions(w.path("front.sh"), std::filesystem::perms::owner_all);
    EXPECT_EQ(ranges("16s --program " + w.path("front.sh")),
              (std::vector<std::pair<int, int>>{{0, 32}, {32, 48}, {48, 64}, {64, 80}, {80, 96}}));
    const CommandResult r = submit("--pieces auto --piece-time never");
    EXPECT_EQ(r.exit_code, 2) << r.output;
}

/// Three frames tell what the others take, which are then whole pieces.
TEST_F(FarmCommand, FramesComeBeforeRanges) {
    const CommandResult r =
        w.velatura("farm submit s.usda -o 'f.####.exr' --job j --frames 1-5 --res 16 12 --spp 4");
    ASSERT_EQ(r.exit_code, 0) << r.output;
    expect_words(r.output, {"3 pieces of 5 frames", "2 further pieces"});
    std::vector<std::string> frames;
    const json s = status();
    for (const json& row : s["list"]) frames.push_back(row["frame"]);
    EXPECT_EQ(frames, (std::vector<std::string>{"1", "3", "5", "2", "4"}));
    EXPECT_EQ(s["frames"]["written"], 5);
}

/// As engines run it: the piece that ends last merges its frame.
TEST_F(FarmCommand, TheLastPieceOfAFrameMergesIt) {
    const CommandResult r = w.velatura(
        "farm submit s.usda -o 'f.####.exr' --job j --frames 1,2 --pieces 2 --res 16 12 --spp 4 "
        "--dry-run");
    ASSERT_EQ(r.exit_code, 0) << r.output;
    ASSERT_EQ(w.velatura("farm run j 1").exit_code, 0);
    EXPECT_FALSE(w.exists("f.0001.exr"));
    ASSERT_EQ(w.velatura("farm run j 0").exit_code, 0);
    EXPECT_TRUE(w.exists("f.0001.exr"));
    EXPECT_FALSE(w.exists("f.0002.exr"));
    ASSERT_EQ(w.velatura("farm run j 2-3").exit_code, 0);
    EXPECT_EQ(status()["state"], "complete");
}

/// The interim image is that of one render of the samples that are there.
TEST_F(FarmCommand, APreviewIsRenewedWhilePiecesArrive) {
    const CommandResult r = w.velatura(
        "farm submit s.usda -o out.exr --job j --res 24 20 --spp 32 "
        "--bounces 1 --pieces 4 --dry-run");
    ASSERT_EQ(r.exit_code, 0) << r.output;
    const auto shown = [&](int piece) {
        const CommandResult ran = w.velatura(fmt::format("farm run j {}", piece));
        EXPECT_EQ(ran.exit_code, 0) << ran.output;
        return status()["outputs"][0].value("preview", json());
    };
    EXPECT_EQ(shown(1)["samples"], json({8, 16}));
    const json first = shown(0);
    EXPECT_EQ(first["samples"], json({0, 16}));
    EXPECT_GT(first["error"], 0) << first;
    ASSERT_EQ(w.velatura("render s.usda -o half.exr --res 24 20 --spp 16 --bounces 1 -q --progress "
                         "none")
                  .exit_code,
              0);
    EXPECT_EQ(w.hash("j/preview/0000.exr"), w.hash("half.exr"));
    EXPECT_EQ(first.contains("png"), w.exists("j/preview/0000.png"));
    EXPECT_TRUE(w.exists("j/preview/0000.png")) << *read_file(w.path("j/logs/preview.0000.log"));
    // Between: piece 3 is not beside them, and with piece 2 the image itself is due
    EXPECT_EQ(shown(3)["samples"], json({0, 16}));
    EXPECT_EQ(shown(2)["samples"], json({0, 16}));
    ASSERT_EQ(w.velatura("farm merge j").exit_code, 0);
    EXPECT_FALSE(w.exists("j/preview/0000.exr")) << "the image is there";
    EXPECT_FALSE(status()["outputs"][0].contains("preview"));
    ASSERT_EQ(w.velatura("farm submit s.usda -o n.exr --job n --res 8 8 --spp 4 --pieces 4 "
                         "--no-preview")
                  .exit_code,
              0);
    EXPECT_FALSE(w.exists("n/preview/0000.png"));
}

TEST_F(FarmCommand, LimitsOfTimeEndTheRounds) {
    for (const std::string limit : {"--max-cpu 0.01s", "--max-time 0.01s"}) {
        std::filesystem::remove_all(w.path("j"));
        const CommandResult r = w.velatura(
            "farm submit s.usda -o out.exr --job j --res 24 20 --bounces 1 "
            "--target-error 0.5% " +
            limit);
        EXPECT_EQ(r.exit_code, 0) << r.output;
        const std::string name = limit.substr(0, limit.find(' '));
        expect_words(r.output, {"[budget]", "after 32 samples per pixel; a new job with a higher ",
                                name.c_str()});
        const json s = status();
        EXPECT_EQ(s["state"], "complete");
        EXPECT_EQ(s["pieces"]["done"], 1);
        EXPECT_EQ(s["outputs"][0]["limit"], name);
    }
    // Within it rounds go on
    std::filesystem::remove_all(w.path("j"));
    const CommandResult r = w.velatura(
        "farm submit s.usda -o out.exr --job j --res 24 20 --bounces 1 --target-error 0.5% --spp "
        "64 --max-cpu 1h --max-time 1h");
    EXPECT_EQ(r.exit_code, 0) << r.output;
    expect_words(r.output, {"at the limit of 64 samples per pixel; a new job with a higher --spp"});
    for (const char* alone : {"--max-cpu 1h", "--max-time 1h", "--for-mix x.json"})
        EXPECT_EQ(submit(alone).exit_code, 2) << alone;
}

/// A mix that lifts a noisy bounce needs more samples than the image for the same error.
TEST_F(FarmCommand, AMixHasTheTarget) {
    const std::string render =
        "farm submit s.usda --res 24 20 --bounces 1 --halves --target-error 4% --piece-time 1h";
    ASSERT_EQ(w.velatura(render + " -o image.exr --job image").exit_code, 0);
    ASSERT_EQ(w.comp("mix image.exr -o x.exr --solo tail --save-preset look.json").exit_code, 0);
    const CommandResult r = w.velatura(render + " -o out.exr --job j --for-mix look.json");
    ASSERT_EQ(r.exit_code, 0) << r.output;
    const CommandResult noise = w.comp("noise out.exr --preset look.json --json");
    const json report = json::parse(noise.output.substr(noise.output.find('{')), nullptr, false);
    const json row = status()["outputs"][0];
    EXPECT_DOUBLE_EQ(row["stated"], report["mix"]["value"]);
    EXPECT_LE(row["error"], 0.04) << row;
    const json image = json::parse(w.velatura("farm status image --json").output)["outputs"][0];
    EXPECT_GT(row["spp"], image["spp"]) << row << image;
    const CommandResult no_halves =
        w.velatura("farm submit s.usda -o x.exr --job x --target-error 4% --for-mix look.json");
    EXPECT_EQ(no_halves.exit_code, 2);
    expect_words(no_halves.output, {"--halves"});
    w.write("bad.json", "{}");
    const CommandResult bad = w.velatura(render + " -o x.exr --job x --for-mix bad.json");
    EXPECT_EQ(bad.exit_code, 1) << bad.output;
    expect_words(bad.output, {"bad.json", "'schema' not found [bad-preset]"});
    EXPECT_FALSE(w.exists("x")) << "nothing is written";
}

/// The goal is that of the submit, and a merge that does not find the error says so.
TEST_F(FarmCommand, AJobKeepsItsPreset) {
    const std::string render =
        "farm submit s.usda --res 8 8 --bounces 1 --halves --target-error 90% -o out.exr";
    ASSERT_EQ(w.velatura("render s.usda --res 8 8 --bounces 1 --spp 4 -o i.exr -q --progress none")
                  .exit_code,
              0);
    ASSERT_EQ(w.comp("mix i.exr -o x.exr --solo tail --save-preset look.json").exit_code, 0);
    ASSERT_EQ(w.velatura(render + " --job j --for-mix look.json --dry-run").exit_code, 0);
    const std::string look = *read_file(w.path("look.json"));
    w.write("look.json", "{}");
    std::filesystem::rename(w.path("j"), w.path("moved"));
    const CommandResult r = w.velatura("farm retry moved");
    EXPECT_EQ(r.exit_code, 0) << r.output;

    w.write("look.json", look);
    ASSERT_EQ(w.velatura(render + " --job j --for-mix look.json --dry-run").exit_code, 0);
    w.write("j/preset.json", "{}");
    const CommandResult unknown = w.velatura("farm retry j");
    EXPECT_EQ(unknown.exit_code, 1) << unknown.output;
    expect_words(unknown.output, {"the error of", "is not known at 32 samples per pixel",
                                  "[bad-preset]", "[farm-incomplete]"});
    EXPECT_EQ(status()["state"], "incomplete");
    EXPECT_EQ(status()["list"].size(), 1u);
    w.write("j/preset.json", look);
    const CommandResult mended = w.velatura("farm retry j");
    EXPECT_EQ(mended.exit_code, 0) << mended.output;
}

/// A part of another round's piece of the same number is not merged as if it were its own.
TEST_F(FarmCommand, APartOfOtherSamplesIsRenderedAgain) {
    ASSERT_EQ(submit("").exit_code, 0);
    std::filesystem::remove(w.path("out.exr"));
    std::string text = *read_file(w.path("j/job.json"));
    for (const auto& [from, to] :
         {std::pair("[0, 0, 8]", "[0, 0, 4]"), std::pair("[0, 8, 16]", "[0, 4, 16]")}) {
        ASSERT_NE(text.find(from), std::string::npos) << text;
        text.replace(text.find(from), std::string(from).size(), to);
    }
    w.write("j/job.json", text);
    const CommandResult merge = w.velatura("farm merge j");
    EXPECT_EQ(merge.exit_code, 1);
    expect_words(merge.output, {"missing: pieces 0-1", "has samples 0:8, the piece 0:4"});
    ASSERT_EQ(w.velatura("farm retry j").exit_code, 0);
    expect_image_of_one_render();
}

/// A node that lacks a texture says so before it traces a sample, instead of a part without it.
TEST_F(FarmCommand, AMissingAssetEndsAPieceAtOnce) {
    w.write("s.usda", small_scene() + textured_ball("none.png"));
    const CommandResult r = submit("--retries 0");
    EXPECT_EQ(r.exit_code, 1) << r.output;
    expect_words(r.output, {"missing: texture none.png; --require-assets renders nothing",
                            "--missing-assets ignore"});
    EXPECT_EQ(status()["list"][0]["state"], "gave-up");
    EXPECT_FALSE(w.exists("j/work/0000.exr"));
    EXPECT_EQ(read_file(w.path("j/logs/0000.1.log"))->find("\"percent\""), std::string::npos);
    std::filesystem::remove_all(w.path("j"));
    const CommandResult named = submit("--retries 0 --missing-assets fail");
    EXPECT_EQ(named.exit_code, 1) << "the default, by name";
    expect_words(named.output, {"--require-assets renders nothing"});
    std::filesystem::remove_all(w.path("j"));
    const CommandResult accepted = submit("--missing-assets ignore");
    EXPECT_EQ(accepted.exit_code, 0) << accepted.output;
}

/// A warning of an engine: the samples are kept, and the piece goes on where it was.
TEST_F(FarmCommand, AWarningKeepsTheSamplesOfAPiece) {
    for (const std::string signal : {"USR1", "USR2", "TERM"}) {
        std::filesystem::remove_all(w.path("j"));
        // The render runs beside the shell, which warns its parent when the first samples are there
        w.write("front.sh", "#!/bin/sh\nparent=$PPID\n[ -e hit ] || { : > hit; (sleep 0.4; kill -" +
                                signal + " $parent) & }\nexec " + VELATURA_BIN_DIR +
                                "/velatura \"$@\"\n");
        std::filesystem::permissions(w.path("front.sh"), std::filesystem::perms::owner_all);
        std::filesystem::remove(w.path("hit"));
        const std::string render = " s.usda --res 64 48 --spp 200 --bounces 1 --threads 1";
        ASSERT_EQ(w.velatura("farm submit" + render +
                             " -o out.exr --job j --pieces 1 --dry-run "
                             "--program " +
                             w.path("front.sh"))
                      .exit_code,
                  0);
        const CommandResult stopped = w.velatura("farm run j 0");
        EXPECT_GT(stopped.exit_code, 128) << signal << stopped.output;
        json row = status()["list"][0];
        EXPECT_EQ(row["state"], "waiting") << row;
        EXPECT_EQ(row["failures"], 0);
        const CommandResult info = w.comp("info j/work/0000.exr --json");
        ASSERT_EQ(info.exit_code, 0) << "its samples are there: " << info.output;
        // It goes on: what the second start traces and what the first one did are the whole
        ASSERT_EQ(w.velatura("farm run j 0").exit_code, 0);
        const std::string log = *read_file(w.path("j/logs/0000.2.log"));
        const json begin = json::parse(
            log.substr(log.find("{\"percent\""),
                       log.find('\n', log.find("{\"percent\"")) - log.find("{\"percent\"")),
            nullptr, false);
        EXPECT_GT(begin["spp"], 0.5) << signal << begin;
        ASSERT_EQ(w.velatura("farm merge j").exit_code, 0);
    }
}

TEST_F(FarmCommand, AFullDiskIsNamedAndThePieceTriedAgain) {
    const CommandResult r = submit(
        program("case \"$*\" in *--samples=8:16*) [ -e hit ] || { : > hit; ulimit -f 8; };; esac"));
    ASSERT_EQ(r.exit_code, 0) << r.output;
    expect_words(r.output,
                 {"warning: piece 1 (samples 8:16) failed on", "File too large", "trying again"});
    expect_image_of_one_render();
    EXPECT_EQ(status()["list"][1]["attempts"], 2);
}

TEST_F(FarmCommand, RefusesWhatPiecesCannotDo) {
    for (const char* more : {"--samples 0:4",
                             "--resume",
                             "--time 5s",
                             "--target-error 1% --engine openjd",
                             "--target-error x",
                             "--rates-from a.exr",
                             "--deep",
                             "--replay 1,1,1",
                             "--crop 0 1 0 0.5",
                             "--stats x.json",
                             "--exr-layout split",
                             "--pieces 0",
                             "--pieces 25",
                             "--pieces many",
                             "--pieces -1",
                             "--engine moon",
                             "--spp 0",
                             "--max-depth -1",
                             "--retries -1",
                             "--frames x",
                             "--piece-time 5m",
                             "--pieces auto --piece-time nan",
                             "--pieces auto --engine openjd --piece-time 5m",
                             "--pieces auto --piece-time ''",
                             "--target-error 1% --max-cpu -1m",
                             "--target-error 1% --max-time x",
                             "--caustics no"}) {
        const CommandResult r = submit(std::string("--pieces 3 ") + more);
        EXPECT_EQ(r.exit_code, 2) << more << ": " << r.output;
        EXPECT_NE(r.output.find("[usage]"), std::string::npos) << more << ": " << r.output;
    }
    const CommandResult no_output = w.velatura("farm submit s.usda --job j");
    EXPECT_EQ(no_output.exit_code, 2) << no_output.output;
    const CommandResult no_scene = w.velatura("farm submit none.usda -o x.exr --job j");
    EXPECT_EQ(no_scene.exit_code, 1) << no_scene.output;
    expect_words(no_scene.output, {"[file-not-found]"});
    EXPECT_FALSE(w.exists("j")) << "nothing is written";
    for (const char* command : {"status", "wait", "cancel", "retry", "merge"}) {
        const CommandResult r = w.velatura(fmt::format("farm {} s.usda", command));
        EXPECT_EQ(r.exit_code, 1) << r.output;
        expect_words(r.output, {"[farm-job]"});
    }
}

}  // namespace

}  // namespace velatura::test
