// SPDX-License-Identifier: Apache-2.0
#include "base/command_line.h"

#include <gtest/gtest.h>

#include <limits>

namespace velatura {
namespace {

using Words = std::vector<std::string>;

/// The message of the usage error that these arguments cause; empty: none.
std::string refusal(CommandLine& line, const Words& arguments) {
    const std::optional<CommandExit> ended = line.parse(arguments);
    if (!ended) return {};
    EXPECT_EQ(ended->code, 2);
    EXPECT_EQ(ended->text, ended->message + "\nRun with --help for more information.\n");
    return ended->message;
}

/// What an option of type T holds after these arguments.
template <class T>
T parsed(const Words& arguments, T destination = {}) {
    CommandLine line("", "test");
    line.add_option("-v,--value", destination, "");
    EXPECT_EQ(refusal(line, arguments), "");
    return destination;
}

/// Why an option of type T refuses this value.
template <class T>
std::string refused(const std::string& value) {
    CommandLine line("", "test");
    T destination = {};
    line.add_option("--value", destination, "");
    return refusal(line, {"--value", value});
}

TEST(CommandLine, ParsesEveryTypeOfDestination) {
    EXPECT_EQ(parsed<std::string>({"--value", "a b"}), "a b");
    EXPECT_EQ(parsed<int>({"-v", "-7"}), -7);
    EXPECT_EQ(parsed<uint32_t>({"--value=4294967295"}), 4294967295u);
    EXPECT_EQ(parsed<uint64_t>({"--value", "18446744073709551615"}),
              std::numeric_limits<uint64_t>::max());
    EXPECT_EQ(parsed<float>({"-v0.1"}), 0.1f);
    EXPECT_EQ(parsed<double>({"--value", "1e-3"}), 1e-3);
    EXPECT_EQ(parsed<Words>({"--value", "a", "b"}), (Words{"a", "b"}));
    EXPECT_EQ(parsed<std::vector<int>>({"--value", "1", "-2"}), (std::vector<int>{1, -2}));
    EXPECT_EQ(parsed<std::vector<uint32_t>>({"-v", "3"}), (std::vector<uint32_t>{3}));
    EXPECT_EQ(parsed<std::vector<double>>({"-v", "0.5", "2"}), (std::vector<double>{0.5, 2}));
    EXPECT_EQ(parsed<std::optional<std::string>>({"--value", "1%"}), "1%");
    EXPECT_EQ(parsed<std::optional<int>>({"--value", "0"}), 0);
    EXPECT_EQ(parsed<std::optional<uint64_t>>({"--value", "4294967296"}), uint64_t(1) << 32);
    EXPECT_EQ(parsed<std::optional<double>>({"--value", "0.25"}), 0.25);
}

TEST(CommandLine, KeepsDestinationsOfAbsentOptions) {
    EXPECT_EQ(parsed<std::string>({}, "before"), "before");
    EXPECT_EQ(parsed<int>({}, 5), 5);
    EXPECT_EQ(parsed<Words>({}, {"before"}), (Words{"before"}));
    EXPECT_EQ(parsed<std::optional<double>>({}), std::nullopt);
}

TEST(CommandLine, RefusesWhatIsNoNumber) {
    EXPECT_EQ(refused<int>("3.5"), "Could not convert: --value = 3.5");
    EXPECT_EQ(refused<uint64_t>("1e3"), "Could not convert: --value = 1e3");
    EXPECT_EQ(refused<double>("far"), "Could not convert: --value = far");
    EXPECT_EQ(refused<std::optional<int>>("x"), "Could not convert: --value = x");
}

TEST(CommandLine, FlagsAreSetOrCounted) {
    CommandLine line("", "test");
    bool quiet = false;
    int verbosity = 9;
    const Option q = line.add_flag("-q,--quiet", quiet, "");
    const Option v = line.add_flag("-v,--verbose", verbosity, "");
    EXPECT_EQ(verbosity, 0);
    EXPECT_EQ(refusal(line, {"-v", "--verbose", "-v"}), "");
    EXPECT_FALSE(quiet);
    EXPECT_EQ(verbosity, 3);
    EXPECT_EQ(q.count(), 0u);
    EXPECT_EQ(v.count(), 3u);
    EXPECT_EQ(refusal(line, {"-q"}), "");
    EXPECT_TRUE(quiet);
}

TEST(CommandLine, RangesIncludeTheirBounds) {
    CommandLine line("", "test");
    int tile = 0;
    uint64_t spp = 0;
    float stops = 0;
    double gb = 0, seed = 0;
    line.add_option("--tile", tile, "").range(1, 64);
    line.add_option("--spp", spp, "").range(uint64_t(1), uint64_t(1) << 32);
    line.add_option("--stops", stops, "").range(-64.0f, 64.0f);
    line.add_option("--memory", gb, "").range(0.1, 4096.0);
    line.add_option("--seed", seed, "").non_negative();
    for (const Words& good :
         {Words{"--tile", "1"}, Words{"--tile", "64"}, Words{"--spp", "4294967296"},
          Words{"--stops", "-64"}, Words{"--memory", "0.1"}, Words{"--seed", "0"}})
        EXPECT_EQ(refusal(line, good), "") << good[0];
    EXPECT_EQ(refusal(line, {"--tile", "0"}), "--tile: Value 0 not in range 1 to 64");
    EXPECT_EQ(refusal(line, {"--tile", "65"}), "--tile: Value 65 not in range 1 to 64");
    EXPECT_EQ(refusal(line, {"--tile", "x"}), "--tile: Value x not in range 1 to 64");
    EXPECT_EQ(refusal(line, {"--spp", "4294967297"}),
              "--spp: Value 4294967297 not in range 1 to 4294967296");
    EXPECT_EQ(refusal(line, {"--stops", "65"}),
              "--stops: Value 65 not in range -64.000000 to 64.000000");
    EXPECT_EQ(refusal(line, {"--memory", "0"}),
              "--memory: Value 0 not in range 0.100000 to 4096.000000");
    EXPECT_NE(refusal(line, {"--seed", "-1"}), "");
}

TEST(CommandLine, OneOfRefusesOtherWords) {
    CommandLine line("", "test");
    std::string mode;
    Words purposes;
    line.add_option("--mode", mode, "").one_of({"tile", "progressive"});
    line.add_option("--purpose", purposes, "").delimiter(',').one_of({"render", "proxy", "guide"});
    EXPECT_EQ(refusal(line, {"--mode", "tile", "--purpose", "guide,,render"}), "");
    EXPECT_EQ(mode, "tile");
    EXPECT_EQ(purposes, (Words{"guide", "render"}));
    EXPECT_EQ(refusal(line, {"--mode", "Tile"}), "--mode: Tile not in {tile,progressive}");
    EXPECT_EQ(refusal(line, {"--purpose", "render,all"}),
              "--purpose: all not in {render,proxy,guide}");
}

TEST(CommandLine, ChecksSeeEveryValueInOrder) {
    CommandLine line("", "test");
    Words seen;
    line.add_option("--limit", "").expected(1).take_all().check([&](const std::string& value) {
        seen.push_back(value);
        return value.empty() ? std::string("expected NAME=VALUE") : std::string();
    });
    EXPECT_EQ(refusal(line, {"--limit", "b=1", "--limit=a=2"}), "");
    EXPECT_EQ(seen, (Words{"b=1", "a=2"}));
    EXPECT_EQ(refusal(line, {"--limit", "b=1", "--limit", ""}), "--limit: expected NAME=VALUE");
}

TEST(CommandLine, ExistingDirectoryRefusesOthers) {
    CommandLine line("", "test");
    Words folders;
    line.add_option("--search-path", folders, "")
        .existing_directory()
        .take_all()
        .allow_extra_args(false);
    EXPECT_EQ(refusal(line, {"--search-path", "/", "--search-path", "."}), "");
    EXPECT_EQ(folders, (Words{"/", "."}));
    EXPECT_EQ(refusal(line, {"--search-path", "/velatura_no_such_folder"}),
              "--search-path: Directory does not exist: /velatura_no_such_folder");
    EXPECT_EQ(refusal(line, {"--search-path", "/", "."}),
              "The following argument was not expected: .");
}

TEST(CommandLine, NumbersOfValues) {
    CommandLine line("", "test");
    std::string scene, camera;
    std::vector<int> resolution;
    line.add_option("scene", scene, "").required();
    line.add_option("--camera", camera, "");
    line.add_option("--res", resolution, "").expected(2);
    EXPECT_EQ(refusal(line, {}), "scene is required");
    EXPECT_EQ(refusal(line, {"--res", "640", "480", "a.usda"}), "");
    EXPECT_EQ(scene, "a.usda");
    EXPECT_EQ(resolution, (std::vector<int>{640, 480}));
    EXPECT_EQ(refusal(line, {"a.usda", "--res", "640"}),
              "--res: At least 2 required but received 1");
    EXPECT_EQ(refusal(line, {"a.usda", "b.usda"}),
              "The following argument was not expected: b.usda");
    EXPECT_EQ(refusal(line, {"a.usda", "--camera", "/A", "--camera", "/B"}),
              "--camera: At Most 1 required but received 2");
    line.find_option("scene").required(false);
    EXPECT_EQ(refusal(line, {"--camera", "/A"}), "");
}

TEST(CommandLine, NeedsAndExcludes) {
    CommandLine line("", "test");
    bool prove = false, quiet = false, json = false;
    std::string scene;
    const Option needed = line.add_flag("--prove", prove, "");
    line.add_option("--scene", scene, "").needs(needed);
    const Option other = line.add_flag("--quiet", quiet, "");
    line.add_flag("--json", json, "").excludes(other);
    EXPECT_EQ(refusal(line, {"--prove"}), "");
    EXPECT_EQ(refusal(line, {"--scene", "a.usda", "--prove", "--json"}), "");
    EXPECT_EQ(refusal(line, {"--scene", "a.usda"}), "--scene requires --prove");
    EXPECT_EQ(refusal(line, {"--json", "--quiet"}), "--quiet excludes --json");
}

TEST(CommandLine, GroupsLimitTheNumberOfTheirOptions) {
    CommandLine line("", "test");
    double spp = 0, factor = 0;
    Command how = line.add_group("How far");
    how.add_option("--spp", spp, "");
    how.add_option("--factor", factor, "");
    how.require_options(0, 1);
    EXPECT_EQ(refusal(line, {}), "");
    EXPECT_EQ(refusal(line, {"--factor", "2"}), "");
    EXPECT_EQ(refusal(line, {"--factor", "2", "--spp", "4"}),
              "Requires at most 1 options be given from [--spp,--factor]");
    // A command finds the options of its groups
    EXPECT_EQ(line.find_option("--spp").count(), 1u);
}

TEST(CommandLine, TypedOptionsKeepTheOrderAmongOptions) {
    CommandLine line("", "test");
    std::string input;
    bool lenient = false;
    line.add_option("input", input, "");
    line.add_option("--gain", "").expected(1).take_all();
    line.add_option("-m,--mute", "").expected(1).take_all();
    line.add_flag("--lenient", lenient, "");
    EXPECT_EQ(refusal(line, {"--gain", "key=2", "-m", "sky", "a.exr", "--lenient", "--gain=b1=0"}),
              "");
    std::string typed;
    for (const TypedOption& o : line.typed_options()) typed += o.name + " " + o.value + "; ";
    EXPECT_EQ(typed, "--gain key=2; --mute sky; input a.exr; --lenient true; --gain b1=0; ");
}

TEST(CommandLine, RunsTheCallbackOfTheSubcommand) {
    CommandLine line("", "test");
    line.require_subcommand();
    std::string called, file;
    Command info = line.add_subcommand("info", "");
    info.add_option("file", file, "").required();
    info.callback([&] { called += "info " + file; });
    line.add_subcommand("mix", "").callback([&] { called += "mix"; });
    EXPECT_EQ(refusal(line, {"info", "a.exr"}), "");
    EXPECT_EQ(called, "info a.exr");
    EXPECT_EQ(refusal(line, {}), "A subcommand is required");
    EXPECT_EQ(refusal(line, {"info"}), "file is required");
    EXPECT_EQ(refusal(line, {"paint"}), "A subcommand is required");
    EXPECT_EQ(refusal(line, {"mix", "paint"}), "The following argument was not expected: paint");
    EXPECT_EQ(called, "info a.exr");
}

/// Types, a default, a placeholder, a group, a hidden option, a subcommand, a footer.
TEST(CommandLine, HelpIsThisText) {
    CommandLine line("Renders.", "paint");
    line.add_version_flag("paint 1.2");
    std::string scene, mode = "tile", secret;
    int tile = 32;
    std::vector<int> resolution;
    bool quiet = false;
    line.add_option("scene", scene, "USD scene").required();
    line.add_option("--tile", tile, "pixels").range(1, 64).show_default();
    Option res = line.add_option("--res", resolution, "width and height");
    res.expected(2).type_name("W H");
    res.description("size");
    line.add_option("--secret", secret, "").hidden();
    Command how = line.add_group("How");
    how.add_option("--mode", mode, "order of pixels").one_of({"tile", "progressive"});
    how.add_flag("-q,--quiet", quiet, "errors only").needs(res);
    line.add_subcommand("info", "What a file holds");
    line.footer("Exit codes: 0 done.");

    const std::optional<CommandExit> help = line.parse({"--help"});
    ASSERT_TRUE(help.has_value());
    EXPECT_EQ(help->code, 0);
    EXPECT_EQ(help->message, "");
    EXPECT_EQ(help->text, R"(Renders.
Usage: paint [OPTIONS] scene [SUBCOMMAND]

Positionals:
  scene TEXT REQUIRED         USD scene

Options:
  -h,--help                   Print this help message and exit
  --version                   Display program version information and exit
  --tile INT:INT in [1 - 64]=32
                              pixels
  --res W H x 2               size

[Option Group: How]
  Options:
    --mode TEXT:{tile,progressive}
                                order of pixels
    -q,--quiet Needs: --res     errors only

Subcommands:
  info                        What a file holds

Exit codes: 0 done.
)");
}

TEST(CommandLine, EndsWithAVersionOrAnErrorByTheNameOfTheProgram) {
    CommandLine line("Renders.");
    line.add_version_flag("paint 1.2");
    const char* const version[] = {"./paint", "--version"};
    const std::optional<CommandExit> ended = line.parse(2, version);
    ASSERT_TRUE(ended.has_value());
    EXPECT_EQ(ended->code, 0);
    EXPECT_EQ(ended->text, "paint 1.2\n");

    const char* const help[] = {"./paint", "-h"};
    EXPECT_NE(line.parse(2, help)->text.find("Usage: ./paint [OPTIONS]\n"), std::string::npos);

    const char* const wrong[] = {"./paint", "--colour"};
    const std::optional<CommandExit> error = line.parse(2, wrong);
    ASSERT_TRUE(error.has_value());
    EXPECT_EQ(error->code, 2);
    EXPECT_EQ(error->text,
              "The following argument was not expected: --colour\n"
              "Run with --help for more information.\n");

    const char* const nothing[] = {"./paint"};
    EXPECT_FALSE(line.parse(1, nothing).has_value());
}

TEST(CommandLine, RefusesANameThatIsTaken) {
    CommandLine line("", "test");
    std::string a, b;
    line.add_option("-o,--output", a, "");
    EXPECT_THROW(line.add_option("--output", b, ""), std::runtime_error);
}

}  // namespace
}  // namespace velatura
