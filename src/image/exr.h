// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "image/compression.h"
#include "image/image.h"

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace velatura::image {

/// Writes an image to a path as it is (no temporary name: call it inside write_atomically):
/// scanlines, one part per Part, a plain single-part file when there is one. Errors: "io-write".
Result<void> write_exr(const std::string& path,
                       const Image& image,
                       Compression compression = Compression::Zip);

/// From here on files are written and read chunk by chunk by the calling thread, which takes less
/// memory: each of OpenEXR's own threads has chunks of its own.
void use_one_exr_thread();

/// Where rows of a channel go: [rows][width] of the data window, in the type that the file has.
struct RowTarget {
    std::string channel;  ///< full name, of the part
    ChannelType type = ChannelType::Half;
    void* values = nullptr;
};

/// Reads an EXR file part by part, or rows of some channels. One thread at a time may use a reader.
/// Throws std::bad_alloc alone.
class ExrReader {
  public:
    /// Several: OpenEXR's threads decompress chunks side by side. One: a chunk at a time is in
    /// memory.
    enum class Chunks : uint8_t { Several, One };

    /// Deep parts are skipped. Errors: "io-open" (missing, not EXR, nothing but deep data, windows
    /// too large or more of them than the file can hold, subsampled channels).
    static Result<ExrReader> open(const std::string& path, Chunks chunks = Chunks::Several);
    ~ExrReader();
    ExrReader(ExrReader&&) noexcept;
    ExrReader& operator=(ExrReader&&) noexcept;

    /// Of those that are not deep, which all numbers of parts count.
    int part_count() const;
    /// Names of the deep parts, which are skipped.
    const std::vector<std::string>& deep_parts() const;
    /// Windows and attributes of the file; parts have names, attributes and channel names without
    /// data.
    const Image& header() const;
    /// The data window of a part.
    const Window& data_window(int index) const;
    /// Rows that are compressed together, counted from the top of the window.
    int rows_per_chunk(int index) const;
    /// Rows [y0, y1) of some channels of a part, into the caller's memory. Errors: "io-read".
    Result<void> read_rows(int index, int y0, int y1, std::span<const RowTarget> targets) const;
    /// The part with its pixels. Errors: "io-read" (damaged or truncated file).
    Result<Part> read_part(int index) const;

  private:
    struct Impl;
    explicit ExrReader(std::unique_ptr<Impl> impl);
    std::unique_ptr<Impl> impl_;
};

/// The whole file. Errors as ExrReader.
Result<Image> read_exr(const std::string& path);

}  // namespace velatura::image
