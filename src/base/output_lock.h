// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"

#include <string>
#include <utility>

namespace velatura {

/// While it lives, no other process gets the lock of the same output file. The lock is that of the
/// system (flock) on
/// `.NAME.lock` beside it, which ends with the process however that ends: what a killed one leaves
/// is a file and no lock. docs/adr/0041 says why.
class OutputLock {
  public:
    /// Errors: "output-locked" with who holds it, "io-write" when nothing can be made in the
    /// folder.
    static Result<OutputLock> take(const std::string& path);

    /// The same, once who holds it lets go. Errors: as of take(), "output-locked" after `seconds`.
    static Result<OutputLock> wait_for(const std::string& path, double seconds);

    OutputLock(OutputLock&& other) noexcept;
    OutputLock& operator=(OutputLock&&) = delete;
    ~OutputLock();

    /// False where the file system knows no locks: then there is none.
    bool is_held() const { return is_held_; }

  private:
    OutputLock(std::string lock_path, int fd, bool is_held)
        : lock_path_(std::move(lock_path)), fd_(fd), is_held_(is_held) {}

    std::string lock_path_;
    int fd_ = -1;
    bool is_held_ = false;
};

}  // namespace velatura
