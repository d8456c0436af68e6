// SPDX-License-Identifier: Apache-2.0
#include "base/isolated.h"

#include <gtest/gtest.h>

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
