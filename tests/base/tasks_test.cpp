// SPDX-License-Identifier: Apache-2.0
#include "base/tasks.h"

#include <gtest/gtest.h>

#include <atomic>
#include <mutex>
#include <set>
#include <stdexcept>
#include <thread>
#include <vector>

namespace velatura {

namespace {

TEST(Tasks, VisitsEveryIndexOnce) {
    for (const int threads : {1, 2, 7}) {
        const ThreadLimit limit(threads);
        for (const size_t count : {size_t(0), size_t(1), size_t(1000)}) {
            std::vector<std::atomic<int>> visits(count);
            parallel_for(
                count, [&](size_t i) { ++visits[i]; }, 3);
            for (size_t i = 0; i < count; ++i)
                EXPECT_EQ(visits[i].load(), 1) << i << " of " << count;
        }
    }
}

TEST(Tasks, LimitIsTheNumberOfThreadsEvenBeyondTheCores) {
    {
        const ThreadLimit seven(7);
        EXPECT_EQ(thread_count(), 7);
        {
            const ThreadLimit one(1);
            EXPECT_EQ(thread_count(), 1);
        }
        EXPECT_EQ(thread_count(), 7);
    }
    EXPECT_GE(thread_count(), 1);
}

TEST(Tasks, OneThreadMeansTheCallersThread) {
    const ThreadLimit one(1);
    std::mutex mutex;
    std::set<std::thread::id> seen;
    parallel_for(100, [&](size_t) {
        const std::lock_guard lock(mutex);
        seen.insert(std::this_thread::get_id());
    });
    EXPECT_EQ(seen.size(), 1u);
}

TEST(Tasks, ExceptionsReachTheCaller) {
    const ThreadLimit limit(3);
    EXPECT_THROW(parallel_for(100,
                              [](size_t i) {
                                  if (i == 42) throw std::runtime_error("task 42");
                              }),
                 std::runtime_error);
}

TEST(Tasks, Nest) {
    const ThreadLimit limit(2);
    std::atomic<int> sum = 0;
    parallel_for(10, [&](size_t) { parallel_for(10, [&](size_t i) { sum += int(i); }); });
    EXPECT_EQ(sum.load(), 450);
}

}  // namespace

}  // namespace velatura
