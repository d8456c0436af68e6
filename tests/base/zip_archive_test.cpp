// SPDX-License-Identifier: Apache-2.0
#include "base/zip_archive.h"

#include "base/package_path.h"
#include "folder_test.h"
#include "stored_zip.h"

#include <gtest/gtest.h>

namespace fs = std::filesystem;

namespace velatura {
namespace {

using testing::stored_zip;

Result<std::shared_ptr<const ZipArchive>> open_zip(std::string bytes) {
    return ZipArchive::open(make_asset_bytes(std::move(bytes)), "x.usdz");
}

/// What is wrong with an archive, or with its first file.
std::string fault(std::string bytes) {
    const auto archive = open_zip(std::move(bytes));
    if (!archive) return archive.error().code;
    if ((*archive)->members().empty()) return "empty";
    const auto data = (*archive)->read((*archive)->members()[0]);
    return data ? "none" : data.error().code;
}

TEST(ZipArchive, MembersComeInTheOrderOfTheirBytes) {
    const auto archive =
        open_zip(stored_zip({{"root.usda", "#usda 1.0"}, {"dir/", ""}, {"dir/a.png", "png"}}));
    ASSERT_TRUE(archive.has_value());
    ASSERT_EQ((*archive)->members().size(), 2u);
    EXPECT_EQ((*archive)->members()[0].name, "root.usda");
    EXPECT_EQ((*archive)->find("dir/"), nullptr);
    const ZipMember* a = (*archive)->find("dir/a.png");
    ASSERT_NE(a, nullptr);
    EXPECT_EQ((*archive)->data_offset(*a) % 64, 0u);
    EXPECT_EQ((*(*archive)->read(*a))->bytes(), "png");
}

TEST(ZipArchive, CommentsAndOddOffsetsAreRead) {
    EXPECT_EQ(fault(stored_zip({{"a", "data"}}, 1, "a comment PK\x05\x06")), "none");
    EXPECT_EQ(fault(stored_zip({})), "empty");
}

TEST(ZipArchive, WhatIsNotStoredPlainlyIsRefusedWithItsReason) {
    EXPECT_EQ(fault(stored_zip({{"a", "data", 8, 0}})), "zip-unsupported");
    EXPECT_EQ(fault(stored_zip({{"a", "data", 0, 1}})), "zip-unsupported");
    std::string zip64 = stored_zip({{"a", "data"}});
    zip64.replace(zip64.size() - 6, 4, "\xff\xff\xff\xff");
    EXPECT_EQ(fault(zip64), "zip-unsupported");
    std::string split = stored_zip({{"a", "data"}});
    split[split.size() - 18] = 1;
    EXPECT_EQ(fault(split), "zip-unsupported");
}

TEST(ZipArchive, BrokenArchivesAreRefused) {
    const std::string good = stored_zip({{"a", "data"}, {"b", "more"}});
    EXPECT_EQ(fault(good), "none");
    EXPECT_EQ(fault(""), "zip-malformed");
    for (size_t size = 0; size < good.size(); ++size) {
        EXPECT_EQ(fault(good.substr(0, size)), "zip-malformed") << size;
    }
    EXPECT_EQ(fault(stored_zip({{"a", "data"}, {"a", "more"}})), "zip-malformed");
    // A size that runs into the next member
    std::string overlap = good;
    const size_t directory = overlap.find("PK\x01\x02");
    overlap[directory + 20] = overlap[directory + 24] = 120;
    EXPECT_EQ(fault(overlap), "zip-malformed");
    // Another name in the local header
    std::string renamed = good;
    renamed[30] = 'x';
    EXPECT_EQ(fault(renamed), "zip-malformed");
}

/// Of the kinds of zip bombs, packages have no compression to begin with (see above).
TEST(ZipArchive, BombsAreRefused) {
    const std::string good = stored_zip({{"a", "data"}, {"b", "more"}});
    const size_t directory = good.find("PK\x01\x02"), second = good.rfind("PK\x01\x02");
    ASSERT_NE(directory, second);
    // Sizes beyond the file, in the directory and where the file begins
    std::string huge = good;
    for (const size_t at : {directory + 20, directory + 24, size_t(18), size_t(22)})
        huge.replace(at, 4, "\xf0\xff\xff\xff", 4);
    EXPECT_EQ(fault(huge), "zip-malformed");
    // Two names for the same bytes, as in D. Fifield, A Better Zip Bomb (2019)
    std::string twice = good;
    twice.replace(second + 42, 4, good.substr(directory + 42, 4));
    EXPECT_EQ(fault(twice), "zip-malformed");
    // More files than there are bytes for
    std::string many = good;
    many.replace(many.size() - 14, 4, "\xfe\xff\xfe\xff", 4);
    EXPECT_EQ(fault(many), "zip-malformed");
}

TEST(PackagePath, PartsAndNamesAreInverse) {
    using Parts = std::vector<std::string>;
    EXPECT_EQ(split_package_path("dir[1]/a.usdz"), Parts{"dir[1]/a.usdz"});
    EXPECT_EQ(split_package_path("a.usdz[b.png]"), (Parts{"a.usdz", "b.png"}));
    EXPECT_EQ(split_package_path("a.usdz[b.usdz[c.usda]]"), (Parts{"a.usdz", "b.usdz", "c.usda"}));
    EXPECT_EQ(split_package_path("a.usdz[b\\[1\\].png]"), (Parts{"a.usdz", "b[1].png"}));
    EXPECT_FALSE(is_package_path("a.usdz"));
    EXPECT_FALSE(is_package_path("a]"));
    for (const Parts& parts : {Parts{"a[1]", "b[2]", "]c["}, Parts{"a"}, Parts{"a", ""}}) {
        EXPECT_EQ(split_package_path(join_package_path(parts)), parts);
    }
    const std::string deep = std::string(100000, '[') + std::string(100000, ']');
    EXPECT_EQ(split_package_path(deep).size(), max_package_depth + 2);
}

using PackageBytesTest = FolderTest;

TEST_F(PackageBytesTest, NamesReachIntoPackagesOfPackages) {
    const std::string inner = stored_zip({{"c.usda", "#usda 1.0"}});
    const std::string file = write("a.usdz", stored_zip({{"x[1].png", "png"}, {"b.usdz", inner}}));
    EXPECT_EQ((*open_asset_bytes(file + "[x\\[1\\].png]"))->bytes(), "png");
    EXPECT_EQ((*open_asset_bytes(file + "[b.usdz[c.usda]]"))->bytes(), "#usda 1.0");
    EXPECT_TRUE(asset_exists(file + "[b.usdz[c.usda]]"));
    EXPECT_FALSE(asset_exists(file + "[b.usdz[d.usda]]"));
    EXPECT_FALSE(asset_exists(file + "[b.usdz][c.usda]"));
    EXPECT_EQ(open_asset_bytes(file + "[d.usda]").error().code, "file-not-found");
    EXPECT_EQ(open_asset_bytes(file + "[x\\[1\\].png[d.usda]]").error().code, "zip-malformed");
    EXPECT_EQ(open_asset_bytes(folder_.string() + "/none.usdz[d]").error().code, "file-not-found");
}

TEST_F(PackageBytesTest, AFileOfThatVeryNameComesFirst) {
    write("a.usdz", stored_zip({{"b", "member"}}));
    const std::string file = write("a.usdz[b]", "file");
    EXPECT_EQ((*open_asset_bytes(file))->bytes(), "file");
}

TEST_F(PackageBytesTest, AChangedPackageIsReadAnew) {
    const std::string file = write("a.usdz", stored_zip({{"b", "old"}}));
    const AssetBytesPtr old = *open_asset_bytes(file + "[b]");
    fs::remove(file);
    write("a.usdz", stored_zip({{"b", "newer"}}));
    EXPECT_EQ((*open_asset_bytes(file + "[b]"))->bytes(), "newer");
    EXPECT_EQ(old->bytes(), "old");
}

TEST_F(PackageBytesTest, DepthIsLimited) {
    std::string zip = stored_zip({{"p", "data"}});
    std::vector<std::string> parts = {"p"};
    for (size_t i = 0; i < max_package_depth + 4; ++i) {
        zip = stored_zip({{"p", zip}});
        parts.insert(parts.begin(), "p");
    }
    parts.insert(parts.begin(), write("deep.usdz", zip));
    EXPECT_EQ(open_asset_bytes(join_package_path(parts)).error().code, "package-depth");
}

}  // namespace
}  // namespace velatura
