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
