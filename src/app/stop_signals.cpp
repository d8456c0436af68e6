// SPDX-License-Identifier: Apache-2.0
#include "app/stop_signals.h"

#include <unistd.h>

#include <csignal>

namespace velatura::app {

namespace {

std::atomic<bool> stop_requested = false;
std::atomic<bool> snapshot_requested = false;
std::atomic<int> stop_signal = 0;
static_assert(std::atomic<bool>::is_always_lock_free && std::atomic<int>::is_always_lock_free,
              "used in signal handlers");

void on_stop(int signal) {
    if (stop_requested.exchange(true)) ::_exit(128 + signal);
    stop_signal = signal;
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
    handle(SIGINT, on_stop);
    handle(SIGTERM, on_stop);
    handle(SIGUSR1, on_snapshot);
    // A limit on file sizes then fails the write, like a full disk, and the message says which file
    handle(SIGXFSZ, SIG_IGN);
}

StopSignals::~StopSignals() {
    handle(SIGINT, SIG_DFL);
    handle(SIGTERM, SIG_DFL);
    handle(SIGUSR1, SIG_DFL);
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
