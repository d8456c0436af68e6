// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accumulate/sample_sums.h"
#include "base/result.h"
#include "image/digest.h"
#include "image/image.h"

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace velatura::layers {

/// Two parts of UINT channels. The records of the pixels, `sums_first sums_end sums_invalid
/// sums_primId sums_instanceId sums_hasIds`, `sums_rate` where the schedule has decided on it,
/// `sums_earlierR`, `G`, `B` (bits of floats) where earlier means are known; and the exact node
/// sums, `sums<node>_<accumulator>.x0` (low word of x), `.x1` (high word) …, of which channels of
/// zeros are left out. Errors: "sums-folded" (the store has a final_end), "sums-range" (sample
/// index of 2^32 or more).
Result<std::vector<image::Part>> sums_parts(const accumulate::SampleSums& sums);

/// Whether a channel of `sums…` is one of the records.
bool is_record(std::string_view channel_name);

/// The digest of the bookkeeping channels of a file that comes in strips of rows.
class SumsDigest {
  public:
    explicit SumsDigest(const image::Window& data) : digest_(data) {}

    /// The next rows.
    void add(const image::Image& rows);
    /// Call once. Empty: no such channels.
    std::string finish();
    /// Whether it is what the header string states. Call once.
    bool is_that_of(const std::string& sums_json);

  private:
    image::StripDigest digest_;
    bool is_empty_ = true;
};

/// The header string `velatura/sums`: the layer set, and the digests of the records and of all
/// bookkeeping channels.
std::string sums_json(const accumulate::LayerSet& set, const image::Image& image);

/// Errors: "no-sums" (written without sums), "sums-version" (written by another version),
/// "sums-damaged".
Result<accumulate::SampleSums> read_sums(const image::Image& image);

/// Whether a file has sums that this version reads. Errors: "no-sums", "sums-version",
/// "sums-damaged".
Result<void> check_sums_header(const image::Image& header);

/// Sums without samples over a window, for append_sums() of this file and of those that go with it.
/// `final_end`: as SampleSums has it. Errors: "no-sums", "sums-version", "sums-damaged".
Result<accumulate::SampleSums> empty_sums(const image::Image& image,
                                          const image::Window& window,
                                          uint64_t final_end = 0);

/// Adds the stored samples, of the whole file or of some of its rows, to sums of the same layer
/// set, whose window holds that of the image; in every pixel they must follow those that are there.
/// Does not ask for the digest. Errors: "sums-damaged"; the sums are of no use then.
Result<void> append_sums(const image::Image& image, accumulate::SampleSums& sums);

/// The records of every pixel, [pixel of the data window], of the whole file or of some of its
/// rows; the image needs no channels but theirs. Does not ask for the digest. Errors:
/// "sums-damaged".
Result<std::vector<accumulate::PixelRecord>> stored_records(const image::Image& image);

/// True if the records have the digest that the header states.
bool are_records_intact(const image::Image& image);

/// True if the bookkeeping channels have the digest that the header states, or if there are none.
bool are_sums_intact(const image::Image& image);

}  // namespace velatura::layers
