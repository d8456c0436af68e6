// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/file_descriptor.h"
#include "base/result.h"

#include <sys/types.h>

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

namespace velatura::plugins::openimageio {

/// The program that starts decoders, as the renderer sees it. It has loaded the libraries and does
/// nothing with them: starting a decoder copies it, which takes milliseconds. It hears no signal of
/// the terminal, has none of the renderer's files, and ends when this object or the renderer does.
/// Thread-safe.
class ForkServerProcess {
  public:
    /// Errors: "reader-start".
    static Result<std::shared_ptr<ForkServerProcess>> start(const std::string& program);

    ForkServerProcess(const ForkServerProcess&) = delete;
    ForkServerProcess& operator=(const ForkServerProcess&) = delete;
    ~ForkServerProcess();

    pid_t process() const { return process_; }

    /// Starts a decoder that has these two. Errors: "reader-start".
    Result<pid_t> start_decoder(int socket, int area, uint64_t address_bytes);

    /// Ends a decoder, if it has not ended, and says how it ended (as waitpid does). nullopt where
    /// the fork server cannot say so.
    std::optional<int> end_decoder(pid_t process);

    /// Whether it is no longer there, and with it none of its decoders.
    bool is_lost() const;

  private:
    ForkServerProcess(pid_t process, FileDescriptor control);

    struct Answer {
        pid_t process;
        int status;
    };

    /// What it says next; nullopt when that takes too long, or it is lost.
    std::optional<Answer> next_answer();

    pid_t process_;
    FileDescriptor control_;
    mutable std::mutex mutex_;
    bool is_lost_ = false;
};

}  // namespace velatura::plugins::openimageio
