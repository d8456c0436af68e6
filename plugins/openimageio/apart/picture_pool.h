// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "plugins/openimageio/apart/picture_source.h"
#include "plugins/openimageio/apart/reader_process.h"

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
    std::string program;      ///< that calls run_starter()
    size_t most_readers = 0;  ///< 0: as many as the machine runs threads
    ReaderLimits limits = {};
};

/// Pictures that other processes decode: one for each picture, as long as there are not too many,
/// else several share one. What a picture does to its reader (a crash, a hang, all its memory)
/// costs that picture, by name, for good; others go on in a new reader. Processes are started when
/// the first picture is opened. Pictures must not outlive the pool.
class PicturePool final : public PictureSource {
  public:
    explicit PicturePool(PoolOptions options);
    ~PicturePool() override;
    PicturePool(const PicturePool&) = delete;
    PicturePool& operator=(const PicturePool&) = delete;

    /// Errors: "image-open", with what open() of the program's own source says, or how its reader
    /// ended; "reader-start" (no program, or the system starts no process).
    Result<std::unique_ptr<SourcePicture>> open(const std::string& asset, PictureUse use) override;

    /// For readers that are started from here on.
    void limit(const ReaderLimits& limits);

    /// That run at the moment, for those who look from outside; the starter first.
    std::vector<pid_t> processes() const;

  private:
    struct Seat;
    struct Visit;
    class OpenPicture;

    Visit new_visit(const std::string& asset, PictureUse use);
    void leave(Seat& seat);
    ReaderLimits reader_limits() const;
    std::optional<Error> failure_of(const std::string& asset) const;
    Error remember(const std::string& asset, const Error& why);
    Result<std::shared_ptr<StarterProcess>> starter();
    /// Opens the picture in the reader of its seat, where it is not open, and reads values, if any
    /// are wanted.
    Result<void> read(Visit& visit, const Request& request, std::span<float> values);
    Result<void> enter(Visit& visit);
    void close(const Visit& visit);

    PoolOptions options_;
    mutable std::mutex mutex_;  // of the limits and the next three
    std::vector<std::unique_ptr<Seat>> seats_;
    std::map<std::string, Error> failures_;
    uint64_t next_picture_ = 1;
    mutable std::mutex starter_mutex_;
    std::shared_ptr<StarterProcess> starter_;
};

}  // namespace velatura::plugins::openimageio
