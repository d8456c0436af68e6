// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "plugins/openimageio/sandbox/fork_server_process.h"
#include "plugins/openimageio/sandbox/messages.h"
#include "plugins/openimageio/sandbox/shared_memory.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string_view>

namespace velatura::plugins::openimageio {

struct DecoderProcessLimits {
    double cpu_seconds = 60;                 ///< of the decoder, for one request
    double wall_seconds = 600;               ///< for those that wait rather than compute
    size_t address_bytes = size_t(8) << 30;  ///< beyond its libraries; not under sanitizers
};

/// One decoder process, as the renderer sees it: ended when this object is. Not
/// thread-safe.
class DecoderProcess {
  public:
    /// Errors: "reader-start", "shared-memory".
    static Result<std::unique_ptr<DecoderProcess>> start(
        std::shared_ptr<ForkServerProcess> fork_server, const DecoderProcessLimits& limits);

    DecoderProcess(const DecoderProcess&) = delete;
    DecoderProcess& operator=(const DecoderProcess&) = delete;
    ~DecoderProcess();

    pid_t process() const { return process_; }

    /// Makes room for the answer, puts the name into the area (of Open), asks, and waits. The
    /// answer lies in the area, where the decoder may still change it. Returns: its length, within
    /// `size`. Errors: "image-read" (the decoder refuses), and when it can be asked no more:
    /// "reader-slow" (limits), "reader-ended" (with why), "reader-answer" (nonsense),
    /// "reader-lost" (not by what it read), "shared-memory".
    Result<size_t> ask(Request request, const PayloadSize& size, std::string_view name = {});

    std::string_view area() const { return area_.text(); }

  private:
    DecoderProcess(std::shared_ptr<ForkServerProcess> fork_server,
                   const DecoderProcessLimits& limits,
                   FileDescriptor socket,
                   SharedMemory area,
                   pid_t process);

    bool has_hung_up() const;
    Result<size_t> take_answer(const Request& request, const PayloadSize& size);
    /// Why it does not answer; it is ended.
    Error how_it_ended();
    /// CPU time that it has taken so far; 0 when the system does not say.
    double cpu_seconds() const;

    std::shared_ptr<ForkServerProcess> fork_server_;
    DecoderProcessLimits limits_;
    FileDescriptor socket_;
    SharedMemory area_;
    pid_t process_;
    uint64_t serial_ = 0;
    bool has_ended_ = false;
};

}  // namespace velatura::plugins::openimageio
