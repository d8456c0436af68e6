// SPDX-License-Identifier: Apache-2.0
// Signals that ask for a stop: one request may come as several signals.
#include "app/stop_signals.h"

#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <thread>

namespace velatura::app {

TEST(StopSignals, RepeatsAtOnceAreOneRequest) {
    const StopSignals signals;
    EXPECT_FALSE(StopSignals::stop_flag());
    EXPECT_EQ(StopSignals::signal_number(), 0);
    // timeout(1) sends its signal to the process, then to its group: the second one ended the
    // process before anything was written
    for (int i = 0; i < 20; ++i) std::raise(SIGTERM);
    std::raise(SIGINT);
    EXPECT_TRUE(StopSignals::stop_flag());
    EXPECT_EQ(StopSignals::signal_number(), SIGTERM);
}

TEST(StopSignalsDeathTest, ARequestForAnImageAfterTheRenderEndsNothing) {
    EXPECT_EXIT(
        {
            { const StopSignals signals; }
            std::raise(SIGUSR1);
            std::_Exit(0);
        },
        testing::ExitedWithCode(0), "");
}

TEST(StopSignalsDeathTest, ALaterOneEndsTheProcess) {
    EXPECT_EXIT(
        {
            const StopSignals signals;
            std::raise(SIGINT);
            std::this_thread::sleep_for(std::chrono::milliseconds(StopSignals::repeat_ms + 50));
            std::raise(SIGTERM);
        },
        testing::ExitedWithCode(128 + SIGTERM), "");
}

}  // namespace velatura::app
