// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace velatura {

/// Files are mapped, and read as they are used. Where a page of one cannot be had by then, because
/// somebody has cut the file short or its disk fails, the system ends the process (SIGBUS). From
/// this call on such a page is zeros instead, in this process and in copies of it, and its file is
/// one of files_with_lost_pages(), whose users have to look there. For programs to call once,
/// early; a process that does nothing but read one file is better ended.
void read_lost_pages_as_zeros();

/// From here on lost pages end this process again.
void end_at_lost_pages();

/// Files of which a page was lost since the program was started, by the names that they were mapped
/// under; each once.
std::vector<std::string> files_with_lost_pages();

struct MappedPlace;

/// A file that is mapped at [start, start + size), for as long as that is so.
class WatchedMapping {
  public:
    WatchedMapping(const void* start, size_t size, const std::string& file);
    ~WatchedMapping();
    WatchedMapping(const WatchedMapping&) = delete;
    WatchedMapping& operator=(const WatchedMapping&) = delete;

  private:
    MappedPlace* place_;
};

}  // namespace velatura
