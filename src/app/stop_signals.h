// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>

namespace velatura::app {

/// While it lives, SIGINT and SIGTERM ask for a stop and SIGUSR1 for an interim image; another
/// SIGINT or SIGTERM, more than `repeat_ms` later, ends the process at once. Afterwards SIGUSR1 is
/// ignored, and the others end the process again. One at a time per process.
class StopSignals {
  public:
    static constexpr int repeat_ms = 500;

    StopSignals();
    ~StopSignals();
    StopSignals(const StopSignals&) = delete;
    StopSignals& operator=(const StopSignals&) = delete;

    /// True once a stop was asked for.
    static const std::atomic<bool>& stop_flag();
    /// The signal that asked for the stop; 0 = none.
    static int signal_number();
    /// True once per SIGUSR1.
    static bool take_snapshot_request();
};

}  // namespace velatura::app
