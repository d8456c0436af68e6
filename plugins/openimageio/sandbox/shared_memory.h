// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/file_descriptor.h"
#include "base/result.h"

#include <cstddef>
#include <span>
#include <string_view>
#include <utility>

namespace velatura::plugins::openimageio {

/// Memory that two processes see. Its owner makes it and lets it grow; the other one maps what
/// there is. It never shrinks (sealed), so that what is mapped stays readable whatever the other
/// does.
class SharedMemory {
  public:
    /// Empty, and closed in programs that are started. Errors: "shared-memory".
    static Result<SharedMemory> create();

    /// Somebody else's.
    explicit SharedMemory(FileDescriptor file) : file_(std::move(file)) {}

    SharedMemory(SharedMemory&& o) noexcept
        : file_(std::move(o.file_)), bytes_(std::exchange(o.bytes_, {})), backed_(o.backed_) {}

    SharedMemory& operator=(SharedMemory&&) = delete;
    ~SharedMemory();

    int descriptor() const { return file_.get(); }

    /// For the owner: makes it at least so large, with memory behind all of it, and maps it.
    /// Errors: "shared-memory".
    Result<void> reserve(size_t bytes);

    /// For the other one: maps at least so much. Errors: "shared-memory" (it is smaller, or there
    /// are no addresses left).
    Result<void> map(size_t bytes);

    /// Gives back the memory behind all bytes but the first.
    void forget_beyond(size_t bytes);

    /// What is mapped. The other process may change it at any time: copy before you judge.
    std::span<char> bytes() const { return bytes_; }

    std::string_view text() const { return {bytes_.data(), bytes_.size()}; }

  private:
    void unmap();

    FileDescriptor file_;
    std::span<char> bytes_;
    size_t backed_ = 0;  ///< bytes with memory behind them for certain
};

}  // namespace velatura::plugins::openimageio
