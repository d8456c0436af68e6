// SPDX-License-Identifier: Apache-2.0
#include "base/process/mapping_guard.h"

#include "base/asset_bytes.h"
#include "base/atomic_file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <string>

namespace velatura::test {

namespace {

/// A file of some pages of the letter a, which goes with the object.
class PagesOfA {
  public:
    explicit PagesOfA(size_t bytes) {
        EXPECT_TRUE(write_file_atomically(name_, std::string(bytes, 'a')).has_value());
    }

    ~PagesOfA() { ::unlink(name_.c_str()); }

    PagesOfA(const PagesOfA&) = delete;
    PagesOfA& operator=(const PagesOfA&) = delete;

    const std::string& name() const { return name_; }

    void cut(off_t bytes) { ASSERT_EQ(::truncate(name_.c_str(), bytes), 0); }

  private:
    std::string name_ = testing::TempDir() + "lost_pages_" + std::to_string(::getpid()) + ".usdc";
};

bool is_lost(const std::string& file) {
    const std::vector<std::string> lost = truncated_files();
    return std::find(lost.begin(), lost.end(), file) != lost.end();
}

}  // namespace

TEST(MappingGuard, OfAFileThatIsCutAreZerosAndToldOf) {
    constexpr size_t page = 4096;
    PagesOfA file(16 * page);
    read_truncated_pages_as_zeros();
    const auto asset = open_asset_bytes(file.name());
    ASSERT_TRUE(asset.has_value());
    const std::string_view bytes = (*asset)->bytes();
    ASSERT_EQ(bytes[5 * page], 'a');
    EXPECT_FALSE(is_lost(file.name()));
    file.cut(off_t(page) + 10);
    // What is left of the page in which the file ends is zeros by itself
    EXPECT_EQ(bytes[page + 9], 'a');
    EXPECT_EQ(bytes[page + 10], 0);
    EXPECT_FALSE(is_lost(file.name()));
    EXPECT_EQ(std::count(bytes.begin() + 2 * page, bytes.end(), '\0'), std::ptrdiff_t(14 * page));
    EXPECT_TRUE(is_lost(file.name()));
    exit_on_truncated_files();
}

TEST(MappingGuard, EndTheProcessUnlessAskedFor) {
    PagesOfA file(16 * 4096);
    EXPECT_EXIT(
        {
            read_truncated_pages_as_zeros();
            exit_on_truncated_files();
            const auto asset = open_asset_bytes(file.name());
            file.cut(0);
            std::exit((*asset)->bytes()[9000] == 0);
        },
        testing::KilledBySignal(SIGBUS), "");
}

TEST(MappingGuard, OfNoAssetEndTheProcessAsBefore) {
    EXPECT_EXIT(
        {
            read_truncated_pages_as_zeros();
            std::raise(SIGBUS);
            std::raise(SIGBUS);
        },
        testing::KilledBySignal(SIGBUS), "");
}

/// A plugin has mappings of its own, and its handler lies over that of the program.
TEST(MappingGuard, OfNoAssetGoToTheHandlerBefore) {
    EXPECT_EXIT(
        {
            struct sigaction action {};

            action.sa_flags = SA_SIGINFO;
            action.sa_sigaction = [](int, siginfo_t*, void*) { ::_exit(7); };
            ::sigaction(SIGBUS, &action, nullptr);
            read_truncated_pages_as_zeros();
            read_truncated_pages_as_zeros();
            std::raise(SIGBUS);
        },
        testing::ExitedWithCode(7), "");
}

}  // namespace velatura::test
