// SPDX-License-Identifier: Apache-2.0
// Names of many files, from the outside: what commands read and write.
#include "compositor/outcome.h"
#include "film/film.h"
#include "film/film_scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

namespace velatura::compositor::cli {
namespace {

namespace fs = std::filesystem;

class Names : public testing::Test {
  protected:
    static void SetUpTestSuite() {
        film::LayerSet set = film::test_layer_set();
        set.matrix_layers = set.halves = true;
        film::Film film({0, 0, 8, 8}, set);
        film::render(film, 0, 4);
        film::FileInfo info;
        info.store_sums = true;
        ASSERT_TRUE(film.write(source(), info).has_value());
    }

    void SetUp() override {
        fs::remove_all(folder_);
        fs::create_directories(folder_);
    }

    void TearDown() override { fs::remove_all(folder_); }

    static std::string source() { return film::temporary_file("names_source.exr"); }

    /// Inside the folder.
    Outcome comp(const std::string& arguments) const {
        return run("cd '" + folder_ + "' && " VELATURA_BIN_DIR "/velatura-comp " + arguments);
    }

    void copy(const std::string& name) const {
        const fs::path file = fs::path(folder_) / name;
        fs::create_directories(file.parent_path());
        fs::copy_file(source(), file, fs::copy_options::overwrite_existing);
    }

    /// Of a folder in it, with those of its folders.
    std::set<std::string> files_in(const std::string& name) const {
        std::set<std::string> files;
        const fs::path folder = fs::path(folder_) / name;
        std::error_code failed;
        for (const auto& file : fs::recursive_directory_iterator(folder, failed))
            if (file.is_regular_file()) files.insert(file.path().lexically_relative(folder));
        return files;
    }

    std::string folder_ = film::temporary_file("names");
};

/// 30 names, the files that are there, and those that a mix of each writes into a new folder: what
/// printf writes for %0Nd, where frames are -1, 8 and 12345.
TEST_F(Names, AMixOfEachWritesTheSameNames) {
    using Files = std::set<std::string>;
    const Files shot = {"s.-001.exr", "s.0008.exr", "s.12345.exr"}, bare = {"s.-1.exr", "s.8.exr"};

    struct Row {
        const char* name;
        Files files;
    };

    for (const Row& row :
         std::vector<Row>{{"s.####.exr", shot},
                          {"s.%04d.exr", shot},
                          {"s.%4d.exr", shot},
                          {"s.$F4.exr", shot},
                          {"s.<F4>.exr", shot},
                          {"s.#.exr", bare},
                          {"s.%d.exr", bare},
                          {"s.%01d.exr", bare},
                          {"s.$F.exr", bare},
                          {"s.<F>.exr", bare},
                          {"####.exr", {"-001.exr", "0008.exr"}},
                          {"s#.exr", {"s-1.exr", "s8.exr"}},
                          {"s_######.exr", {"s_-00001.exr", "s_000008.exr"}},
                          {"s_%06d_v2.exr", {"s_-00001_v2.exr", "s_000008_v2.exr"}},
                          {"take#2.####.exr", {"take#2.-001.exr", "take#2.0008.exr"}},
                          {"50%done.####.exr", {"50%done.0008.exr", "50%done.0009.exr"}},
                          {"a#_##.exr", {"a#_-1.exr", "a#_08.exr"}},
                          {"it's.####.exr", {"it's.0008.exr"}},
                          {"a b.$F4.exr", {"a b.0008.exr", "a b.0010.exr"}},
                          {"####/s.####.exr", {"-001/s.-001.exr", "0008/s.0008.exr"}},
                          {"f.$F4/s.exr", {"f.-001/s.exr", "f.0008/s.exr"}},
                          {"v#2/s.##.exr", {"v#2/s.08.exr", "v#2/s.123.exr"}},
                          // Files that only look like patterns, and are there
                          {"take#2.exr", {"take#2.exr"}},
                          {"50%done.exr", {"50%done.exr"}},
                          {"C#.exr", {"C#.exr"}},
                          {"100%d.exr", {"100%d.exr"}},
                          {"$F.exr", {"$F.exr"}},
                          {"s.####.exr", {"s.####.exr"}},
                          {"a%20d.exr", {"a%20d.exr"}},
                          {"<F>.exr", {"<F>.exr"}}}) {
        SetUp();
        for (const std::string& file : row.files) copy(file);
        std::string quoted = row.name;
        for (size_t at = quoted.find('\''); at != std::string::npos; at = quoted.find('\'', at + 4))
            quoted.replace(at, 1, "'\\''");
        const std::string mix = "mix -q '" + quoted + "' -o ";
        // A name of one file that looks like a pattern is one where it is there
        for (const std::string& file : row.files)
            if (file == row.name) copy("out/" + file);
        const Outcome outcome = comp(mix + "'out/" + quoted + "'");
        EXPECT_EQ(outcome.code, 0) << row.name << ": " << outcome.output;
        EXPECT_EQ(files_in("out"), row.files) << row.name;
    }
}

TEST_F(Names, ASequenceNeedsASequenceToBeWritten) {
    copy("s.0008.exr");
    for (const char* command : {"mix", "denoise", "noise", "view"}) {
        const std::string end = command == std::string("view") ? ".png" : ".exr";
        const Outcome outcome = comp(std::string(command) + " 's.####.exr' -o one" + end);
        EXPECT_EQ(outcome.code, 2) << command << ": " << outcome.output;
        EXPECT_NE(outcome.output.find("one" + end + " is one file and s.####.exr a sequence"),
                  std::string::npos)
            << outcome.output;
    }
    EXPECT_EQ(files_in("."), std::set<std::string>{"s.0008.exr"});
}

TEST_F(Names, EveryCommandTakesASequenceAndMakesFolders) {
    for (const char* file : {"s.-001.exr", "s.0002.exr", "s.0004.exr"}) copy(file);

    struct Row {
        const char *command, *output;
    };

    for (const Row& row : std::vector<Row>{{"denoise 's.$F4.exr' -o", ".exr"},
                                           {"noise 's.####.exr' -o", ".exr"},
                                           {"noise --json 's.####.exr' -o", ".png"},
                                           {"diff 's.%04d.exr' s.0002.exr -o", ".exr"},
                                           {"view --layers rgba 's.<F4>.exr' -o", ".png"},
                                           {"merge 's.####.exr' -o", ".exr"},
                                           {"mix 's.####.exr' -o", ".png"}}) {
        fs::remove_all(folder_ + "/new");
        const std::string end = row.output;
        const Outcome outcome = comp(std::string(row.command) + " 'new/deep/o.%04d" + end + "'");
        if (end == ".png" && outcome.output.find("plugin") != std::string::npos) continue;
        EXPECT_EQ(outcome.code, 0) << row.command << ": " << outcome.output;
        EXPECT_EQ(files_in("new/deep"),
                  (std::set<std::string>{"o.-001" + end, "o.0002" + end, "o.0004" + end}))
            << row.command;
    }
    // One that is missing is told, and the others are done
    const Outcome gap = comp("diff 's.%04d.exr' s.0002.exr -o 'gap/o.####.exr' --frames 2-4");
    EXPECT_EQ(gap.code, 1) << gap.output;
    EXPECT_NE(gap.output.find("frame 3: s.0003.exr not found"), std::string::npos) << gap.output;
    EXPECT_EQ(files_in("gap"), (std::set<std::string>{"o.0002.exr", "o.0004.exr"}));
    EXPECT_EQ(comp("info 's.####.exr' --frames -1,4").code, 0);
    EXPECT_EQ(comp("verify -q 's.####.exr'").code, 0);
    EXPECT_EQ(comp("verify -q 'none.####.exr'").code, 1);
    // One frame, with its number where the output wants one
    EXPECT_EQ(comp("denoise s.-001.exr -o 'one/d.####.exr'").code, 0);
    EXPECT_EQ(files_in("one"), std::set<std::string>{"d.-001.exr"});
    for (const char* program : {"oiio", "nuke", "blender"}) {
        EXPECT_EQ(
            comp(std::string("export ") + program + " 's.$F4.exr' -o scripts/" + program).code, 0)
            << program;
        EXPECT_EQ(comp(std::string("export ") + program + " s.0002.exr --file 's.####.exr'").code,
                  0);
    }
    EXPECT_EQ(files_in("scripts").size(), 3u);
    EXPECT_EQ(comp("bake 's.####.exr' -o b.usda").code, 2);
    // The film of a test has no lights to bake
    const Outcome bake = comp("bake 's.####.exr' --frame 2 -o b/b.usda");
    EXPECT_NE(bake.output.find("[no-light-values]"), std::string::npos) << bake.output;
    EXPECT_EQ(comp("ui 's.####.exr' --frame 3").code, 1);
}

/// By whatever name, the file stays as it was; an image that is called like the EXR too.
TEST_F(Names, CommandsLeaveTheirInputsAlone) {
    copy("s.0001.exr");
    fs::create_hard_link(folder_ + "/s.0001.exr", folder_ + "/hard.exr");
    fs::create_symlink("s.0001.exr", folder_ + "/soft.png");
    fs::create_symlink("s.0001.exr", folder_ + "/soft.usda");
    const std::string hash = comp("info --hash s.0001.exr").output;
    for (const char* command :
         {"mix s.0001.exr -o hard.exr", "mix 's.####.exr' -o 's.$F4.exr'",
          "mix s.0001.exr -o 's.####.exr'", "mix s.0001.exr -o soft.png",
          "noise s.0001.exr -o s.0001.exr", "noise s.0001.exr -o soft.png",
          "diff s.0001.exr s.0001.exr -o hard.exr", "denoise s.0001.exr -o ./s.0001.exr",
          "merge s.0001.exr -o hard.exr", "view s.0001.exr -o soft.png",
          "bake hard.exr -o soft.usda", "export oiio hard.exr -o s.0001.exr",
          "mix --gain key=2 --matte soft.png:A none.exr -o soft.png"}) {
        const Outcome outcome = comp(command);
        EXPECT_NE(outcome.code, 0) << command << ": " << outcome.output;
        EXPECT_EQ(comp("info --hash s.0001.exr").output, hash) << command;
    }
    // A matte, which is found while it is read
    copy("other.exr");
    const Outcome matte = comp("mix other.exr --gain key=2 --matte hard.exr:A -o s.0001.exr");
    EXPECT_EQ(matte.code, 2) << matte.output;
    EXPECT_NE(matte.output.find("s.0001.exr is the input hard.exr"), std::string::npos)
        << matte.output;
    EXPECT_EQ(comp("info --hash hard.exr").output, hash);
    EXPECT_EQ(comp("mix --gain all=0 s.0001.exr -o s.0001.exr --overwrite-input").code, 0);
    EXPECT_NE(comp("info --hash s.0001.exr").output, hash);
}

}  // namespace
}  // namespace velatura::compositor::cli
