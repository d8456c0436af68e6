// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace velatura {
inline namespace process {

/// What a process has cost since its program was started.
struct ProcessTimes {
    double wall_s = 0;
    double cpu_s = 0;  ///< user and system, of its threads and of the children that ended
};

ProcessTimes process_times();

}  // namespace process
}  // namespace velatura
