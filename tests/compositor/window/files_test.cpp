// SPDX-License-Identifier: Apache-2.0
#include "base/atomic_file.h"
#include "compositor/window/folder_list.h"
#include "compositor/window/recent_files.h"
#include "film/film_scene.h"

#include <gtest/gtest.h>

#include <filesystem>

namespace velatura::compositor::window {
namespace {

namespace fs = std::filesystem;

TEST(RecentFiles, TheNewestComesFirstAndStays) {
    const std::string list = film::temporary_file("state/velatura/recent");
    {
        RecentFiles recent(list);
        for (int i = 0; i < 14; ++i) recent.add("/shots/" + std::to_string(i) + ".exr");
        recent.add("/shots/7.exr");
    }
    const RecentFiles recent(list);
    ASSERT_EQ(recent.paths().size(), 10u);
    EXPECT_EQ(recent.paths()[0], "/shots/7.exr");
    EXPECT_EQ(recent.paths()[1], "/shots/13.exr");
    EXPECT_EQ(std::count(recent.paths().begin(), recent.paths().end(), "/shots/7.exr"), 1);
}

TEST(RecentFiles, PathsBecomeAbsolute) {
    RecentFiles recent("");
    recent.add("a.exr");
    EXPECT_TRUE(fs::path(recent.paths()[0]).is_absolute());
}

TEST(RecentFiles, AListThatCannotBeWrittenIsNoHarm) {
    RecentFiles recent("/proc/no/such/list");
    recent.add("/a.exr");
    EXPECT_EQ(recent.paths().size(), 1u);
}

TEST(FolderList, HoldsFoldersAndFilesOfTheKind) {
    const fs::path folder = film::temporary_file("listed");
    fs::create_directories(folder / "sub");
    fs::create_directories(folder / ".hidden");
    for (const char* name : {"b.exr", "a.exr", "c.png"})
        ASSERT_TRUE(write_file_atomically((folder / name).string(), "x").has_value());
    const FolderList list = list_folder(folder.string(), ".exr");
    EXPECT_EQ(list.folders, std::vector<std::string>{"sub"});
    EXPECT_EQ(list.files, (std::vector<std::string>{"a.exr", "b.exr"}));
    EXPECT_TRUE(list_folder((folder / "missing").string(), ".exr").files.empty());
}

TEST(FolderList, APathThatNoFileSystemTakesIsNoFolder) {
    const fs::path folder = film::temporary_file("folder");
    fs::create_directories(folder / "closed");
    EXPECT_TRUE(is_folder(folder.string()));
    EXPECT_FALSE(is_folder((folder / std::string(300, 'x')).string()));
    EXPECT_FALSE(is_folder((folder / "missing").string()));
    // Nobody may look into it (but root, who runs these tests too)
    fs::permissions(folder / "closed", fs::perms::none);
    EXPECT_FALSE(is_folder((folder / "closed/inner").string()));
    fs::permissions(folder / "closed", fs::perms::owner_all);
}

TEST(FolderList, PathsAreSeenFromTheFolder) {
    EXPECT_EQ(path_in("/a/b", "c.exr"), "/a/b/c.exr");
    EXPECT_EQ(path_in("/a/b", "../c.exr"), "/a/c.exr");
    EXPECT_EQ(path_in("/a/b", "/c.exr"), "/c.exr");
    EXPECT_EQ(with_extension("look", ".json"), "look.json");
    EXPECT_EQ(with_extension("look.js", ".json"), "look.js");
}

}  // namespace
}  // namespace velatura::compositor::window
