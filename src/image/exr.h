// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "image/image.h"

#include <memory>
#include <string>

namespace velatura::image {

/// Writes an image to a path as it is (no temporary name: call it inside write_atomically):
/// scanlines, ZIP, one part per Part, a plain single-part file when there is one. Errors:
/// "io-write".
Result<void> write_exr(const std::string& path, const Image& image);

/// Reads an EXR file part by part.
class ExrReader {
  public:
    /// Errors: "io-open" (missing, not EXR, deep, window too large, subsampled channels).
    static Result<ExrReader> open(const std::string& path);
    ~ExrReader();
    ExrReader(ExrReader&&) noexcept;
    ExrReader& operator=(ExrReader&&) noexcept;

    int part_count() const;
    /// Windows and attributes of the file; parts have names, attributes and channel names without
    /// data.
    const Image& header() const;
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
