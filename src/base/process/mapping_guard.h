// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace velatura {
inline namespace process {

/// Installs a handler of SIGBUS for memory-mapped files: a page that cannot be read, because the
/// file was truncated or its disk fails, reads as zeros instead of ending the process, here and in
/// forked processes, and the file is listed in truncated_files(). Readers must check that list.
/// Call it once, early in main(); not in a process that only reads one file.
void read_truncated_pages_as_zeros();

/// Restores the default: unreadable pages end this process.
void exit_on_truncated_files();

/// Files with unreadable pages since the start of the program, by the name that they were mapped
/// under, without duplicates.
std::vector<std::string> truncated_files();

struct MappedRange;

/// Registers a mapped file at [start, start + size) for its lifetime. Must be destroyed before the
/// file is unmapped.
class GuardedMapping {
  public:
    GuardedMapping(const void* start, size_t size, const std::string& file);
    ~GuardedMapping();
    GuardedMapping(const GuardedMapping&) = delete;
    GuardedMapping& operator=(const GuardedMapping&) = delete;

  private:
    MappedRange* place_;
};

}  // namespace process
}  // namespace velatura
