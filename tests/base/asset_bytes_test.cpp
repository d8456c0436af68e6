// SPDX-License-Identifier: Apache-2.0
#include "base/asset_bytes.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>

namespace fs = std::filesystem;

namespace velatura {
namespace {

class AssetBytesTest : public testing::Test {
  protected:
    void SetUp() override {
        folder_ = fs::path(testing::TempDir()) /
                  ("asset_bytes_" +
                   std::string(testing::UnitTest::GetInstance()->current_test_info()->name()));
        fs::create_directories(folder_);
    }

    void TearDown() override { fs::remove_all(folder_); }

    std::string write(const std::string& name, const std::string& content) {
        const std::string file = (folder_ / name).string();
        std::ofstream(file, std::ios::binary) << content;
        return file;
    }

    fs::path folder_;
};

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
