// SPDX-License-Identifier: Apache-2.0
// What people type on the command line of velatura-comp, and what they meant.
#include "base/command_line.h"
#include "base/number_options.h"
#include "base/overwritten_inputs.h"
#include "compositor/cli/command_outcome.h"
#include "compositor/cli/commands.h"

#include <gtest/gtest.h>

#include <functional>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace velatura::compositor::cli {
namespace {

/// The program with all its commands.
struct Program {
    CommandLine line{"", "velatura-comp"};
    std::function<int()> run;

    Program() {
        line.require_subcommand();
        for (const auto& add :
             {add_info_command, add_mix_command, add_noise_command, add_request_command,
              add_ui_command, add_verify_command, add_diff_command, add_merge_command,
              add_mattes_command, add_view_command, add_export_command, add_denoise_command,
              add_preset_command, add_bake_command})
            add(line, run);
    }
};

TEST(Typing, EveryNumberOptionRefusesWhatMakesNoSense) {
    Program program;
    std::set<std::string> below_zero = {"view --exposure", "ui --frame", "bake --crop"},
                          unbounded = {"ui --frame", "bake --crop", "diff --threshold"};
    for (const std::string command : {"mix", "noise", "request", "export", "bake"}) {
        for (const char* name : {" --exposure", " --frame"}) below_zero.insert(command + name);
        unbounded.insert(command + " --frame");
    }
    const std::set<std::string> tried = expect_numbers_checked(program.line, below_zero, unbounded);
    for (const char* name : {"mix --memory", "noise --exposure", "request --spp", "ui --size",
                             "diff --threshold", "view --columns", "bake --spp"})
        EXPECT_TRUE(tried.contains(name)) << name;
}

TEST(Typing, NoCommandWritesOverWhatItReads) {
    Program program;
    std::vector<OverwritingCommand> rows = {
        {"input", "--output", {"mix", "IN", "-o", "IN"}},
        {"input", "--output", {"mix", "-o", "IN", "IN"}},
        {"--plate", "--output", {"mix", "x", "--plate", "IN", "-o", "IN"}},
        {"--preset",
         "--save-preset",
         {"mix", "x", "-o", "y", "--preset", "IN", "--save-preset", "IN"}},
        {"--stats", "--output", {"noise", "x", "--stats", "IN", "-o", "IN"}},
        {"--stats", "--output", {"request", "x", "--stats", "IN", "--time", "5s", "-o", "IN"}},
        {"a", "--output", {"diff", "IN", "x", "-o", "IN"}},
        {"b", "--output", {"diff", "x", "IN", "-o", "IN"}},
        {"inputs", "--output", {"merge", "x", "IN", "-o", "IN"}},
        {"inputs", "--output", {"mattes", "x", "IN", "-o", "IN"}},
        {"input", "--output", {"view", "IN", "-o", "IN"}},
        {"input", "--output", {"export", "nuke", "IN", "-o", "IN"}},
        {"--file", "--output", {"export", "oiio", "x", "--file", "IN", "-o", "IN"}},
        {"input", "--output", {"denoise", "IN", "-o", "IN"}},
        {"--scene", "--output", {"bake", "x", "--prove", "--scene", "IN", "-o", "IN"}}};
    for (const std::string command : {"noise", "request", "bake"})
        rows.push_back({"input", "--output", {command, "IN", "-o", "IN"}});
    for (const std::string command : {"noise", "request", "bake"})
        rows.push_back({"--preset", "--output", {command, "x", "--preset", "IN", "-o", "IN"}});
    rows.push_back({"--preset", "--output", {"export", "nuke", "x", "--preset", "IN", "-o", "IN"}});
    expect_inputs_guarded(program.line, rows, testing::TempDir() + "comp_inputs");
}

TEST(Typing, MisspeltWordsGetTheNearest) {
    Program program;
    for (const auto& [typed, said] : std::vector<std::pair<std::vector<std::string>, std::string>>{
             {{"mxi", "a.exr"}, "unknown command 'mxi' (did you mean 'mix' or 'ui'?)"},
             {{"mix", "a.exr", "--gian", "key=2"},
              "unknown option --gian (did you mean '--gain'?)"},
             {{"mix", "a.exr", "--ouput", "b.exr"},
              "unknown option --ouput (did you mean '--output'?)"},
             {{"preset", "dif", "a.json"}, "unknown command 'dif' (did you mean 'diff'?)"}}) {
        const auto ended = program.line.parse(typed);
        ASSERT_TRUE(ended.has_value());
        EXPECT_EQ(ended->code, 2);
        EXPECT_EQ(ended->message, said);
    }
}

// The name that the command had is taken, and stands in no help.
TEST(Typing, RequestIsStillFoundByItsFormerName) {
    Program program;
    EXPECT_FALSE(program.line.parse({"plan", "a.exr", "-o", "b.json"}).has_value());
    EXPECT_TRUE(bool(program.run));
    Program other;
    const auto help = other.line.parse({"--help"});
    ASSERT_TRUE(help.has_value());
    EXPECT_NE(help->text.find("request"), std::string::npos);
    EXPECT_EQ(help->text.find("\n  plan"), std::string::npos) << help->text;
}

// Warnings of the frames of a sequence differ in the file that they start with.
TEST(Warnings, OfManyFramesAreCounted) {
    RepeatedWarnings warnings;
    size_t printed = 0;
    for (int frame = 0; frame < 25; ++frame)
        printed += warnings.can_print(std::to_string(frame) + ".exr: 3 values are not finite");
    EXPECT_TRUE(warnings.can_print("no half images"));
    EXPECT_EQ(printed, RepeatedWarnings::printed_limit);
    EXPECT_EQ(warnings.take_summary(),
              "warning: 5 more like these, not printed: 3 values are not finite\n");
}

TEST(Typing, OptionsStandWhereverPeoplePutThem) {
    for (const std::vector<std::string>& typed : std::vector<std::vector<std::string>>{
             {"mix", "--gain", "key=2", "a.exr", "-o", "b.exr"},
             {"mix", "-o", "x.exr", "--exposure", "3", "--exposure", "-.5", "a.exr", "-o", "b.exr"},
             {"view", "--layers", "b*", "--layers", "tail", "a.exr", "-o", "b.png"},
             {"ui", "--size", "1000x700", "a.exr"}}) {
        Program program;
        const auto ended = program.line.parse(typed);
        EXPECT_FALSE(ended.has_value()) << ended->message;
    }
}

}  // namespace
}  // namespace velatura::compositor::cli
