// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accumulate/sample_sums.h"
#include "base/result.h"
#include "image/image.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace velatura::layers {

/// The exact sums of a file, read in strips of rows from the top: large films with many layers do
/// not fit in memory twice. Nothing stays open between calls.
class SumsReader {
  public:
    /// Errors: "io-open", "io-read" (also: sums over other pixels than the file's).
    static Result<SumsReader> open(const std::string& path);
    ~SumsReader();
    SumsReader(SumsReader&&) noexcept;
    SumsReader& operator=(SumsReader&&) noexcept;

    /// Windows and attributes of the file; its parts are those of the sums, whose channels have no
    /// values.
    const image::Image& header() const;

    /// Bytes of a row of all sums.
    size_t row_bytes() const;

    /// The row at which the next strip begins; at the end that of the data window.
    int next_row() const;

    /// The sums of the rows from next_row() to y1, as an image of these rows alone that has the
    /// attributes of the file. Errors: "io-read" (also: the file has changed since open()).
    Result<image::Image> read_to(int y1);

    /// The records of every pixel, [pixel of the data window], without the sums beside them.
    /// Errors: "no-sums", "sums-version", "sums-damaged", "io-read".
    Result<std::vector<accumulate::PixelRecord>> records() const;

    /// Reads what is left: whether all rows together have the digest that the header states.
    /// Errors: "io-read". Call once.
    Result<bool> is_intact();

  private:
    struct Impl;
    explicit SumsReader(std::unique_ptr<Impl> impl);
    std::unique_ptr<Impl> impl_;
};

/// What a strip of sums takes at most, unless one row of tiles takes more.
constexpr size_t default_strip_bytes = size_t(256) << 20;

/// Rows of such a strip, in whole rows of tiles.
int strip_rows(size_t row_bytes, size_t strip_bytes = default_strip_bytes);

/// Samples of every pixel of a file, [pixel of the data window]. Errors: "no-sums",
/// "sums-version", "sums-damaged", "io-open", "io-read".
Result<std::vector<uint64_t>> read_sample_counts(const std::string& path);

/// Errors: "no-sums" (written without sums), "sums-version", "sums-damaged", "io-read".
Result<accumulate::SampleSums> read_sums(SumsReader& reader);

}  // namespace velatura::layers
