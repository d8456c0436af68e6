// SPDX-License-Identifier: Apache-2.0
// The help: what most people need in --help, everything in --help-all, topics.
#include "app/commands.h"
#include "app/help_topics.h"
#include "base/command_line.h"
#include "command.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <functional>
#include <optional>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace velatura::app {

namespace {

std::string help_of(const std::vector<std::string>& arguments) {
    CommandLine line("", "velatura");
    std::function<int()> run;
    add_render_command(line, run);
    add_plan_command(line, run);
    const std::optional<CommandExit> ended = line.parse(arguments);
    return ended ? ended->text : std::string();
}

/// Long names of the options that a help page lists, in its order.
std::vector<std::string> options_in(const std::string& help) {
    std::vector<std::string> names;
    std::istringstream lines(help);
    const std::regex entry("^  (?:-\\w, )?(--[a-z-]+).*");
    std::smatch found;
    for (std::string line; std::getline(lines, line);)
        if (std::regex_match(line, found, entry)) names.push_back(found[1]);
    return names;
}

}  // namespace

TEST(Help, ListsWhatMostPeopleNeedAndEverythingOnRequest) {
    for (const char* command : {"render", "plan"}) {
        const std::vector<std::string> usual = options_in(help_of({command, "--help"}));
        const std::vector<std::string> all = options_in(help_of({command, "--help-all"}));
        EXPECT_GE(usual.size(), 20u) << command;
        EXPECT_LE(usual.size(), 32u) << command;
        EXPECT_GT(all.size(), 75u) << command;
        const std::set<std::string> known(all.begin(), all.end());
        EXPECT_EQ(known.size(), all.size()) << command << ": an option is listed twice";
        for (const std::string& name : usual) EXPECT_TRUE(known.contains(name)) << name;
        for (const char* name : {"--output", "--spp", "--target-error", "--bounces", "--lights",
                                 "--resume", "--progress", "--help-all"})
            EXPECT_NE(std::find(usual.begin(), usual.end(), name), usual.end()) << name;
    }
}

TEST(Help, ClassicEstimatorsComeLast) {
    const std::string help = help_of({"render", "--help-all"});
    const size_t classic = help.find("\nClassic estimators:\n");
    ASSERT_NE(classic, std::string::npos) << help;
    for (const char* heading : {"\nScene:\n", "\nOutput:\n", "\nQuality:\n", "\nLight layers:\n",
                                "\nProgress and reports:\n", "\nSampling:\n"})
        EXPECT_LT(help.find(heading), classic) << heading;
    EXPECT_GT(help.find("  --integrator"), classic);
    EXPECT_EQ(help_of({"render", "--help"}).find("--integrator"), std::string::npos);
}

/// Every option of render has a description that starts with a capital letter.
TEST(Help, DescriptionsStartWithANoun) {
    const std::string help = help_of({"render", "--help-all"});
    const std::regex entry("\n  (?:-\\w, )?--[^\n]*?(?:  +|\n {30})(\\S+)");
    size_t count = 0;
    for (std::sregex_iterator at(help.begin(), help.end(), entry), end; at != end; ++at, ++count)
        EXPECT_TRUE(std::isupper(static_cast<unsigned char>(at->str(1)[0]))) << at->str();
    EXPECT_GT(count, 75u);
}

TEST(Help, TopicsAreShortAndNamePagesThatExist) {
    ASSERT_GE(help_topics().size(), 4u);
    const std::regex page("docs/[a-z_/]+\\.md");
    for (const HelpTopic& topic : help_topics()) {
        const std::string text(topic.text);
        std::istringstream lines(text);
        int count = 0;
        for (std::string line; std::getline(lines, line); ++count)
            EXPECT_LE(line.size(), 100u) << topic.name << ": " << line;
        EXPECT_LE(count, 60) << topic.name;
        const std::sregex_iterator begin(text.begin(), text.end(), page), end;
        EXPECT_NE(begin, end) << topic.name << " names no page";
        for (std::sregex_iterator at = begin; at != end; ++at)
            EXPECT_TRUE(std::filesystem::exists(std::string(VELATURA_SOURCE_DIR) + "/" + at->str()))
                << at->str();
    }
}

TEST(Help, TheCommandPrintsTopicsAndCommands) {
    const test::Workplace w;
    EXPECT_NE(w.velatura("help").output.find("\n  security "), std::string::npos);
    const test::CommandResult farm = w.velatura("help farm");
    EXPECT_EQ(farm.exit_code, 0);
    EXPECT_NE(farm.output.find("--samples 0:128"), std::string::npos) << farm.output;
    const test::CommandResult info = w.velatura("help info");
    EXPECT_EQ(info.exit_code, 0);
    EXPECT_NE(info.output.find("Usage: velatura info [OPTIONS] scene"), std::string::npos)
        << info.output;
    EXPECT_NE(w.velatura("help rendr").output.find("(did you mean 'render'?)"), std::string::npos);
    const test::CommandResult mix = w.comp("help mix");
    EXPECT_EQ(mix.exit_code, 0);
    EXPECT_EQ(mix.output, w.comp("mix --help").output);
    EXPECT_EQ(w.comp("help").output, w.comp("--help").output);
    const test::CommandResult nothing = w.comp("help mxx");
    EXPECT_EQ(nothing.exit_code, 2);
    EXPECT_NE(nothing.output.find("error: no command \"mxx\" (did you mean 'mix'?) [usage]"),
              std::string::npos)
        << nothing.output;
    const test::CommandResult wrong = w.velatura("help securty");
    EXPECT_EQ(wrong.exit_code, 2);
    EXPECT_NE(wrong.output.find("error: no help topic \"securty\" (did you mean 'security'?)"),
              std::string::npos)
        << wrong.output;
}

}  // namespace velatura::app
