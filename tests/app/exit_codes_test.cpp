// SPDX-License-Identifier: Apache-2.0
// The exit codes: one table, which --help and the docs repeat, and which of several is returned.
#include "app/exit_codes.h"

#include "app/accuracy.h"
#include "command.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <sstream>
#include <string>

namespace velatura::app {

namespace {

std::string text_of(const std::string& file) {
    std::ifstream in(std::string(VELATURA_SOURCE_DIR) + "/" + file);
    std::stringstream text;
    text << in.rdbuf();
    return text.str();
}

}  // namespace

TEST(ExitCodes, HelpAndDocsHaveTheTable) {
    const test::Workplace w;
    const std::string help = w.velatura("--help").output;
    const std::string docs = text_of("docs/reference/command_line.md");
    // Lines of help are broken between words
    std::string words;
    std::istringstream in(help);
    for (std::string word; in >> word;) words += word + " ";
    for (const ExitCodeInfo& info : exit_code_table) {
        EXPECT_NE(words.find(fmt::format(" {} {}", info.name, info.meaning)), std::string::npos)
            << info.name << " in: " << words;
        EXPECT_NE(docs.find(fmt::format("\n| {} | {}", info.name, info.meaning)), std::string::npos)
            << info.name;
    }
}

TEST(ExitCodes, TheMoreSeriousIsReturned) {
    // Every pair, either way round; ranks differ, so that no order of two codes matters
    for (const ExitCodeInfo& a : exit_code_table) {
        for (const ExitCodeInfo& b : exit_code_table) {
            EXPECT_EQ(worse_exit_code(a.code, b.code), worse_exit_code(b.code, a.code));
            EXPECT_EQ(worse_exit_code(a.code, b.code), a.rank > b.rank ? a.code : b.code);
        }
    }
    EXPECT_EQ(worse_exit_code(TargetMissed, RenderError), RenderError);
    EXPECT_EQ(worse_exit_code(CheckFailed, RenderError), CheckFailed);
    EXPECT_EQ(worse_exit_code(SignalBase + 15, RenderError), SignalBase + 15);
}

namespace {

using integrator::StopReason;

/// What is typed, what ended the render, its error, and what follows.
struct Case {
    const char* spp;
    const char* time;
    const char* target_error;
    bool requires_target;
    StopReason reason;
    double error;
    bool is_lower;
    int code;
    const char* text;  ///< part of what is said; empty: nothing
};

BudgetOutcome outcome_of(const Case& c) {
    RenderArguments a;
    a.scene = "s.usda";
    if (*c.spp) a.spp = std::stoull(c.spp);
    a.time = c.time;
    a.target_error = c.target_error;
    a.requires_target = c.requires_target;
    const Result<RenderJob> job = make_render_job(a);
    if (!job) return {job.error().message, true, UsageError};
    ImageError error;
    error.error.value = c.error;
    error.is_lower = c.is_lower;
    integrator::RenderResult result;
    result.reason = c.reason;
    return budget_outcome(*job, error, result);
}

}  // namespace

TEST(ExitCodes, OfBudgetsAndTargets) {
    constexpr auto complete = StopReason::Complete, time = StopReason::TimeBudget,
                   target = StopReason::TargetError;
    const Case cases[] = {
        // Nothing but samples
        {"", "", "", false, complete, 0.1, false, Done, ""},
        {"64", "", "", true, complete, 0.1, false, Done, ""},
        // A budget of time, alone and with samples
        {"", "30s", "", false, time, 0.1, false, Done, "stopped at --time 30s"},
        {"1000", "30s", "", false, time, 0.1, false, Done, "before all 1000 samples"},
        {"1000", "30s", "", true, time, 0.1, false, TargetMissed, "before all 1000 samples"},
        {"1000", "30s", "", false, complete, 0.1, false, Done, ""},
        {"", "30s", "", true, time, 0.1, false, UsageError,
         "--require-target needs --target-error"},
        // A target, alone: the bound that nobody typed misses it
        {"", "", "5%", false, target, 0.05, false, Done, ""},
        {"", "", "5%", false, complete, 0.1, false, TargetMissed,
         "stopped at the maximum samples without --spp"},
        // With a budget that somebody typed
        {"", "30s", "5%", false, time, 0.1, false, Done, "before --target-error 5%"},
        {"", "30s", "5%", true, time, 0.1, false, TargetMissed, "before --target-error 5%"},
        {"", "30s", "5%", true, time, 0.04, false, Done, ""},
        {"64", "", "5%", false, complete, 0.1, false, Done, "stopped at --spp 64 before"},
        {"64", "", "5%", true, complete, 0.1, false, TargetMissed, "stopped at --spp 64 before"},
        {"64", "", "5%", true, complete, 0.05, false, Done, ""},
        // A lower bound reaches no target that is required
        {"", "", "5%", false, target, 0.05, true, Done, ""},
        {"64", "", "5%", true, complete, 0.04, true, TargetMissed, "stopped at --spp 64 before"},
        {"64", "", "5%", false, complete, 0.04, true, Done, "stopped at --spp 64 before"},
    };
    for (size_t i = 0; i < std::size(cases); ++i) {
        SCOPED_TRACE(i);
        const BudgetOutcome outcome = outcome_of(cases[i]);
        EXPECT_EQ(outcome.code, cases[i].code) << outcome.text;
        EXPECT_NE(outcome.text.find(cases[i].text), std::string::npos) << outcome.text;
        if (!*cases[i].text) {
            EXPECT_EQ(outcome.text, "");
        }
    }
}

/// The option alone decides how long a render takes.
TEST(ExitCodes, ABudgetThatIsTypedAloneRules) {
    const test::Workplace w;
    w.write("s.usda", test::small_scene());
    const std::string render = "render s.usda --res 12 9 --layers none --progress none ";
    // 64 samples of this take far less than 0.7 s
    const test::CommandResult timed = w.velatura(render + "--time 0.7s -o t.exr --stats t.json");
    EXPECT_EQ(timed.exit_code, Done) << timed.output;
    EXPECT_NE(timed.output.find("stopped at --time 0.7s after"), std::string::npos) << timed.output;
    // 64 samples leave far more than 1 %
    const test::CommandResult exact = w.velatura(render + "--target-error 1.5% -o e.exr");
    EXPECT_EQ(exact.exit_code, Done) << exact.output;
    EXPECT_EQ(exact.output.find("[budget]"), std::string::npos) << exact.output;
    EXPECT_EQ(w.velatura(render + "--spp 16 --target-error 0.1% -o f.exr").exit_code, Done);
    EXPECT_EQ(
        w.velatura(render + "--spp 16 --target-error 0.1% --require-target -o f.exr").exit_code,
        TargetMissed);
    // A missing asset outranks a missed target, and both are said
    w.write("m.usda", test::small_scene() + "def \"A\" (references = @none.usda@) {}\n");
    const test::CommandResult both = w.velatura(
        "render m.usda --res 12 9 --layers none --progress none --spp 16 --target-error 0.1% "
        "--require-target -o g.exr");
    EXPECT_EQ(both.exit_code, RenderError) << both.output;
    EXPECT_NE(both.output.find("[budget]"), std::string::npos) << both.output;
    EXPECT_NE(both.output.find("[missing-assets]"), std::string::npos) << both.output;
}

}  // namespace velatura::app
