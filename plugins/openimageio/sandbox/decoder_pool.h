// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "plugins/openimageio/sandbox/decoder_process.h"
#include "plugins/openimageio/sandbox/image_source.h"

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace velatura::plugins::openimageio {

struct PoolOptions {
    std::string program;      ///< that calls run_fork_server()
    size_t max_decoders = 0;  ///< 0: as many as the machine runs threads
    DecoderProcessLimits limits = {};
};

/// Images that other processes decode: one for each image, as long as there are not too many,
/// else several share one. What an image does to its decoder (a crash, a hang, all its memory)
/// costs that image, by name, for good; others go on in a new decoder. Processes are started when
/// the first image is opened. Images must not outlive the pool.
class DecoderPool final : public ImageSource {
  public:
    explicit DecoderPool(PoolOptions options);
    ~DecoderPool() override;
    DecoderPool(const DecoderPool&) = delete;
    DecoderPool& operator=(const DecoderPool&) = delete;

    /// Errors: "image-open", with what open() of the program's own source says, or how its decoder
    /// ended; "reader-start" (no program, or the system starts no process).
    Result<std::unique_ptr<SourceImage>> open(const std::string& asset, ImageUse use) override;

    /// For decoders that are started from here on.
    void limit(const DecoderProcessLimits& limits);

    /// That run at the moment, for those who look from outside; the fork server first.
    std::vector<pid_t> processes() const;

  private:
    struct Slot;
    struct PooledImage;
    class OpenImage;

    PooledImage assign_slot(const std::string& asset, ImageUse use);
    void release(Slot& slot);
    DecoderProcessLimits process_limits() const;
    std::optional<Error> failure_of(const std::string& asset) const;
    Error remember(const std::string& asset, const Error& why);
    Result<std::shared_ptr<ForkServerProcess>> fork_server();
    /// Opens the image in the decoder of its slot, where it is not open, and reads values, if any
    /// are wanted.
    Result<void> read(PooledImage& pooled, const Request& request, std::span<float> values);
    Result<void> ensure_open(PooledImage& pooled);
    void close(const PooledImage& pooled);

    PoolOptions options_;
    mutable std::mutex mutex_;  // of the limits and the next three
    std::vector<std::unique_ptr<Slot>> slots_;
    std::map<std::string, Error> failures_;
    uint64_t next_image_ = 1;
    mutable std::mutex fork_server_mutex_;
    std::shared_ptr<ForkServerProcess> fork_server_;
};

}  // namespace velatura::plugins::openimageio
