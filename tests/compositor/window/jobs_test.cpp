// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/jobs.h"

#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>
#include <string>
#include <thread>

namespace velatura::compositor::window {
namespace {

/// The next outcome, waited for.
template <class T>
std::optional<Result<T>> next(Jobs<T>& jobs) {
    while (jobs.is_busy()) {
        if (auto outcome = jobs.take()) return outcome;
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return std::nullopt;
}

TEST(Jobs, NobodyWaitsAndNoneIsLost) {
    std::promise<void> gate;
    const std::shared_future<void> opened = gate.get_future().share();
    std::atomic<int> woken = 0;
    Jobs<int> jobs([&] { ++woken; });
    for (int i = 0; i < 3; ++i)
        // Would wait for ever here if a second job waited for the first
        jobs.add([opened, i]() -> Result<int> {
            opened.wait();
            return i;
        });
    EXPECT_TRUE(jobs.is_busy());
    EXPECT_FALSE(jobs.take().has_value());
    gate.set_value();
    for (int i = 0; i < 3; ++i) EXPECT_EQ(**next(jobs), i);
    EXPECT_FALSE(jobs.is_busy());
    EXPECT_EQ(woken, 3);
}

TEST(Jobs, TheNewestReplacesAllOthers) {
    std::promise<void> gate;
    const std::shared_future<void> opened = gate.get_future().share();
    std::atomic<int> begun = 0;
    Jobs<int> jobs([] {});
    for (int i = 0; i < 3; ++i)
        jobs.replace([&begun, opened, i]() -> Result<int> {
            ++begun;
            opened.wait();
            return i;
        });
    gate.set_value();
    EXPECT_EQ(**next(jobs), 2);
    EXPECT_FALSE(next(jobs).has_value());
    EXPECT_EQ(begun, 2) << "what was replaced before it began";
}

TEST(Jobs, WhatIsThrownIsAnError) {
    Jobs<void> jobs([] {});
    jobs.add([]() -> Result<void> { throw std::runtime_error("a hole in the disk"); });
    jobs.add([]() -> Result<void> { throw std::bad_alloc(); });
    EXPECT_EQ(next(jobs)->error().message, "a hole in the disk");
    EXPECT_EQ(next(jobs)->error().code, "out-of-memory");
}

}  // namespace
}  // namespace velatura::compositor::window
