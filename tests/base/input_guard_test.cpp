// SPDX-License-Identifier: Apache-2.0
#include "base/input_guard.h"

#include "base/atomic_file.h"
#include "base/command_line.h"
#include "folder_test.h"

#include <gtest/gtest.h>

namespace velatura {
namespace {

namespace fs = std::filesystem;

class InputGuard : public FolderTest {
  protected:
    void SetUp() override {
        FolderTest::SetUp();
        ASSERT_TRUE(write_file_atomically(path("in.exr"), "input"));
        fs::create_hard_link(path("in.exr"), path("hard.exr"));
        fs::create_symlink(path("in.exr"), path("soft.exr"));
        fs::create_directory(path("sub"));
    }

    void TearDown() override {
        stop_guarding_inputs();
        FolderTest::TearDown();
    }

    std::string path(const std::string& name) const { return (folder_ / name).string(); }

    /// Of a program with one command of each kind of option.
    std::optional<CommandExit> parse(const std::vector<std::string>& words) {
        CommandLine line("", "test");
        line.require_subcommand();
        std::string input, output, preset;
        std::vector<std::string> more;
        Command mix = line.add_subcommand("mix", "");
        mix.add_option("input", input, "").reads();
        mix.add_option("-o,--output", output, "").writes();
        Command group = mix.add_group("More");
        group.add_option("--save-preset", preset, "").writes();
        group.add_option("--also", more, "").reads();
        Command info = line.add_subcommand("info", "");
        info.add_option("input", input, "").reads();
        auto ended = line.parse(words);
        for (const DeclaredOption& option : line.declared_options())
            EXPECT_EQ(option.reads, option.name == "input" || option.name == "--also");
        return ended;
    }
};

TEST_F(InputGuard, KnowsAFileByWhateverName) {
    const auto is_refused = [&](const std::string& name) {
        const Result<void> checked = check_output(path(name));
        return !checked && checked.error().code == "overwrites-input" &&
               !write_file_atomically(path(name), "output");
    };
    const std::vector<std::string> names = {"in.exr", "hard.exr", "soft.exr", "sub/../in.exr",
                                            "./in.exr"};
    guard_input(path("in.exr"));
    for (const std::string& name : names)
        EXPECT_FALSE(check_output(path(name)).has_value() == false);
    start_guarding_inputs();
    for (const std::string& input : names) {
        start_guarding_inputs();
        guard_input(path(input));
        for (const std::string& name : names) EXPECT_TRUE(is_refused(name)) << input << " " << name;
        EXPECT_TRUE(write_file_atomically(path("other.exr"), "output"));
    }
    EXPECT_EQ(*read_file(path("in.exr")), "input");
    // Neither what is not there nor devices are inputs that could be lost
    guard_input(path("nothing"));
    guard_input("/dev/null");
    EXPECT_TRUE(check_output(path("nothing")));
    EXPECT_TRUE(check_output("/dev/null"));
    stop_guarding_inputs();
    EXPECT_TRUE(write_file_atomically(path("in.exr"), "output"));
}

TEST_F(InputGuard, CommandsThatReadAndWriteRefuseTheSameFile) {
    for (const char* name : {"in.exr", "hard.exr", "soft.exr", "sub/../in.exr"}) {
        for (const std::vector<std::string>& words : std::vector<std::vector<std::string>>{
                 {"mix", path("in.exr"), "-o", path(name)},
                 {"mix", "-o", path(name), path("soft.exr")},
                 {"mix", path("x.exr"), "--also", path("y"), "--also", path("in.exr"),
                  "--save-preset", path(name)}}) {
            const auto ended = parse(words);
            ASSERT_TRUE(ended.has_value()) << name;
            EXPECT_EQ(ended->code, 2);
            EXPECT_NE(ended->text.find("--overwrite-input"), std::string::npos) << ended->text;
            EXPECT_NE(ended->text.find(path(name)), std::string::npos) << ended->text;
        }
    }
    EXPECT_FALSE(parse({"mix", path("in.exr"), "-o", path("out.exr")}));
    // What is found out later is refused where it is written
    EXPECT_FALSE(write_file_atomically(path("hard.exr"), "output"));
    EXPECT_FALSE(parse({"mix", path("in.exr"), "-o", path("in.exr"), "--overwrite-input"}));
    EXPECT_TRUE(write_file_atomically(path("hard.exr"), "output"));
    EXPECT_TRUE(parse({"info", path("in.exr"), "--overwrite-input"})) << "it writes nothing";
}

TEST_F(InputGuard, SequencesAreTheirFiles) {
    for (const char* name : {"s.0001.exr", "s.-002.exr"})
        ASSERT_TRUE(write_file_atomically(path(name), "frame"));
    fs::create_symlink(path("s.0001.exr"), path("link.07.exr"));
    for (const char* output :
         {"s.####.exr", "s.%04d.exr", "s.0001.exr", "link.##.exr", "link.07.exr", "s.-002.exr"})
        EXPECT_TRUE(parse({"mix", path("s.$F4.exr"), "-o", path(output)})) << output;
    for (const char* output : {"t.####.exr", "s.##.exr", "s.0003.exr"})
        EXPECT_FALSE(parse({"mix", path("s.$F4.exr"), "-o", path(output)})) << output;
}

}  // namespace
}  // namespace velatura
