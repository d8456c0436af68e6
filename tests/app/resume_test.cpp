// SPDX-License-Identifier: Apache-2.0
// A render that goes on from the file it wrote: the bits of one render of all samples, or a
// rejection that says why.
#include "base/atomic_file.h"
#include "command.h"
#include "image/exr.h"
#include "layers/layer_header.h"
#include "layers/sums_part.h"
#include "stored_zip.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/wait.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

namespace velatura::test {

namespace {

class Resume : public ::testing::Test {
  protected:
    void SetUp() override { w.write("s.usda", small_scene()); }

    CommandResult try_render(const std::string& arguments) {
        return w.velatura("render s.usda --res " + size + " --progress none -q " + arguments);
    }

    void render(const std::string& arguments) {
        const CommandResult r = try_render(arguments);
        ASSERT_EQ(r.exit_code, 0) << r.output;
    }

    std::string bytes(const std::string& name) {
        const Result<std::string> content = read_file(w.path(name));
        EXPECT_TRUE(content.has_value()) << name;
        return content ? *content : std::string();
    }

    /// Expects the files to be the same, header and sums included.
    void expect_same_file(const std::string& name,
                          const std::string& expected,
                          const std::string& how) {
        EXPECT_EQ(w.hash(name), w.hash(expected)) << how;
        EXPECT_TRUE(bytes(name) == bytes(expected)) << how;
    }

    Workplace w;
    std::string size = "40 34";
};

}  // namespace

TEST_F(Resume, GivesTheFileOfOneRender) {
    // Adaptive past 16 samples: splits before, at and after the pilot's end
    for (const std::string adaptive : {"on", "off"}) {
        const std::string common = fmt::format("--adaptive {} --resumable ", adaptive);
        render(common + "--spp 40 -o whole.exr");
        for (const int split : {1, 7, 16, 21, 32}) {
            render(common + fmt::format("--spp {} --threads 1 --mode tile -o part.exr", split));
            render(common + "--spp 40 --resume --threads 3 -o part.exr");
            expect_same_file("part.exr", "whole.exr",
                             fmt::format("adaptive {}, split at {}", adaptive, split));
        }
        // In three steps, the other way round
        render(common + "--spp 5 -o part.exr");
        render(common + "--spp 18 --mode tile --tile 16 --resume -o part.exr");
        render(common + "--spp 40 --mode tile --resume -o part.exr");
        expect_same_file("part.exr", "whole.exr", "three steps");
    }
    EXPECT_EQ(w.comp("verify part.exr").exit_code, 0);
}

TEST_F(Resume, GivesTheFileOfOneRenderInEveryLayoutAndWithHalves) {
    for (const char* layout : {"single", "split"}) {
        const std::string common = fmt::format(
            "--halves --guiding on --caustics light --cryptomatte object,material --exr-layout {} "
            "--resumable ",
            layout);
        render(common + "--spp 24 -o whole.exr");
        const std::string expected = w.hash("whole.exr");
        render(common + "--spp 9 -o part.exr");
        render(common + "--spp 24 --resume -o part.exr");
        EXPECT_EQ(w.hash("part.exr"), expected) << layout;
    }
}

TEST_F(Resume, WithoutAFileItBegins) {
    render("--spp 20 --resume -o new.exr");
    render("--spp 20 --resumable -o whole.exr");
    expect_same_file("new.exr", "whole.exr", "nothing there");
    // The image is that of a plain render; what is there already stays
    render("--spp 20 -o plain.exr");
    EXPECT_EQ(w.hash("new.exr"), w.hash("plain.exr"));
    render("--spp 10 --resume -o new.exr");
    expect_same_file("new.exr", "whole.exr", "fewer samples wanted");
}

TEST_F(Resume, PartsAndMergedFilesGoOn) {
    render("--samples 8:40 -o whole.exr");
    render("--samples 8:20 -o part.exr");
    render("--samples 8:40 --resume -o part.exr");
    expect_same_file("part.exr", "whole.exr", "a part");
    render("--samples 0:8 -o first.exr");
    ASSERT_EQ(w.comp("merge first.exr part.exr --resumable -o merged.exr").exit_code, 0);
    render("--spp 64 --resume -o merged.exr");
    render("--spp 64 -o all.exr");
    EXPECT_EQ(w.hash("merged.exr"), w.hash("all.exr"));
}

TEST_F(Resume, GoesOnFromWhereverItWasStopped) {
    // Signals come when they come; the end must not depend on it
    const int terminated = 128 + SIGTERM;
    size = "16 12";
    for (const char* mode : {"tile --tile 16", "progressive --guiding on"}) {
        const std::string common =
            fmt::format("--spp 1500 --mode {} --adaptive on --resumable ", mode);
        const auto start = std::chrono::steady_clock::now();
        render(common + "--threads 1 -o whole.exr");
        const double whole_s =
            std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        // Sooner where all was done before the first signal
        int stops = 0;
        for (double share = 0.4; stops == 0 && share > 0.01; share /= 2) {
            std::filesystem::remove(w.path("part.exr"));
            for (int i = 0; i < 40; ++i) {
                const std::string line = fmt::format(
                    "cd {} && timeout --preserve-status -s TERM {} {}/velatura render s.usda --res "
                    "{} -q --progress none {} --resume --threads {} -o part.exr > stopped.txt 2>&1",
                    w.path(""), whole_s * (share + 0.1 * i), VELATURA_BIN_DIR, size, common,
                    1 + i % 3);
                const int status = std::system(line.c_str());
                ASSERT_TRUE(WIFEXITED(status)) << mode;
                if (WEXITSTATUS(status) == 0) break;
                ASSERT_EQ(WEXITSTATUS(status), terminated) << mode << ": " << bytes("stopped.txt");
                // Those count that came after the first sample
                stops += int(w.exists("part.exr"));
            }
        }
        EXPECT_GT(stops, 0) << mode;
        render(common + "--resume -o part.exr");
        expect_same_file("part.exr", "whole.exr", mode);
    }
}

/// An interim image is a checkpoint: of a render that is killed after one, the rest gives the
/// bits of one render.
TEST_F(Resume, GoesOnFromASnapshot) {
    size = "16 12";
    render("--spp 600 --resumable -o whole.exr");
    for (const char* often : {"--snapshot 0.01s", "--snapshot 100s --checkpoint 0.01s"}) {
        std::filesystem::remove(w.path("part.exr"));
        // Whenever the signal comes: the file that is there is whole
        const std::string line = fmt::format(
            "cd {} && ({}/velatura render s.usda --res {} -q --progress none --spp 600 {} -o "
            "part.exr & p=$!; for i in $(seq 2000); do [ -e part.exr ] && break; sleep 0.005; "
            "done; kill -KILL $p 2>/dev/null; wait $p 2>/dev/null; true)",
            w.path(""), VELATURA_BIN_DIR, size, often);
        ASSERT_EQ(std::system(line.c_str()), 0);
        ASSERT_TRUE(w.exists("part.exr")) << often;
        const uint64_t end =
            layers::read_layer_header(*image::read_exr(w.path("part.exr")))->samples.end;
        std::printf("%s: stopped after %d of 600 samples\n", often, int(end));
        render(fmt::format("--spp 600 --snapshot 1s --resume -o part.exr"));
        expect_same_file("part.exr", "whole.exr", often);
    }
    EXPECT_EQ(w.comp("verify part.exr").exit_code, 0);
}

/// Only what is not finished needs the sums, which triple the file: one that is finished has them
/// when they are asked for. Its pixels are the same either way.
TEST_F(Resume, ASnapshotThatIsFinishedKeepsNoSums) {
    size = "16 12";
    render("--spp 8 -o plain.exr");

    const struct {
        const char* options;
        bool has_sums;
    } cases[] = {
        {"--snapshot 0.001s", false},
        {"--snapshot 100s", false},
        {"--snapshot 100s --time 60s", false},  // a budget that was not needed
        {"--snapshot 0.001s --resumable", true},
        {"--snapshot 0.001s --checkpoint 100s", true},
    };

    for (const auto& c : cases) {
        render(fmt::format("--spp 8 {} -o out.exr", c.options));
        const Result<image::Image> file = image::read_exr(w.path("out.exr"));
        ASSERT_TRUE(file.has_value());
        EXPECT_EQ(layers::read_sums(*file).has_value(), c.has_sums) << c.options;
        EXPECT_EQ(w.hash("out.exr"), w.hash("plain.exr")) << c.options;
    }
    // Of one that is stopped by a signal they are there, whether an interim image came or not
    const std::string line = fmt::format(
        "cd {} && ({}/velatura render s.usda --res {} --progress json --spp 1000000 --snapshot "
        "0.01s -o stopped.exr > lines.txt & p=$!; for i in $(seq 2000); do [ -e stopped.exr ] && "
        "break; sleep "
        "0.005; done; kill -TERM $p; wait $p)",
        w.path(""), VELATURA_BIN_DIR, size);
    const int status = std::system(line.c_str());
    ASSERT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 128 + SIGTERM);
    const Result<image::Image> file = image::read_exr(w.path("stopped.exr"));
    ASSERT_TRUE(file.has_value());
    EXPECT_TRUE(layers::read_sums(*file).has_value());
    // Its last line tells of a render that was not done
    const std::string lines = bytes("lines.txt");
    const size_t last = lines.rfind("\"percent\":");
    ASSERT_NE(last, std::string::npos) << lines;
    EXPECT_LT(std::stod(lines.substr(last + 10)), 99.0) << lines.substr(last);
}

TEST_F(Resume, BudgetsLeaveFilesThatGoOn) {
    const CommandResult stopped = try_render("--spp 100000 --time 0.2s --resume -o part.exr");
    EXPECT_EQ(stopped.exit_code, 0) << stopped.output;
    const CommandResult again =
        try_render("--spp 100000 --time 0.2s --resume --checkpoint 0.01s -o part.exr");
    EXPECT_EQ(again.exit_code, 0) << again.output;
    const Result<image::Image> file = image::read_exr(w.path("part.exr"));
    ASSERT_TRUE(file.has_value());
    const uint64_t end = layers::read_layer_header(*file)->samples.end;
    EXPECT_EQ(w.comp("verify part.exr").exit_code, 0);
    EXPECT_GT(end, 1u);
}

/// A command that has done what it was asked for does nothing when it is given again.
TEST_F(Resume, ATargetThatWasReachedStays) {
    const std::string command = "--spp 4096 --target-error 8% --resume -o part.exr";
    for (const char* adaptive : {"on", "off"}) {
        std::filesystem::remove(w.path("part.exr"));
        const std::string whole = fmt::format("{} --adaptive {}", command, adaptive);
        render(whole);
        const uint64_t end =
            layers::read_layer_header(*image::read_exr(w.path("part.exr")))->samples.end;
        EXPECT_LT(end, 4096u);
        const std::string before = bytes("part.exr");
        render(whole);
        EXPECT_TRUE(bytes("part.exr") == before) << adaptive << ", after " << end << " samples";
        // Nor does it matter how often it was stopped on the way
        std::filesystem::remove(w.path("part.exr"));
        for (int i = 0; i < 4; ++i) try_render(fmt::format("{} --time 0.02s", whole));
        render(whole);
        EXPECT_TRUE(bytes("part.exr") == before) << adaptive << ", stopped on the way";
    }
}

TEST_F(Resume, OptionsThatContradictAreUsageErrors) {
    for (const char* arguments :
         {"--snapshot 1s --mode tile", "--deep-samples 4", "--cryptomatte-levels 4",
          "--checkpoint 1s --mode tile", "--checkpoint 1s --exr-layout split", "--checkpoint soon",
          "--for-mix look.json", "--deep --resume"})
        EXPECT_EQ(try_render(fmt::format("--spp 1 {} -o no.exr", arguments)).exit_code, 2)
            << arguments;
    EXPECT_EQ(w.velatura("render s.usda --replay 1,1,1 --resume").exit_code, 2);
    EXPECT_FALSE(w.exists("no.exr"));
}

TEST_F(Resume, RefusesWhatIsNotTheSameRender) {
    render("--spp 4 --resumable -o whole.exr");
    const std::string before = bytes("whole.exr");

    const struct {
        const char* arguments;
        const char* why;
    } cases[] = {
        {"--seed 9", "seed was 0, now 9"},
        {"--sampler independent", "--sampler was sobol, now independent"},
        {"--halves", "--sampler was sobol, now sobol in halves"},
        {"--filter box", "--filter was blackman-harris, now box"},
        {"--max-depth 3", "--max-depth was 0, now 3"},
        {"--adaptive off", "--adaptive was on, now off"},
        {"--integrator nee", "--light-sampling was mis, now light"},
        {"--guiding on", "--guiding was off, now on"},
        {"--caustics manifold", "--caustics was auto, now manifold"},
        {"--splitting off", "--splitting was auto, now off"},
        {"--light-selection power", "--light-selection was tree, now power"},
        {"--effects -clearcoat", nullptr},  // the scene has none: the same render
        {"--purpose proxy", "purposes was"},
        {"--layers bounce", "it stores other light layers"},
        {"--bounces 2", "it stores other light layers"},
        {"--lights off", "it stores other light layers"},
        {"--crop 0 0.5 0 1", "it has the pixels [0, 40) x [0, 34), expected [0, 20) x [0, 34)"},
        {"--res 20 17", "resolution was 40 x 34, now 20 x 17"},
        {"--samples 2:8", "its samples start at 0, expected 2"},
    };

    for (const auto& c : cases) {
        std::ofstream(w.path("part.exr"), std::ios::binary) << before;
        const std::string spp =
            std::string(c.arguments).starts_with("--samples") ? " " : " --spp 8 ";
        const std::string res =
            std::string(c.arguments).starts_with("--res") ? "" : "--res " + size;
        const CommandResult r = w.velatura("render s.usda --progress none -q " + res + spp +
                                           "--resume -o part.exr " + c.arguments);
        if (!c.why) {
            EXPECT_EQ(r.exit_code, 0) << c.arguments << ": " << r.output;
            continue;
        }
        EXPECT_EQ(r.exit_code, 5) << c.arguments << ": " << r.output;
        EXPECT_NE(r.output.find("cannot resume part.exr"), std::string::npos) << r.output;
        EXPECT_NE(r.output.find(c.why), std::string::npos) << c.arguments << ": " << r.output;
        EXPECT_TRUE(bytes("part.exr") == before) << c.arguments;
    }
}

TEST_F(Resume, RefusesAnotherTextureInAPackage) {
    const auto pack = [&](const std::string& texture) {
        w.write("t.usdz", testing::stored_zip({{"t.usda", "#usda 1.0\n"}, {"t.png", texture}}));
    };
    w.write("s.usda", small_scene() + textured_ball("t.usdz[t.png]"));
    pack("what is no picture gives its fallback");
    render("--missing-assets ignore --spp 2 --resumable -o whole.exr");
    pack("what is no picture gives the same one");
    const CommandResult r = try_render("--missing-assets ignore --spp 4 --resume -o whole.exr");
    EXPECT_EQ(r.exit_code, 5) << r.output;
}

TEST_F(Resume, RefusesOtherTilesOfATexture) {
    w.write("s.usda", small_scene() + textured_ball("t.<UDIM>.png"));
    w.write("t.1001.png", "what is no picture gives its fallback");
    render("--missing-assets ignore --spp 2 --resumable -o whole.exr");
    const auto expect_code = [&](int code) {
        const CommandResult r = try_render("--missing-assets ignore --spp 4 --resume -o whole.exr");
        EXPECT_EQ(r.exit_code, code) << r.output;
    };
    w.write("t.1001.png", "what is no picture gives the same one");
    expect_code(5);
    w.write("t.1001.png", "what is no picture gives its fallback");
    w.write("t.1012.png", "another tile");
    expect_code(5);
    std::filesystem::remove(w.path("t.1012.png"));
    expect_code(0);
}

TEST_F(Resume, RefusesFilesThatItCannotGoOnFrom) {
    const auto expect_refusal = [&](const std::string& name, const std::string& why) {
        const std::string before = bytes(name);
        const CommandResult r = try_render("--spp 8 --resume -o " + name);
        EXPECT_EQ(r.exit_code, 5) << r.output;
        EXPECT_NE(r.output.find(why), std::string::npos) << why << ": " << r.output;
        EXPECT_TRUE(bytes(name) == before);
    };
    render("--spp 4 -o plain.exr");
    expect_refusal("plain.exr", "it is not resumable; render with --resumable");
    ASSERT_EQ(w.comp("mix plain.exr -o mix.exr --gain all=2").exit_code, 0);
    expect_refusal("mix.exr", "cannot resume");
    w.write("text.exr", "no picture");
    expect_refusal("text.exr", "cannot resume text.exr");
    render("--spp 4 --resumable -o part.exr");
    const std::string whole = bytes("part.exr");
    std::ofstream(w.path("cut.exr"), std::ios::binary) << whole.substr(0, whole.size() / 2);
    expect_refusal("cut.exr", "cannot resume cut.exr");

    // Damaged sums, another build, no word of the build
    Result<image::Image> file = image::read_exr(w.path("part.exr"));
    ASSERT_TRUE(file.has_value());
    auto& text = std::get<std::string>(file->attributes[layers::settings_attribute]);
    nlohmann::ordered_json settings = nlohmann::ordered_json::parse(text);
    settings["build"] = "0123456789abcdef";
    text = settings.dump();
    ASSERT_TRUE(image::write_exr(w.path("build.exr"), *file).has_value());
    expect_refusal("build.exr", "it was rendered by build 0123456789abcdef of velatura");
    text = "{}";
    ASSERT_TRUE(image::write_exr(w.path("silent.exr"), *file).has_value());
    expect_refusal("silent.exr", "its header does not name the build");
    for (image::Part& part : file->parts) {
        for (image::Channel& c : part.channels) {
            if (c.name == "sums_end") std::get<std::vector<uint32_t>>(c.data)[7] ^= 1;
        }
    }
    ASSERT_TRUE(image::write_exr(w.path("damaged.exr"), *file).has_value());
    expect_refusal("damaged.exr", "the stored sums are damaged");

    // A changed scene
    std::string other = small_scene();
    other.replace(other.find("inputs:intensity = 8"), 20, "inputs:intensity = 9");
    w.write("s.usda", other);
    expect_refusal("part.exr", "the scene's layers have changed");
}

}  // namespace velatura::test
