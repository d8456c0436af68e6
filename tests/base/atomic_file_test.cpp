// SPDX-License-Identifier: Apache-2.0
#include "base/atomic_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

namespace velatura {

namespace {

namespace fs = std::filesystem;

class AtomicFile : public ::testing::Test {
  protected:
    void SetUp() override {
        std::string pattern = (fs::temp_directory_path() / "velatura_base_XXXXXX").string();
        ASSERT_NE(::mkdtemp(pattern.data()), nullptr);
        folder_ = pattern;
    }

    void TearDown() override { fs::remove_all(folder_); }

    std::string path(const char* name) const { return (folder_ / name).string(); }

    size_t entries() const {
        return size_t(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
    }

    fs::path folder_;
};

TEST_F(AtomicFile, RoundTripsBytes) {
    const std::string bytes("a\0b\r\n\xff", 6);
    ASSERT_TRUE(write_file_atomically(path("x.bin"), bytes));
    const Result<std::string> back = read_file(path("x.bin"));
    ASSERT_TRUE(back);
    EXPECT_EQ(*back, bytes);
    EXPECT_EQ(entries(), 1u);
}

TEST_F(AtomicFile, ReplacesAnOldFile) {
    ASSERT_TRUE(write_file_atomically(path("x"), "old and longer"));
    ASSERT_TRUE(write_file_atomically(path("x"), "new"));
    EXPECT_EQ(*read_file(path("x")), "new");
}

TEST_F(AtomicFile, KeepsTheOldFileAndLeavesNoPartWhenTheWriterFails) {
    ASSERT_TRUE(write_file_atomically(path("x.exr"), "old"));
    const Result<void> done =
        write_atomically(path("x.exr"), [](const std::string& temporary) -> Result<void> {
            std::ofstream(temporary) << "half of the";
            return Error{"io-write", "the disk is full"};
        });
    ASSERT_FALSE(done);
    EXPECT_EQ(done.error().message, "the disk is full");
    EXPECT_EQ(*read_file(path("x.exr")), "old");
    EXPECT_EQ(entries(), 1u);
}

TEST_F(AtomicFile, KeepsTheOldFileAndLeavesNoPartWhenTheWriterThrows) {
    ASSERT_TRUE(write_file_atomically(path("x.exr"), "old"));
    EXPECT_THROW(
        static_cast<void>(write_atomically(
            path("x.exr"), [](const std::string&) -> Result<void> { throw std::bad_alloc(); })),
        std::bad_alloc);
    EXPECT_EQ(*read_file(path("x.exr")), "old");
    EXPECT_EQ(entries(), 1u);
}

TEST_F(AtomicFile, ReadersSeeTheOldContentUntilTheEnd) {
    ASSERT_TRUE(write_file_atomically(path("x"), "old"));
    std::string seen;
    ASSERT_TRUE(write_atomically(path("x"), [&](const std::string& temporary) -> Result<void> {
        std::ofstream(temporary) << "new";
        seen = *read_file(path("x"));
        return {};
    }));
    EXPECT_EQ(seen, "old");
    EXPECT_EQ(*read_file(path("x")), "new");
}

TEST_F(AtomicFile, TemporaryKeepsTheExtension) {
    std::string extension;
    ASSERT_TRUE(write_atomically(path("x.exr"), [&](const std::string& temporary) -> Result<void> {
        extension = fs::path(temporary).extension().string();
        return {};
    }));
    EXPECT_EQ(extension, ".exr");
}

TEST_F(AtomicFile, NewFilesHaveTheModeOfTheUmask) {
    const mode_t old = ::umask(022);
    const Result<void> done = write_file_atomically(path("x"), "");
    ::umask(old);
    ASSERT_TRUE(done);

    struct ::stat info {};

    ASSERT_EQ(::stat(path("x").c_str(), &info), 0);
    EXPECT_EQ(info.st_mode & 0777, mode_t(0644));
}

TEST_F(AtomicFile, MakesMissingFolders) {
    ASSERT_TRUE(write_file_atomically(path("new/and//deeper/x"), "y"));
    EXPECT_EQ(*read_file(path("new/and/deeper/x")), "y");
}

TEST_F(AtomicFile, FailsBeneathAFileWithItsName) {
    ASSERT_TRUE(write_file_atomically(path("no"), "a file"));
    const Result<void> done = write_file_atomically(path("no/such/x"), "y");
    ASSERT_FALSE(done);
    EXPECT_EQ(done.error().code, "io-write");
    EXPECT_NE(done.error().message.find("no/such/x"), std::string::npos);
}

TEST_F(AtomicFile, ReadRefusesWhatIsNoRegularFile) {
    EXPECT_EQ(read_file(path("missing")).error().code, "io-open");
    EXPECT_EQ(read_file(folder_.string()).error().code, "io-open");
    // Opening a FIFO without a writer would wait for ever
    ASSERT_EQ(::mkfifo(path("fifo").c_str(), 0600), 0);
    EXPECT_EQ(read_file(path("fifo")).error().code, "io-open");
}

TEST_F(AtomicFile, ReadRefusesMoreThanTheLimit) {
    ASSERT_TRUE(write_file_atomically(path("x"), "12345"));
    EXPECT_EQ(read_file(path("x"), 4).error().code, "io-open");
    EXPECT_EQ(*read_file(path("x"), 5), "12345");
}

}  // namespace

}  // namespace velatura
