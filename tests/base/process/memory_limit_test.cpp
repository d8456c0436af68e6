// SPDX-License-Identifier: Apache-2.0
#include "base/process/memory_limit.h"

#include "base/isolated.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cstring>
#include <fstream>
#include <memory>
#include <new>
#include <string>
#include <vector>

namespace velatura {

namespace {

constexpr size_t megabyte = size_t(1) << 20;

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool has_own_allocator = true;
#else
constexpr bool has_own_allocator = false;
#endif

/// Memory that is there, not only promised; for the compiler, too.
[[gnu::noinline]] std::unique_ptr<char[]> take(size_t bytes) {
    std::unique_ptr<char[]> memory(new char[bytes]);
    std::memset(memory.get(), 1, bytes);
    return memory;
}

/// That are mapped, with the stack: what RLIMIT_DATA counts, and a little more.
size_t writable_bytes() {
    std::ifstream statm("/proc/self/statm");
    size_t pages = 0;
    for (int column = 0; column < 6; ++column) statm >> pages;
    return pages * size_t(sysconf(_SC_PAGESIZE));
}

/// What `work` says in a process of its own, whose memory nobody else takes.
std::string alone(const std::function<std::string()>& work) {
    const Result<std::string> said = run_isolated({.address_bytes = size_t(64) << 30}, work);
    return said ? *said : said.error().message;
}

class MemoryLimitTest : public testing::Test {
  protected:
    void SetUp() override {
        if (has_own_allocator) GTEST_SKIP() << "sanitizers take memory by ways of their own";
    }
};

}  // namespace

/// Without a limit of ours: the kernel's own.
TEST_F(MemoryLimitTest, WhatWasPutAsideIsThereWhenNothingElseIs) {
    EXPECT_EQ(alone([]() -> std::string {
                  reserve_memory();
                  rlimit limit = {};
                  getrlimit(RLIMIT_DATA, &limit);
                  limit.rlim_cur = writable_bytes();
                  setrlimit(RLIMIT_DATA, &limit);
                  // More than the allocator has left over, less than was put aside
                  std::vector<std::unique_ptr<char[]>> taken;
                  taken.reserve(64);
                  size_t megabytes = 0;
                  try {
                      for (; megabytes < 64; ++megabytes) taken.push_back(take(megabyte));
                  } catch (const std::bad_alloc&) {
                  }
                  return megabytes >= 2 && megabytes <= 5 ? "some megabytes"
                                                          : fmt::format("{} MB", megabytes);
              }),
              "some megabytes");
}

TEST_F(MemoryLimitTest, RefusesWhatWouldGoBeyondIt) {
    EXPECT_EQ(alone([] {
                  const size_t bytes = resident_bytes() + 100 * megabyte;
                  const MemoryLimit limit(bytes);
                  std::vector<std::unique_ptr<char[]>> taken;
                  try {
                      for (;;) taken.push_back(take(megabyte));
                  } catch (const std::bad_alloc&) {
                  }
                  // What is given back can be had again
                  const size_t count = taken.size();
                  taken.clear();
                  MemoryLimit::enforce("again");
                  for (size_t i = 0; i + 10 < count; ++i) taken.push_back(take(megabyte));
                  const bool is_kept = peak_resident_bytes() <= bytes;
                  return fmt::format("{} {} {}", is_kept, count > 80 && count <= 100,
                                     MemoryLimit::doing());
              }),
              "true true again");
}

/// What the allocator keeps of freed blocks is resident again when it is used again, and the kernel
/// is not asked.
TEST_F(MemoryLimitTest, CountsWhatWasFreedAndIsTakenAgain) {
    EXPECT_EQ(alone([] {
                  // A large block that is freed lets the allocator keep such blocks, unless it is
                  // told not to
                  take(30 * megabyte);
                  const size_t bytes = resident_bytes() + 110 * megabyte;
                  const MemoryLimit limit(bytes);
                  MemoryLimit::watch();
                  std::vector<std::unique_ptr<char[]>> blocks(180);
                  for (auto& block : blocks) block = take(megabyte / 2);
                  // Holes between those that stay, too small for what comes next
                  for (size_t i = 0; i < blocks.size(); i += 2) blocks[i].reset();
                  const auto other = take(45 * megabyte);
                  MemoryLimit::enforce("again");
                  std::vector<std::unique_ptr<char[]>> taken;
                  try {
                      for (int i = 0; i < 90; ++i) taken.push_back(take(megabyte / 2));
                  } catch (const std::bad_alloc&) {
                  }
                  const bool is_kept = peak_resident_bytes() <= bytes, is_used = taken.size() > 20;
                  return fmt::format("{} {}", is_kept, is_used);
              }),
              "true true");
}

TEST_F(MemoryLimitTest, NoneIsSetWithoutOne) {
    EXPECT_FALSE(MemoryLimit::is_set());
    EXPECT_EQ(MemoryLimit::allowed(), machine_bytes());
    MemoryLimit::enforce("nothing");
    EXPECT_TRUE(take(8 * megabyte));
}

TEST_F(MemoryLimitTest, EndsWithTheObject) {
    EXPECT_EQ(alone([] {
                  { const MemoryLimit limit(resident_bytes() + 20 * megabyte); }
                  return fmt::format("{} {}", take(100 * megabyte) != nullptr,
                                     MemoryLimit::is_set());
              }),
              "true false");
}

TEST_F(MemoryLimitTest, WatchedItGrantsAndCounts) {
    EXPECT_EQ(alone([] {
                  const MemoryLimit limit(resident_bytes() + 50 * megabyte);
                  MemoryLimit::watch();
                  const bool has_left = MemoryLimit::left() > 40 * megabyte;
                  const auto much = take(60 * megabyte);
                  return fmt::format("{} {}", has_left, MemoryLimit::left());
              }),
              "true 0");
}

TEST_F(MemoryLimitTest, GrantsWhereALibraryWouldFail) {
    EXPECT_EQ(alone([] {
                  const MemoryLimit limit(resident_bytes() + 20 * megabyte);
                  const MemoryLimit::Exemption granted;
                  return fmt::format("{}", take(30 * megabyte) != nullptr);
              }),
              "true");
}

/// Or a file of some bytes could ask for all addresses there are, and is granted step after step.
TEST_F(MemoryLimitTest, GrantsNoMoreThanALibraryNeeds) {
    EXPECT_EQ(alone([] {
                  const MemoryLimit limit(resident_bytes() + 20 * megabyte);
                  const MemoryLimit::Exemption granted;
                  for (const size_t bytes : {2000 * megabyte, size_t(1) << 60}) {
                      try {
                          const std::unique_ptr<char[]> much(new char[bytes]);
                          // What nobody sees the compiler allocates nowhere
                          asm volatile("" : : "r"(much.get()) : "memory");
                          return std::string("granted");
                      } catch (const std::bad_alloc&) {
                      }
                  }
                  return std::string("refused");
              }),
              "refused");
}

TEST_F(MemoryLimitTest, LiftedForAWhile) {
    EXPECT_EQ(alone([] {
                  const MemoryLimit limit(resident_bytes() + 20 * megabyte);
                  {
                      const MemoryLimit::Suspension lifted;
                      take(40 * megabyte);
                  }
                  try {
                      take(40 * megabyte);
                  } catch (const std::bad_alloc&) {
                      return std::string("refused");
                  }
                  return std::string("granted");
              }),
              "refused");
}

TEST_F(MemoryLimitTest, OneBelowOrJustAboveWhatIsThereIsRefused) {
    for (const size_t above : {size_t(0), 5 * megabyte})
        EXPECT_EQ(alone([=] {
                      try {
                          const MemoryLimit limit(above == 0 ? megabyte : resident_bytes() + above);
                      } catch (const std::bad_alloc&) {
                          return fmt::format("refused {}", take(30 * megabyte) != nullptr);
                      }
                      return std::string("granted");
                  }),
                  "refused true");
}

TEST_F(MemoryLimitTest, ThePeakIsThatOfThisProgram) {
    const size_t before = peak_resident_bytes();
    {
        const auto much = take(64 * megabyte);
        EXPECT_GE(resident_bytes(), 64 * megabyte);
    }
    EXPECT_GE(peak_resident_bytes(), std::max(before, 64 * megabyte));
}

}  // namespace velatura
