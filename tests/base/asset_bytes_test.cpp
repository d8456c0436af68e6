// SPDX-License-Identifier: Apache-2.0
#include "base/asset_bytes.h"

#include "folder_test.h"

#include <sys/stat.h>

namespace fs = std::filesystem;

namespace velatura {
namespace {

using AssetBytesTest = FolderTest;

TEST_F(AssetBytesTest, BytesAreThoseOfTheFileAndOutliveItsName) {
    const std::string content("a\0b\n#usda", 9);
    const std::string file = write("x", content);
    const Result<AssetBytesPtr> asset = open_asset_bytes(file);
    ASSERT_TRUE(asset.has_value());
    fs::remove(file);
    EXPECT_EQ((*asset)->bytes(), content);
}

TEST_F(AssetBytesTest, AnEmptyFileHasNoBytes) {
    const Result<AssetBytesPtr> asset = open_asset_bytes(write("empty", ""));
    ASSERT_TRUE(asset.has_value());
    EXPECT_TRUE((*asset)->bytes().empty());
}

TEST_F(AssetBytesTest, WhatIsNoFileIsNamed) {
    EXPECT_EQ(open_asset_bytes((folder_ / "missing").string()).error().code, "file-not-found");
    EXPECT_EQ(open_asset_bytes(folder_.string()).error().code, "file-unreadable");
    const std::string pipe = (folder_ / "pipe").string();
    ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
    EXPECT_EQ(open_asset_bytes(pipe).error().code, "file-unreadable");
}

}  // namespace
}  // namespace velatura
