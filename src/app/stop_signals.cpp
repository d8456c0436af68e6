// SPDX-License-Identifier: Apache-2.0
#include "app/stop_signals.h"

#include <unistd.h>

#include <csignal>
#include <cstdint>
#include <ctime>
#include <limits>

namespace velatura::app {

namespace {

std::atomic<bool> stop_requested = false;
std::atomic<bool> snapshot_requested = false;
std::atomic<int> stop_signal = 0;
/// Of the first signal; far ahead until it is known.
constexpr int64_t far_ahead = std::numeric_limits<int64_t>::max();
std::atomic<int64_t> stop_time_ms = far_ahead;
static_assert(std::atomic<bool>::is_always_lock_free && std::atomic<int>::is_always_lock_free &&
                  std::atomic<int64_t>::is_always_lock_free,
              "used in signal handlers");

int64_t now_ms() {
    timespec now{};
    ::clock_gettime(CLOCK_MONOTONIC, &now);
    return int64_t(now.tv_sec) * 1000 + now.tv_nsec / 1'000'000;
}

void on_stop(int signal) {
    const int64_t now = now_ms();
    int none = 0;
    if (stop_signal.compare_exchange_strong(none, signal)) {
        stop_time_ms = now;
        stop_requested = true;
        return;
    }
    // One request may come as two signals: timeout(1) and farms send one to the process and one to
    // its group
    if (now - StopSignals::repeat_ms > stop_time_ms) ::_exit(128 + signal);
}

void on_snapshot(int) {
    snapshot_requested = true;
}

void handle(int signal, void (*handler)(int)) {
    struct sigaction action {};

    action.sa_handler = handler;
    action.sa_flags = SA_RESTART;
    ::sigemptyset(&action.sa_mask);
    ::sigaction(signal, &action, nullptr);
}

}  // namespace

StopSignals::StopSignals() {
    stop_requested = false;
    stop_signal = 0;
    stop_time_ms = far_ahead;
    handle(SIGINT, on_stop);
    handle(SIGTERM, on_stop);
    handle(SIGUSR1, on_snapshot);
    // A limit on file sizes then fails the write, like a full disk, and the message says which file
    handle(SIGXFSZ, SIG_IGN);
}

StopSignals::~StopSignals() {
    handle(SIGINT, SIG_DFL);
    handle(SIGTERM, SIG_DFL);
    // A request that comes after the render does not end a process whose files are written
    handle(SIGUSR1, SIG_IGN);
    handle(SIGXFSZ, SIG_DFL);
}

const std::atomic<bool>& StopSignals::stop_flag() {
    return stop_requested;
}

int StopSignals::signal_number() {
    return stop_signal;
}

bool StopSignals::take_snapshot_request() {
    return snapshot_requested.exchange(false);
}

}  // namespace velatura::app
