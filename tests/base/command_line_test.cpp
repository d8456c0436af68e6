// SPDX-License-Identifier: Apache-2.0
#include "base/command_line.h"

#include <gtest/gtest.h>

#include <limits>

namespace velatura {
namespace {

using Words = std::vector<std::string>;

/// The message of the usage error that these arguments cause; empty: none.
std::string rejection(CommandLine& line, const Words& arguments) {
    const std::optional<CommandExit> ended = line.parse(arguments);
    if (!ended) return {};
    EXPECT_EQ(ended->code, 2);
    EXPECT_TRUE(ended->text.starts_with("error: " + ended->message + " [usage]\n  note: `test"))
        << ended->text;
    EXPECT_TRUE(ended->text.ends_with(" --help` lists the options\n")) << ended->text;
    return ended->message;
}

/// What an option of type T holds after these arguments.
template <class T>
T parsed(const Words& arguments, T destination = {}) {
    CommandLine line("", "test");
    line.add_option("-v,--value", destination, "");
    EXPECT_EQ(rejection(line, arguments), "");
    return destination;
}

/// Why an option of type T refuses this value.
template <class T>
std::string refused(const std::string& value) {
    CommandLine line("", "test");
    T destination = {};
    line.add_option("--value", destination, "");
    return rejection(line, {"--value", value});
}

TEST(CommandLine, ParsesEveryTypeOfDestination) {
    EXPECT_EQ(parsed<std::string>({"--value", "a b"}), "a b");
    EXPECT_EQ(parsed<int>({"-v", "-7"}), -7);
    EXPECT_EQ(parsed<uint32_t>({"--value=4294967295"}), 4294967295u);
    EXPECT_EQ(parsed<uint64_t>({"--value", "18446744073709551615"}),
              std::numeric_limits<uint64_t>::max());
    EXPECT_EQ(parsed<float>({"-v0.1"}), 0.1f);
    EXPECT_EQ(parsed<double>({"--value", "1e-3"}), 1e-3);
    EXPECT_EQ(parsed<Words>({"--value", "a", "--value=b"}), (Words{"a", "b"}));
    EXPECT_EQ(parsed<std::vector<int>>({"--value", "1", "-v", "-2"}), (std::vector<int>{1, -2}));
    EXPECT_EQ(parsed<std::vector<uint32_t>>({"-v", "3"}), (std::vector<uint32_t>{3}));
    EXPECT_EQ(parsed<std::vector<double>>({"-v", "0.5", "-v2"}), (std::vector<double>{0.5, 2}));
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
    EXPECT_EQ(refused<int>("3.5"), "--value: expected a whole number, found \"3.5\"");
    EXPECT_EQ(refused<uint64_t>("1e3"),
              "--value: expected a whole number of 0 or more, found \"1e3\"");
    EXPECT_EQ(refused<double>("far"), "--value: expected a finite number, found \"far\"");
    EXPECT_EQ(refused<std::optional<int>>("x"), "--value: expected a whole number, found \"x\"");
}

/// strtoull reads -1 as 2^64 - 1, 010 as 8 and 2^64 as 2^64 - 1; strtod reads nan and inf, which
/// lie in every range that is tested with < and >.
TEST(CommandLine, NumbersAreDecimalFiniteAndFitTheirType) {
    EXPECT_EQ(refused<uint64_t>("-1"),
              "--value: expected a whole number of 0 or more, found \"-1\"");
    EXPECT_EQ(refused<uint64_t>("18446744073709551616"),
              "--value: expected a whole number of at most 18446744073709551615 in size, found "
              "\"18446744073709551616\"");
    for (const char* bad : {"", " 1", "1 ", "+-1", "--1", "0x10", "1,5", "1.", "nan"}) {
        EXPECT_NE(refused<uint64_t>(bad), "") << bad;
        EXPECT_NE(refused<std::optional<uint64_t>>(bad), "") << bad;
        EXPECT_NE(refused<uint32_t>(bad), "") << bad;
        EXPECT_NE(refused<int>(bad), "") << bad;
        EXPECT_NE(refused<std::vector<int>>(bad), "") << bad;
    }
    EXPECT_NE(refused<uint32_t>("4294967296"), "");
    EXPECT_NE(refused<int>("2147483648"), "");
    for (const char* bad : {"", "nan", "-nan", "inf", "-inf", "infinity", "NAN", "1e999", "0x1p3",
                            " 1", "1 ", "+-1", "1,5", "1e"}) {
        EXPECT_NE(refused<float>(bad), "") << bad;
        EXPECT_NE(refused<double>(bad), "") << bad;
        EXPECT_NE(refused<std::optional<double>>(bad), "") << bad;
        EXPECT_NE(refused<std::vector<double>>(bad), "") << bad;
    }
    EXPECT_NE(refused<float>("1e39"), "");
    EXPECT_EQ(parsed<uint64_t>({"--value", "010"}), 10u);
    EXPECT_EQ(parsed<int>({"--value", "+5"}), 5);
    EXPECT_EQ(parsed<int>({"--value", "-08"}), -8);
    EXPECT_EQ(parsed<double>({"--value", "+1.5"}), 1.5);
    EXPECT_EQ(parsed<double>({"--value", "-.5"}), -0.5);
}

TEST(CommandLine, FlagsAreSetOrCounted) {
    CommandLine line("", "test");
    bool quiet = false;
    int verbosity = 9;
    const Option q = line.add_flag("-q,--quiet", quiet, "");
    const Option v = line.add_flag("-v,--verbose", verbosity, "");
    EXPECT_EQ(verbosity, 0);
    EXPECT_EQ(rejection(line, {"-v", "--verbose", "-v"}), "");
    EXPECT_FALSE(quiet);
    EXPECT_EQ(verbosity, 3);
    EXPECT_EQ(q.count(), 0u);
    EXPECT_EQ(v.count(), 3u);
    EXPECT_EQ(rejection(line, {"-q"}), "");
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
        EXPECT_EQ(rejection(line, good), "") << good[0];
    EXPECT_EQ(rejection(line, {"--tile", "0"}), "--tile: expected 1 to 64, found \"0\"");
    EXPECT_EQ(rejection(line, {"--tile", "65"}), "--tile: expected 1 to 64, found \"65\"");
    EXPECT_EQ(rejection(line, {"--tile", "x"}), "--tile: expected a whole number, found \"x\"");
    EXPECT_EQ(rejection(line, {"--spp", "4294967297"}),
              "--spp: expected 1 to 4294967296, found \"4294967297\"");
    EXPECT_EQ(rejection(line, {"--stops", "65"}), "--stops: expected -64 to 64, found \"65\"");
    EXPECT_EQ(rejection(line, {"--memory", "0"}), "--memory: expected 0.1 to 4096, found \"0\"");
    EXPECT_EQ(rejection(line, {"--seed", "-1"}), "--seed: expected 0 or more, found \"-1\"");
}

TEST(CommandLine, OneOfRefusesOtherWords) {
    CommandLine line("", "test");
    std::string mode;
    Words purposes;
    line.add_option("--mode", mode, "").one_of({"tile", "progressive"});
    line.add_option("--purpose", purposes, "").delimiter(',').one_of({"render", "proxy", "guide"});
    EXPECT_EQ(rejection(line, {"--mode", "tile", "--purpose", "guide,,render"}), "");
    EXPECT_EQ(mode, "tile");
    EXPECT_EQ(purposes, (Words{"guide", "render"}));
    EXPECT_EQ(rejection(line, {"--mode", "Tile"}),
              "--mode: expected tile or progressive, found \"Tile\" (did you mean 'tile'?)");
    EXPECT_EQ(rejection(line, {"--purpose", "render,all"}),
              "--purpose: expected render, proxy or guide, found \"all\"");
}

TEST(CommandLine, ChecksSeeEveryValueInOrder) {
    CommandLine line("", "test");
    Words seen;
    line.add_option("--limit", "").expected(1).take_all().check([&](const std::string& value) {
        seen.push_back(value);
        return value.empty() ? std::string("expected NAME=VALUE") : std::string();
    });
    EXPECT_EQ(rejection(line, {"--limit", "b=1", "--limit=a=2"}), "");
    EXPECT_EQ(seen, (Words{"b=1", "a=2"}));
    EXPECT_EQ(rejection(line, {"--limit", "b=1", "--limit", ""}), "--limit: expected NAME=VALUE");
}

TEST(CommandLine, ExistingDirectoryRefusesOthers) {
    CommandLine line("", "test");
    Words folders;
    line.add_option("--search-path", folders, "")
        .existing_directory()
        .take_all()
        .allow_extra_args(false);
    EXPECT_EQ(rejection(line, {"--search-path", "/", "--search-path", "."}), "");
    EXPECT_EQ(folders, (Words{"/", "."}));
    EXPECT_EQ(rejection(line, {"--search-path", "/velatura_no_such_folder"}),
              "--search-path: folder \"/velatura_no_such_folder\" not found");
    EXPECT_EQ(rejection(line, {"--search-path", "/", "."}), "unexpected argument \".\"");
}

TEST(CommandLine, NumbersOfValues) {
    CommandLine line("", "test");
    std::string scene, camera;
    std::vector<int> resolution;
    line.add_option("scene", scene, "").required();
    line.add_option("--camera", camera, "");
    line.add_option("--res", resolution, "").size(100000);
    EXPECT_EQ(rejection(line, {}), "scene is required");
    EXPECT_EQ(rejection(line, {"--res", "640", "480", "a.usda"}), "");
    EXPECT_EQ(scene, "a.usda");
    EXPECT_EQ(resolution, (std::vector<int>{640, 480}));
    EXPECT_EQ(rejection(line, {"a.usda", "--res", "640"}), "--res: expected 2 values, found 1");
    EXPECT_EQ(rejection(line, {"a.usda", "b.usda"}), "unexpected argument \"b.usda\"");
    line.find_option("scene").required(false);
    EXPECT_EQ(rejection(line, {"--camera", "/A"}), "");
}

/// Lists and options of several values, in a group too, leave the positional arguments behind them.
TEST(CommandLine, OptionsMayStandBeforePositionalArguments) {
    for (const Words& typed : {Words{"--res", "64", "48", "--only", "b*", "a.usda", "-o", "x"},
                               Words{"--only", "b*", "--res=64x48", "a.usda", "-o", "x"},
                               Words{"a.usda", "-o", "x", "--res", "64x48", "--only", "b*"},
                               Words{"--res", "64x48", "a.usda", "--only", "b*", "-o", "x"}}) {
        CommandLine line("", "test");
        std::string scene, output;
        std::vector<int> resolution;
        Words only;
        line.add_option("scene", scene, "").required();
        line.add_option("-o", output, "");
        Command what = line.add_group("What");
        what.add_option("--res", resolution, "").expected(2).delimiter('x');
        what.add_option("--only", only, "");
        EXPECT_EQ(rejection(line, typed), "");
        EXPECT_EQ(scene, "a.usda");
        EXPECT_EQ(resolution, (std::vector<int>{64, 48}));
        EXPECT_EQ(only, (Words{"b*"}));
    }
}

/// The value of --name= is empty, not the next word.
TEST(CommandLine, AnEmptyValueIsOne) {
    CommandLine line("", "test");
    std::string time = "before", camera = "before";
    uint64_t spp = 0;
    line.add_option("--time", time, "").not_empty();
    line.add_option("--camera", camera, "");
    line.add_option("--spp", spp, "");
    EXPECT_EQ(rejection(line, {"--camera=", "--spp", "4"}), "");
    EXPECT_EQ(camera, "");
    EXPECT_EQ(spp, 4u);
    for (const Words& typed : {Words{"--time=", "--spp", "4"}, Words{"--time", ""}})
        EXPECT_EQ(rejection(line, typed), "--time: expected a value, found \"\"");
    EXPECT_EQ(rejection(line, {"--spp=", "4"}),
              "--spp: expected a whole number of 0 or more, found \"\"");
}

TEST(CommandLine, TheLastOccurrenceWins) {
    CommandLine line("", "test");
    std::string camera;
    std::optional<uint64_t> spp;
    std::vector<int> resolution;
    Words lists;
    bool quiet = false;
    line.add_option("--camera", camera, "");
    line.add_option("--spp", spp, "");
    line.add_option("--res", resolution, "").expected(2).delimiter('x');
    line.add_option("--limit", lists, "").expected(1).take_all();
    line.add_flag("-q", quiet, "");
    EXPECT_EQ(
        rejection(line, {"--camera", "/A", "--spp", "4", "--res", "64x48", "--limit", "a", "-q",
                         "--camera", "/B", "--spp=8", "--res", "6", "4", "--limit", "b", "-q"}),
        "");
    EXPECT_EQ(camera, "/B");
    EXPECT_EQ(spp, 8u);
    EXPECT_EQ(resolution, (std::vector<int>{6, 4}));
    EXPECT_EQ(lists, (Words{"a", "b"}));
    EXPECT_TRUE(quiet);
}

TEST(CommandLine, NamesWhatAMisspeltWordMayMean) {
    const auto said = [](const Words& typed) {
        CommandLine line("", "test");
        line.require_subcommand();
        std::string scene, secret;
        uint64_t spp = 0;
        std::vector<int> resolution;
        Command render = line.add_subcommand("render", "");
        line.add_subcommand("plan", "");
        render.add_option("scene", scene, "").required();
        Command how = render.add_group("How");
        how.add_option("--spp", spp, "");
        how.add_option("--res", resolution, "").expected(2);
        render.add_option("--secrets", secret, "").hidden();
        return rejection(line, typed);
    };
    EXPECT_EQ(said({"rendr", "a.usda"}), "unknown command 'rendr' (did you mean 'render'?)");
    EXPECT_EQ(said({"zzzzzz"}), "unknown command 'zzzzzz'");
    EXPECT_EQ(said({"render", "--ssp", "4", "a.usda"}),
              "unknown option --ssp (did you mean '--spp'?)");
    EXPECT_EQ(said({"render", "--ssp=4"}), "unknown option --ssp (did you mean '--spp'?)");
    EXPECT_EQ(said({"render", "a.usda", "--rez", "4", "4", "--sppp", "1"}),
              "unknown options --rez (did you mean '--res'?), --sppp (did you mean '--spp'?)");
    EXPECT_EQ(said({"render", "a.usda", "--secret", "x"}), "unknown option --secret");
    EXPECT_EQ(said({"render", "a.usda", "-z"}), "unknown option -z");
    EXPECT_EQ(said({"--spp", "4", "render", "a.usda"}),
              "--spp is an option of render and must follow it: `render --spp ...`");
    EXPECT_EQ(said({"--spp", "4"}),
              "--spp is an option of render and must follow it: `render --spp ...`");
    EXPECT_EQ(said({"--hlep", "4"}), "unknown option --hlep (did you mean '--help'?)");
    EXPECT_EQ(said({"render", "a.usda", "b.usda"}), "unexpected argument \"b.usda\"");
}

/// Options that help does not list are declared, recorded and refused by their names.
TEST(CommandLine, HiddenOptionsKeepTheirNames) {
    uint64_t tile = 0;
    std::vector<int> size;
    std::string names, typed;
    const auto said = [&](const Words& words) {
        CommandLine line("", "test");
        line.add_option("--tile", tile, "").hidden();
        line.add_option("-s,--size", size, "").expected(2).hidden();
        names = typed = {};
        for (const DeclaredOption& option : line.declared_options()) names += option.name + " ";
        const std::string reason = rejection(line, words);
        for (const TypedOption& o : line.typed_options()) typed += o.name + " " + o.value + " ";
        return reason;
    };
    EXPECT_EQ(said({"--tile", "4"}), "");
    EXPECT_EQ(names, "--tile --size ");
    EXPECT_EQ(typed, "--tile 4 ");
    EXPECT_TRUE(said({"--tile", "nan"}).starts_with("--tile: ")) << said({"--tile", "nan"});
    EXPECT_TRUE(said({"-s", "1"}).starts_with("--size: ")) << said({"-s", "1"});
    EXPECT_EQ(said({"--tiles", "4"}), "unknown option --tiles") << "suggests no hidden option";
}

/// Former names work as the present ones, with a note, and are in no help.
TEST(CommandLine, FormerNamesWorkWithANote) {
    bool is_kept = false;
    std::string policy = "error";
    CommandLine line("", "test");
    line.add_flag("-k,--resumable,--keep-sums", is_kept, "Keep").former_name("--keep-sums");
    line.add_option("--missing,--failure", policy, "Policy").former_name("--failure");
    EXPECT_EQ(rejection(line, {"--keep-sums", "--failure=color"}), "");
    EXPECT_TRUE(is_kept);
    EXPECT_EQ(policy, "color");
    EXPECT_NE(line.notes().find("note: --keep-sums is now --resumable [renamed]\n"),
              std::string::npos)
        << line.notes();
    EXPECT_NE(line.notes().find("note: --failure is now --missing [renamed]\n"), std::string::npos);
    EXPECT_EQ(rejection(line, {"-k", "--resumable"}), "");
    EXPECT_EQ(line.notes(), "");
    const std::string help = line.parse({"--help"})->text;
    EXPECT_NE(help.find("  -k, --resumable "), std::string::npos) << help;
    EXPECT_EQ(help.find("keep-sums"), std::string::npos) << help;
    EXPECT_EQ(help.find("failure"), std::string::npos) << help;
}

TEST(CommandLine, ACommandCanBeLeftOut) {
    std::string scene, output, ran;
    const auto said = [&](const Words& typed) {
        scene = output = ran = {};
        CommandLine line("", "test");
        line.add_version_flag("1");
        line.require_subcommand();
        for (const char* const name : {"render", "info"}) {
            Command command = line.add_subcommand(name, "");
            command.add_option("scene", scene, "").required();
            command.add_option("-o", output, "");
            command.callback([&ran, name] { ran = name; });
        }
        line.set_default_subcommand(
            "render", [](const std::string& word) { return word.ends_with(".usda"); });
        return rejection(line, typed);
    };
    EXPECT_EQ(said({"a.usda", "-o", "info"}), "");
    EXPECT_EQ(ran + " " + scene + " " + output, "render a.usda info");
    EXPECT_EQ(said({"-o", "x.exr", "a.usda"}), "");
    EXPECT_EQ(ran + " " + scene + " " + output, "render a.usda x.exr");
    EXPECT_EQ(said({"info", "a.usda"}), "");
    EXPECT_EQ(ran, "info");
    EXPECT_EQ(said({"rendr", "a.usda"}), "unknown command 'rendr' (did you mean 'render'?)");
    EXPECT_EQ(said({"a.exr"}), "unknown command 'a.exr'");
    EXPECT_EQ(said({}), "no command given; expected one of render, info");
}

TEST(CommandLine, NeedsAndExcludes) {
    CommandLine line("", "test");
    bool prove = false, quiet = false, json = false;
    std::string scene;
    const Option needed = line.add_flag("--prove", prove, "");
    line.add_option("--scene", scene, "").needs(needed);
    const Option other = line.add_flag("--quiet", quiet, "");
    line.add_flag("--json", json, "").excludes(other);
    EXPECT_EQ(rejection(line, {"--prove"}), "");
    EXPECT_EQ(rejection(line, {"--scene", "a.usda", "--prove", "--json"}), "");
    EXPECT_EQ(rejection(line, {"--scene", "a.usda"}), "--scene requires --prove");
    EXPECT_EQ(rejection(line, {"--json", "--quiet"}), "--quiet excludes --json");
}

TEST(CommandLine, GroupsLimitTheNumberOfTheirOptions) {
    CommandLine line("", "test");
    double spp = 0, factor = 0;
    Command how = line.add_group("How far");
    how.add_option("--spp", spp, "");
    how.add_option("--factor", factor, "");
    how.require_options(0, 1);
    EXPECT_EQ(rejection(line, {}), "");
    EXPECT_EQ(rejection(line, {"--factor", "2"}), "");
    EXPECT_EQ(rejection(line, {"--factor", "2", "--spp", "4"}),
              "only one of these options can be given: --spp,--factor");
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
    EXPECT_EQ(
        rejection(line, {"--gain", "key=2", "-m", "sky", "a.exr", "--lenient", "--gain=b1=0"}), "");
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
    EXPECT_EQ(rejection(line, {"info", "a.exr"}), "");
    EXPECT_EQ(called, "info a.exr");
    EXPECT_EQ(rejection(line, {}), "no command given; expected one of info, mix");
    EXPECT_EQ(rejection(line, {"info"}), "file is required");
    EXPECT_EQ(rejection(line, {"paint"}), "unknown command 'paint'");
    EXPECT_EQ(rejection(line, {"mix", "paint"}), "unexpected argument \"paint\"");
    EXPECT_EQ(called, "info a.exr");
}

/// A former spelling, before the checks and the value itself.
TEST(CommandLine, SynonymsAreTakenForTheirMeaning) {
    CommandLine line("", "test");
    std::string failure = "error";
    line.add_option("--failure", failure, "").one_of({"color", "error"}).synonym("colour", "color");
    EXPECT_EQ(rejection(line, {"--failure", "colour"}), "");
    EXPECT_EQ(failure, "color");
    EXPECT_EQ(rejection(line, {"--failure", "colours"}),
              "--failure: expected color or error, found \"colours\" (did you mean 'color'?)");
}

namespace {

/// Types, defaults, a placeholder, groups, a hidden option, a subcommand, an example, a footer.
std::string help_of_a_program(const Words& arguments, bool has_common) {
    CommandLine line("Renders.", "paint");
    line.add_version_flag("paint 1.2");
    std::string scene, mode = "tile", secret;
    int tile = 32;
    double memory = 0.5;
    std::vector<int> resolution;
    Words casters;
    bool quiet = false;
    line.add_option("scene", scene, "USD scene").required();
    Option of_tile = line.add_option("--tile", tile, "Pixels").range(1, 64);
    Option res = line.add_option("--res", resolution, "width and height");
    res.size(100).default_text("that of the scene").description("Size");
    line.add_option("--secret", secret, "").hidden();
    Command how = line.add_group("How");
    how.add_option("-m,--mode", mode, "Order of pixels").one_of({"tile", "progressive"});
    how.add_flag("-q,--quiet", quiet, "Print errors only").needs(res);
    how.add_option("--caster", casters, "Shadow casters").type_name("PATTERN").excludes(of_tile);
    how.add_option("--memory", memory,
                   "Memory that is described by a text that is too long for one line of a page")
        .range(0.1, 4096.0);
    line.add_subcommand("info", "What a file holds");
    line.example("paint a.usda");
    line.footer("Exit codes: 0 done.");
    if (has_common) of_tile.common();
    const std::optional<CommandExit> help = line.parse(arguments);
    if (!help) return {};
    EXPECT_EQ(help->code, 0);
    EXPECT_EQ(help->message, "");
    return help->text;
}

}  // namespace

TEST(CommandLine, HelpIsThisText) {
    const std::string text = R"(Renders.

Usage: paint [OPTIONS] scene COMMAND

Arguments:
  scene                       USD scene

Options:
  --tile N                    Pixels [default: 32; 1 to 64; not with --caster]
  --res W H                   Size [default: that of the scene; 1 to 100]

How:
  -m, --mode {tile,progressive}
                              Order of pixels [default: tile]
  -q, --quiet                 Print errors only [needs --res]
  --caster PATTERN            Shadow casters [repeatable; not with --tile]
  --memory X                  Memory that is described by a text that is too long for one
                              line of a page [default: 0.5; 0.1 to 4096]

Help:
  -h, --help                  Print the help
  --help-all                  Print the help of every option
  --version                   Print the version

Commands:
  info                        What a file holds

Example:
  paint a.usda

Exit codes: 0 done.
)";
    EXPECT_EQ(help_of_a_program({"--help"}, false), text);
    EXPECT_EQ(help_of_a_program({"--help-all"}, false), text);
    EXPECT_EQ(help_of_a_program({"--help-all"}, true), text);
}

TEST(CommandLine, HelpListsTheCommonOptions) {
    EXPECT_EQ(help_of_a_program({"-h"}, true), R"(Renders.

Usage: paint [OPTIONS] scene COMMAND

Arguments:
  scene                       USD scene

Options:
  --tile N                    Pixels [default: 32; 1 to 64; not with --caster]

Help:
  -h, --help                  Print the help
  --help-all                  Print the help of every option
  --version                   Print the version

Commands:
  info                        What a file holds

5 more options: paint --help-all

Example:
  paint a.usda

Exit codes: 0 done.
)");
}

TEST(CommandLine, FindsTheHelpOfACommand) {
    CommandLine line("", "test");
    line.add_subcommand("info", "What a file holds");
    line.add_subcommand("old", "").hidden();
    ASSERT_TRUE(line.help_of("info").has_value());
    EXPECT_TRUE(
        line.help_of("info")->starts_with("What a file holds\n\nUsage: test info [OPTIONS]"))
        << *line.help_of("info");
    EXPECT_FALSE(line.help_of("old").has_value());
    EXPECT_FALSE(line.help_of("inof").has_value());
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
    EXPECT_NE(line.parse(2, help)->text.find("Usage: paint [OPTIONS]\n"), std::string::npos);

    const char* const wrong[] = {"./paint", "--colour"};
    const std::optional<CommandExit> error = line.parse(2, wrong);
    ASSERT_TRUE(error.has_value());
    EXPECT_EQ(error->code, 2);
    EXPECT_EQ(error->text,
              "error: unknown option --colour [usage]\n"
              "  note: `paint --help` lists the options\n");

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
