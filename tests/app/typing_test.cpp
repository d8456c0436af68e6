// SPDX-License-Identifier: Apache-2.0
// What people type on the command line of velatura, and what they meant.
#include "app/commands.h"
#include "base/command_line.h"
#include "base/number_options.h"
#include "base/overwritten_inputs.h"
#include "command.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <functional>
#include <string>
#include <utility>

namespace velatura::test {

namespace {

constexpr const char* quick = " --spp 1 --layers none --progress none -q";

}  // namespace

TEST(Typing, EveryNumberOptionRefusesWhatMakesNoSense) {
    CommandLine line("", "velatura");
    line.require_subcommand();
    std::function<int()> run;
    app::add_render_command(line, run);
    app::add_study_command(line, run);
    app::add_farm_command(line, run);
    app::add_plan_command(line, run);
    app::add_info_command(line, run);
    app::add_selftest_command(line, run);
    app::add_flatten_command(line, run);
    app::add_import_command(line, run);
    std::set<std::string> below_zero = {"info --time"}, unbounded = {"info --time"};
    for (const std::string command : {"render", "plan", "study", "farm submit"}) {
        // Windows larger than the frame are cut to it; textures are sharpened below 0
        for (const char* name : {" --crop", " --texture-bias"}) below_zero.insert(command + name);
        for (const char* name : {" --crop", " --clamp-direct", " --clamp-indirect"})
            unbounded.insert(command + name);
    }
    const std::set<std::string> tried = expect_numbers_checked(line, below_zero, unbounded);
    for (const char* name : {"render --spp", "render --res", "plan --seed", "study --rounds",
                             "selftest --amount", "info --time"})
        EXPECT_TRUE(tried.contains(name)) << name;
}

TEST(Typing, NoCommandWritesOverWhatItReads) {
    CommandLine line("", "velatura");
    line.require_subcommand();
    std::function<int()> run;
    app::add_render_command(line, run);
    app::add_study_command(line, run);
    app::add_farm_command(line, run);
    app::add_plan_command(line, run);
    app::add_info_command(line, run);
    app::add_flatten_command(line, run);
    app::add_import_command(line, run);
    std::vector<OverwritingCommand> rows = {
        {"scene", "--output", {"flatten", "IN", "-o", "IN"}},
        {"file", "--output", {"import", "IN", "-o", "IN"}},
        {"--session", "--output", {"flatten", "x", "--session", "IN", "-o", "IN"}}};
    for (const std::string command : {"render", "plan", "study", "farm submit"}) {
        rows.push_back({"scene", "--output", {command, "IN", "-o", "IN"}});
        rows.push_back({"--session", "--output", {command, "x", "--session", "IN", "-o", "IN"}});
        rows.push_back(
            {"--for-mix", "--stats", {command, "x", "--for-mix", "IN", "--stats", "IN"}});
        rows.push_back(
            {"--rates-from", "--output", {command, "x", "--rates-from", "IN", "-o", "IN"}});
        rows.push_back(
            {"--session", "--paths", {command, "x", "--session", "IN", "--paths", "IN"}});
        rows.push_back(
            {"--session", "--preview", {command, "x", "--session", "IN", "--preview", "IN"}});
    }
    expect_inputs_guarded(line, rows, testing::TempDir() + "app_inputs");
}

/// Files that only the scene names: layers and textures.
TEST(Typing, ARenderWritesOverNoFileOfItsScene) {
    const Workplace w;
    w.write("ball.usda", textured_ball("t.exr"));
    w.write("root.usda", "#usda 1.0\n(\n subLayers = [@ball.usda@]\n)\n");
    w.write("s.usda", small_scene());
    ASSERT_EQ(w.velatura(std::string("render s.usda --res 8 8 -o t.exr") + quick).exit_code, 0);
    w.write("ball.usda", "#usda 1.0\n" + textured_ball("t.exr"));
    w.write("png.usda", "#usda 1.0\n" + textured_ball("p.png"));
    ASSERT_EQ(w.comp("mix t.exr -o p.png").exit_code, 0);
    const CommandResult preview =
        w.velatura(std::string("render png.usda --res 8 8 --preview p.png") + quick);
    EXPECT_EQ(preview.exit_code, 2) << preview.output;
    EXPECT_NE(preview.output.find("[overwrites-input]"), std::string::npos) << preview.output;
    const std::string before = w.hash("t.exr");
    std::filesystem::create_symlink("t.exr", w.path("link.exr"));
    for (const char* output : {"-o t.exr", "-o x.exr --stats ball.usda", "-o link.exr"}) {
        const CommandResult r =
            w.velatura(std::string("render root.usda --res 8 8 ") + output + quick);
        EXPECT_EQ(r.exit_code, 2) << output << ": " << r.output;
        EXPECT_NE(r.output.find("[overwrites-input]"), std::string::npos) << r.output;
    }
    EXPECT_EQ(w.hash("t.exr"), before);
    EXPECT_FALSE(w.exists("x.exr")) << "found before the render";
}

/// Numbers within texts: times, errors, sizes, ranges.
TEST(Typing, TextsThatHoldNumbersAreCheckedByTheirOptions) {
    const Workplace w;
    w.write("s.usda", small_scene());
    for (const char* option :
         {"--time", "--target-error", "--forecast", "--checkpoint", "--snapshot", "--memory-limit",
          "--samples", "--replay", "--frames", "--limit", "--every"}) {
        for (const char* value : {"nan", "-1m", ""}) {
            const CommandResult r =
                w.velatura(std::string("render s.usda ") + option + "='" + value + "'" + quick);
            EXPECT_EQ(r.exit_code, 2) << option << " '" << value << "': " << r.output;
            EXPECT_NE(r.output.find(option), std::string::npos) << r.output;
        }
    }
    EXPECT_EQ(w.files_beside("s.usda"), "");
}

TEST(Typing, OrderRepetitionAndFormsOfSizes) {
    const Workplace w;
    w.write("s.usda", small_scene());
    for (const std::string typed :
         {"render --res 16 12 s.usda -o x.exr", "render --res 16x12 s.usda -o x.exr",
          "render -o x.exr --purpose proxy --res 64 64 --res 16x12 s.usda",
          "s.usda --res 16x12 -o x.exr", "-o x.exr --res=16x12 s.usda",
          "render s.usda -o y.exr -o x.exr --res 8 8 --res 16 12"}) {
        const CommandResult r = w.velatura(typed + quick);
        EXPECT_EQ(r.exit_code, 0) << typed << ": " << r.output;
        EXPECT_EQ(w.files_beside("s.usda"), "x.exr") << typed;
        EXPECT_NE(w.comp("info x.exr").output.find("16×12"), std::string::npos)
            << w.comp("info x.exr").output;
        w.velatura("--version; rm x.exr");
    }
}

/// Images and statistics of each frame, in folders that are made.
TEST(Typing, NamesOfOutputsHaveTheFrame) {
    const Workplace w;
    w.write("s.usda", small_scene());
    for (const auto& [typed, files] : std::vector<std::pair<const char*, const char*>>{
             {"-f -1-0 -o 'o/m.####.exr' --stats 'o/st.$F4.json'",
              "m.-001.exr m.0000.exr st.-001.json st.0000.json"},
             {"-f 1 -o 'o/m.%04d.exr' --stats 'o/<F4>.json' --deep",
              "0001.json m.0001.deep.exr m.0001.exr"},
             {"-f 7,9 -o o/take#2.exr --stats o/st.json",
              "st.0007.json st.0009.json take#2.0007.exr take#2.0009.exr"},
             {"-f 1.5 -o 'o/$F4.exr'", "0001.500.exr"},
             {"-o 'o/50%done.exr'", "50%done.exr"},
             {"-f 3 -o 'o/f.####/b.####.exr'", "f.0003"}}) {
        const CommandResult r = w.velatura(std::string("render s.usda --res 8 8 ") + typed + quick);
        EXPECT_EQ(r.exit_code, 0) << typed << ": " << r.output;
        EXPECT_EQ(w.comp("--version > /dev/null; ls o | sort | tr '\\n' ' '; rm -r o").output,
                  std::string(files) + " ")
            << typed;
    }
}

TEST(Typing, MisspeltWordsGetTheNearest) {
    const Workplace w;
    w.write("s.usda", small_scene());
    for (const auto& [typed, said] : std::vector<std::pair<const char*, const char*>>{
             {"render --ssp 4 s.usda", "unknown option --ssp (did you mean '--spp'"},
             {"render s.usda --ssp=4", "unknown option --ssp (did you mean '--spp'"},
             {"s.usda --ssp 4", "unknown option --ssp (did you mean '--spp'"},
             {"render s.usda --bounce 4", "did you mean '--bounces'"},
             {"rendr s.usda", "unknown command 'rendr' (did you mean 'render'?)"},
             {"inof", "unknown command 'inof' (did you mean 'info'?)"},
             {"--spp 4 render s.usda", "--spp is an option of render and must follow it"},
             {"render s.usda --res 0 0", "--res: expected a size from 1 to 65536, found \"0\""},
             {"render s.usda --res 320", "--res: "},
             {"render s.usda --res 320x", "--res: "},
             {"render s.usda --res axb", "--res: expected a whole number, found \"a\""},
             {"render s.usda --res 1x2x3", "--res: "},
             {"render s.usda --spp -1",
              "--spp: expected a whole number of 0 or more, found \"-1\""}}) {
        const CommandResult r = w.velatura(typed);
        EXPECT_EQ(r.exit_code, 2) << typed << ": " << r.output;
        EXPECT_NE(r.output.find(said), std::string::npos) << typed << ": " << r.output;
    }
    EXPECT_EQ(w.files_beside("s.usda"), "");
}

}  // namespace velatura::test
