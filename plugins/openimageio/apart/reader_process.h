// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "plugins/openimageio/apart/messages.h"
#include "plugins/openimageio/apart/shared_area.h"
#include "plugins/openimageio/apart/starter_process.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string_view>

namespace velatura::plugins::openimageio {

struct ReaderLimits {
    double cpu_seconds = 60;                 ///< of the reader, for one request
    double wall_seconds = 600;               ///< for those that wait rather than compute
    size_t address_bytes = size_t(8) << 30;  ///< beyond its libraries; not under sanitizers
};

/// One process that reads pictures, as the renderer sees it: ended when this object is. Not
/// thread-safe.
class ReaderProcess {
  public:
    /// Errors: "reader-start", "shared-memory".
    static Result<std::unique_ptr<ReaderProcess>> start(std::shared_ptr<StarterProcess> starter,
                                                        const ReaderLimits& limits);

    ReaderProcess(const ReaderProcess&) = delete;
    ReaderProcess& operator=(const ReaderProcess&) = delete;
    ~ReaderProcess();

    pid_t process() const { return process_; }

    /// Makes room for the answer, puts the name into the area (of Open), asks, and waits. The
    /// answer lies in the area, where the reader may still change it. Returns: its length, within
    /// `size`. Errors: "image-read" (the reader refuses), and when it can be asked no more:
    /// "reader-slow" (limits), "reader-ended" (with why), "reader-answer" (nonsense), "reader-lost"
    /// (not by what it read), "shared-memory".
    Result<size_t> ask(Request request, const PayloadSize& size, std::string_view name = {});

    std::string_view area() const { return area_.text(); }

  private:
    ReaderProcess(std::shared_ptr<StarterProcess> starter,
                  const ReaderLimits& limits,
                  FileDescriptor socket,
                  SharedArea area,
                  pid_t process);

    bool has_hung_up() const;
    Result<size_t> take_answer(const Request& request, const PayloadSize& size);
    /// Why it does not answer; it is ended.
    Error how_it_ended();
    /// CPU time that it has taken so far; 0 when the system does not say.
    double cpu_seconds() const;

    std::shared_ptr<StarterProcess> starter_;
    ReaderLimits limits_;
    FileDescriptor socket_;
    SharedArea area_;
    pid_t process_;
    uint64_t serial_ = 0;
    bool has_ended_ = false;
};

}  // namespace velatura::plugins::openimageio
