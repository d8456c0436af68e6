// SPDX-License-Identifier: Apache-2.0
#include "base/output_lock.h"

#include "base/atomic_file.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>

namespace velatura {

namespace {

namespace fs = std::filesystem;

class OutputLockTest : public ::testing::Test {
  protected:
    void SetUp() override {
        std::string pattern = (fs::temp_directory_path() / "velatura_lock_XXXXXX").string();
        ASSERT_NE(::mkdtemp(pattern.data()), nullptr);
        folder_ = pattern;
    }

    void TearDown() override { fs::remove_all(folder_); }

    std::string path(const char* name) const { return (folder_ / name).string(); }

    fs::path folder_;
};

TEST_F(OutputLockTest, IsHeldByOne) {
    {
        const Result<OutputLock> first = OutputLock::take(path("a.exr"));
        ASSERT_TRUE(first);
        EXPECT_TRUE(first->is_held());
        const Result<OutputLock> second = OutputLock::take(path("a.exr"));
        ASSERT_FALSE(second);
        EXPECT_EQ(second.error().code, "output-locked");
        EXPECT_NE(second.error().message.find("a.exr is being rendered by process " +
                                              std::to_string(::getpid())),
                  std::string::npos)
            << second.error().message;
        EXPECT_TRUE(OutputLock::take(path("b.exr")));
    }
    EXPECT_TRUE(fs::is_empty(folder_));
    EXPECT_TRUE(OutputLock::take(path("a.exr")));
}

TEST_F(OutputLockTest, EndsWithAKilledProcess) {
    const pid_t child = ::fork();
    if (child == 0) {
        const Result<OutputLock> taken = OutputLock::take(path("a.exr"));
        ::kill(::getpid(), SIGKILL);
        ::_exit(taken ? 0 : 1);
    }
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFSIGNALED(status));
    EXPECT_TRUE(fs::exists(path(".a.exr.lock")));
    EXPECT_TRUE(OutputLock::take(path("a.exr")));
    EXPECT_TRUE(fs::is_empty(folder_));
}

TEST_F(OutputLockTest, NamesTheFileWhereThereCanBeNoFolder) {
    std::ofstream(path("no")) << "a file";
    const Result<OutputLock> taken = OutputLock::take(path("no/a.exr"));
    ASSERT_FALSE(taken);
    EXPECT_EQ(taken.error().code, "io-write");
    EXPECT_NE(taken.error().message.find(path("no/a.exr")), std::string::npos);
}

TEST_F(OutputLockTest, SweepsWhatNobodyWrites) {
    for (const char* stale : {".a.tmp.Ab0xYz.exr", ".a.tmp.Ab0xYz"})
        std::ofstream(path(stale)) << "half";
    for (const char* other : {".b.tmp.Ab0xYz.exr", "a.tmp.Ab0xYz.exr", ".a.tmp.b.exr", "a.exr"})
        std::ofstream(path(other)) << "x";
    bool is_there = false;
    ASSERT_TRUE(write_atomically(path("a.exr"), [&](const std::string& temporary) -> Result<void> {
        sweep_temporaries(path("a.exr"));
        is_there = fs::exists(temporary);
        return {};
    }));
    EXPECT_TRUE(is_there) << "a file was swept away that is being written";
    EXPECT_FALSE(fs::exists(path(".a.tmp.Ab0xYz.exr")) || fs::exists(path(".a.tmp.Ab0xYz")));
    for (const char* other : {".b.tmp.Ab0xYz.exr", "a.tmp.Ab0xYz.exr", ".a.tmp.b.exr", "a.exr"})
        EXPECT_TRUE(fs::exists(path(other))) << other;
}

TEST_F(OutputLockTest, FailedWritesNameTheFileThatWasAskedFor) {
    const Result<void> done =
        write_atomically(path("a.exr"), [](const std::string& temporary) -> Result<void> {
            return Error{"io-write", "cannot write " + temporary + ": no space"};
        });
    ASSERT_FALSE(done);
    EXPECT_EQ(done.error().message, "cannot write " + path("a.exr") + ": no space");
}

}  // namespace

}  // namespace velatura
