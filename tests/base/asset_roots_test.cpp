// SPDX-License-Identifier: Apache-2.0
#include "base/asset_roots.h"

#include "base/asset_bytes.h"
#include "folder_test.h"
#include "stored_zip.h"

#include <fcntl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

#include <atomic>
#include <climits>
#include <cstdio>
#include <cstring>
#include <thread>

namespace fs = std::filesystem;

namespace velatura {
namespace {

class AssetRootsTest : public FolderTest {
  protected:
    void SetUp() override {
        FolderTest::SetUp();
        fs::create_directories(folder_ / "in/sub");
        fs::create_directories(folder_ / "out");
        write("in/a", "inside");
        write("in/sub/b", "deeper");
        write("out/a", "secret");
        write("in[1]", "brackets");
        roots_ = AssetRoots::beneath({in("")});
    }

    std::string in(const std::string& name) const { return (folder_ / "in" / name).string(); }

    std::string out(const std::string& name) const { return (folder_ / "out" / name).string(); }

    /// Code of the error, empty when the file opens.
    std::string error_of(const std::string& name) const {
        const Result<FileDescriptor> opened = roots_.open(name);
        const Result<std::string> admitted = roots_.admit(name);
        EXPECT_EQ(opened.has_value(), admitted.has_value()) << name;
        return opened ? "" : opened.error().code;
    }

    AssetRoots roots_;
};

TEST_F(AssetRootsTest, FilesBeneathTheFoldersOpenHoweverTheyAreSpelled) {
    EXPECT_EQ(error_of(in("a")), "");
    EXPECT_EQ(error_of(in("sub/b")), "");
    EXPECT_EQ(error_of(in("sub/../a")), "");
    EXPECT_EQ(error_of(out("../in/./sub/../a")), "");
    fs::create_symlink("../a", in("sub/link"));
    fs::create_directory_symlink("sub", in("folder"));
    fs::create_symlink(in("a"), out("back"));
    EXPECT_EQ(error_of(in("sub/link")), "");
    EXPECT_EQ(error_of(in("folder/b")), "");
    EXPECT_EQ(error_of(out("back")), "") << "where the link lies is no matter";
    EXPECT_EQ(*roots_.admit(in("folder/b")), fs::canonical(in("sub/b")));
}

TEST_F(AssetRootsTest, FilesElsewhereAreRefusedWhetherTheyAreThereOrNot) {
    fs::create_symlink("../out/a", in("link"));
    fs::create_symlink("link", in("chain"));
    fs::create_symlink(out("a"), in("sub/absolute"));
    fs::create_directory_symlink("../out", in("folder"));
    fs::create_symlink("/proc/self", in("self"));
    for (const std::string& name :
         {out("a"), out("none"), in("../out/a"), in("sub/../../out/a"), in("link"), in("chain"),
          in("sub/absolute"), in("folder/a"), in("folder/../out/a"), in("self/mem"),
          std::string("/proc/self/mem"), std::string("/dev/zero"), std::string("/"),
          folder_.string() + "/in2", "/proc/self/root" + out("a")}) {
        EXPECT_EQ(error_of(name), "asset-outside-roots") << name;
    }
    const std::string message = roots_.open(in("chain")).error().message;
    EXPECT_NE(message.find("chain\" is \"" + fs::canonical(out("a")).string()), std::string::npos)
        << message;
    EXPECT_NE(message.find("--asset-root"), std::string::npos);
    EXPECT_EQ(error_of(in("none")), "file-not-found");
    EXPECT_EQ(error_of(in("a/none")), "file-not-found");
}

TEST_F(AssetRootsTest, OnlyRegularFilesOpen) {
    ASSERT_EQ(::mkfifo(in("pipe").c_str(), 0600), 0);
    const int listener = ::socket(AF_UNIX, SOCK_STREAM, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    ASSERT_LT(in("s").size(), sizeof address.sun_path);
    std::strcpy(address.sun_path, in("s").c_str());
    ASSERT_EQ(::bind(listener, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    for (const AssetRoots& roots : {roots_, AssetRoots()}) {
        EXPECT_EQ(roots.open(in("sub")).error().message,
                  "\"" + in("sub") + "\" is a folder, expected a regular file");
        EXPECT_NE(roots.open(in("pipe")).error().message.find("is a pipe"), std::string::npos);
        EXPECT_NE(roots.open(in("s")).error().message.find("is a socket"), std::string::npos);
    }
    ::close(listener);
    EXPECT_NE(AssetRoots().open("/dev/zero").error().message.find("is a device"),
              std::string::npos);
}

TEST_F(AssetRootsTest, WhatHasNoBytesIsNotAdmitted) {
    write("in/empty", "");
    EXPECT_TRUE(roots_.open(in("empty")).has_value());
    EXPECT_EQ(roots_.admit(in("empty")).error().code, "file-unreadable");
    EXPECT_EQ(AssetRoots().admit("/proc/self/mem").error().code, "file-unreadable");
}

TEST_F(AssetRootsTest, NamesThatAreNoFilesAreRefusedEverywhere) {
    const std::string zero = in("a") + std::string(1, '\0') + ".png";
    for (const AssetRoots& roots : {roots_, AssetRoots()}) {
        for (const std::string& name :
             {std::string("http://host/a"), std::string("file:///a"), std::string("file:a"),
              std::string("data:text/plain,x"), std::string("s3+x://a/b"), std::string("//host/a"),
              std::string("\\\\host\\a"), zero, std::string(PATH_MAX, 'a')}) {
            EXPECT_EQ(roots.open(name).error().code, "asset-name") << name;
        }
    }
    // A colon alone makes no URL
    for (const char* name : {"shot:01.usda", "C:\\a", "a/b://c", "1x://y", "://x", ""})
        EXPECT_TRUE(check_asset_name(name)) << name;
}

TEST_F(AssetRootsTest, NothingLiesBeneathFoldersThatAreNotThere) {
    const AssetRoots nothing = AssetRoots::beneath({out("none")});
    EXPECT_TRUE(nothing.is_confined());
    EXPECT_EQ(nothing.open(in("a")).error().code, "asset-outside-roots");
    EXPECT_TRUE(AssetRoots::beneath({"/"}).open(out("a")).has_value());
    EXPECT_FALSE(AssetRoots().is_confined());
}

/// Somebody exchanges a folder for a link while files are opened: what opens is never outside.
TEST_F(AssetRootsTest, ALinkThatComesAndGoesLeadsNowhere) {
    write("in/sub/a", "inside");
    fs::create_directory_symlink("../out", in("other"));
    std::atomic<bool> is_over{false};
    std::thread swapper([&] {
        while (!is_over)
            ::renameat2(AT_FDCWD, in("sub").c_str(), AT_FDCWD, in("other").c_str(),
                        RENAME_EXCHANGE);
    });
    size_t opened = 0, refused = 0;
    for (int i = 0; i < 20000; ++i) {
        const Result<FileDescriptor> fd = roots_.open(in("sub/a"));
        if (!fd) {
            ++refused;
            continue;
        }
        ++opened;
        char bytes[6] = {};
        EXPECT_EQ(::pread(fd->get(), bytes, sizeof bytes, 0), 6);
        EXPECT_EQ(std::string(bytes, 6), "inside");
    }
    is_over = true;
    swapper.join();
    EXPECT_GT(opened, 0u);
    EXPECT_GT(refused, 0u);
}

TEST_F(AssetRootsTest, AllAssetsOfTheProcessAskThem) {
    const std::string zip = testing::stored_zip({{"m", "member"}});
    write("in/p.usdz", zip);
    write("out/p.usdz", zip);
    EXPECT_TRUE(open_asset_bytes(out("p.usdz[m]")).has_value()) << "and stays mapped";
    set_asset_roots(roots_);
    EXPECT_EQ(open_asset_bytes(out("a")).error().code, "asset-outside-roots");
    EXPECT_EQ(open_asset_bytes(out("p.usdz[m]")).error().code, "asset-outside-roots");
    EXPECT_EQ(admit_asset(out("p.usdz[m]")).error().code, "asset-outside-roots");
    EXPECT_FALSE(asset_exists(out("p.usdz[m]")));
    EXPECT_EQ(*admit_asset(in("p.usdz[m]")), fs::canonical(in("p.usdz")).string() + "[m]");
    EXPECT_EQ((*open_asset_bytes(in("p.usdz[m]")))->bytes(), "member");
    set_asset_roots({});
    for (const char* member : {"../m", "/m", "a/../../m"}) {
        const std::string name = in("p.usdz[") + member + "]";
        EXPECT_EQ(open_asset_bytes(name).error().code, "asset-leaves-package") << name;
        EXPECT_EQ(admit_asset(name).error().code, "asset-leaves-package") << name;
    }
    EXPECT_EQ(open_asset_bytes(in("p.usdz[]")).error().code, "file-not-found");
    EXPECT_EQ(admit_asset(in("p.usdz[n]")).error().code, "file-not-found");
}

}  // namespace
}  // namespace velatura
