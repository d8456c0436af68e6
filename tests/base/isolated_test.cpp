// SPDX-License-Identifier: Apache-2.0
#include "base/isolated.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <csignal>
#include <new>
#include <string>

namespace velatura {

TEST(RunIsolated, BringsTheBytesBack) {
    std::string large(3'000'000, 'x');
    large[5] = '\0';
    const auto bytes = run_isolated({}, [&] { return large; });
    ASSERT_TRUE(bytes);
    EXPECT_EQ(*bytes, large);
}

TEST(RunIsolated, WhatRunsForeverIsStopped) {
    const auto bytes = run_isolated({.cpu_seconds = 1, .address_bytes = size_t(8) << 30}, [] {
        for (std::atomic<unsigned> i{0}; i != 1; i += 2) {
        }
        return std::string();
    });
    ASSERT_FALSE(bytes);
    EXPECT_EQ(bytes.error().code, "isolated-timeout");
}

/// Of a library that waits for a thread which the child does not have, or for a lock that one of
/// them held.
TEST(RunIsolated, WhatWaitsForeverIsStopped) {
    const auto bytes = run_isolated({.wall_seconds = 1}, [] {
        for (;;) pause();
        return std::string();
    });
    ASSERT_FALSE(bytes);
    EXPECT_EQ(bytes.error().code, "isolated-timeout");
}

/// A child that is started meanwhile holds the other's end of the pipe.
TEST(RunIsolated, OthersThatTakeLongerAreNotWaitedFor) {
    std::array<int, 2> ends = {};
    ASSERT_EQ(pipe(ends.data()), 0);
    const auto bytes = run_isolated({}, [&] {
        // The first child holds its own end in a process of its own, as another child would
        if (fork() == 0) {
            char byte = 0;
            close(ends[1]);
            while (read(ends[0], &byte, 1) < 0) {
            }
            _exit(0);
        }
        return std::string("done");
    });
    close(ends[1]);
    close(ends[0]);
    ASSERT_TRUE(bytes);
    EXPECT_EQ(*bytes, "done");
}

TEST(RunIsolated, CrashesAndExceptionsAreErrors) {
    const auto crash = run_isolated({}, [] {
        std::raise(SIGKILL);
        return std::string();
    });
    ASSERT_FALSE(crash);
    EXPECT_EQ(crash.error().code, "isolated-crashed");
    const auto thrown = run_isolated({}, []() -> std::string { throw std::bad_alloc(); });
    ASSERT_FALSE(thrown);
    EXPECT_EQ(thrown.error().code, "isolated-crashed");
}

}  // namespace velatura
