// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accumulate/matte_sums.h"
#include "accumulate/sample_sums.h"
#include "film/deep_film.h"
#include "film/layer_set.h"
#include "film/sample_radiance.h"
#include "layers/layer_file.h"
#include "statistics/picture_error.h"

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

namespace velatura::film {

using layers::BadSample;
using layers::FileInfo;
using layers::WriteReport;

/// The sums of one pixel over consecutive samples. One per thread, used again for every pixel.
class PixelAccumulator {
  public:
    explicit PixelAccumulator(const LayerSet& set);

    /// Adds the next sample: begin_pixel's first_sample, then one more each time. Bad samples are
    /// counted, not summed.
    void add(const SampleRadiance& sample);

    uint64_t next_sample() const { return record_.end; }

  private:
    friend class Film;

    void deposit(uint32_t accumulator, double weight, const accumulate::Triple& value);
    void put(uint32_t accumulator, const accumulate::Triple& value);
    uint32_t open_cell(uint32_t accumulator);
    void add_mattes(const SampleRadiance& sample);
    void end_sample();
    void keep_mean();
    accumulate::Triple sum_so_far(uint32_t accumulator) const;
    void finish_sparse();

    accumulate::AccumulatorTable table_;
    int x_ = 0, y_ = 0;
    accumulate::PixelRecord record_;
    accumulate::EarlierMean last_mean_{},
        mean_before_{};              ///< at the last power of two of samples, at the one before
    std::vector<uint32_t> cell_of_;  ///< accumulator → sums_ index + 1; 0 = none
    std::vector<accumulate::NodeSums> sums_;  ///< accumulator per cell; nodes filled by end_pixel
    size_t used_ = 0;
    accumulate::DenseDyadicSums dense_;                ///< of the first cells, one column each
    std::vector<accumulate::SparseDyadicSum> sparse_;  ///< of the others, seldom touched
    std::vector<BadSample> bad_;
    bool has_mattes_;
    std::vector<accumulate::MatteWeight> mattes_;  ///< in the order of the samples
    DeepFilm* deep_ = nullptr;                     ///< of the film, if it is deep
};

/// How noisy the picture is, from its two half images.
struct NoiseEstimate {
    statistics::RelativeError error;  ///< docs/engineering/numerics.md, Error
    uint64_t samples_min = 0, samples_max = 0;
    double samples_mean = 0;
    uint64_t invalid = 0;
    bool is_known = false;  ///< false before every pixel has a sample in each half
};

struct FilmOptions {
    /// No sample of this index or above will ever be added; saves memory for counts that are no
    /// power of two and changes no bit. 0 = unknown; required with FileInfo::store_sums.
    uint64_t final_sample_end = 0;
};

/// Accumulates samples into light layers. The result depends on the samples alone: not on the order
/// of tiles and passes, nor on threads, nor on how the sample range was split. Threads: one pixel
/// belongs to one task and one 16×16 tile (aligned to the data window's corner) to one task at a
/// time; different tiles may be filled at the same time. Reading (snapshot, noise, write) needs all
/// tasks at rest.
class Film {
  public:
    static constexpr int tile_size = accumulate::SampleSums::tile_size;

    Film(const Window& data_window, const LayerSet& set, const FilmOptions& options = {});
    /// A film that goes on from sums that were stored, and from the bad samples found on the way.
    Film(accumulate::SampleSums sums, std::vector<BadSample> bad);

    const Window& window() const { return sums_.window(); }

    const LayerSet& layer_set() const { return sums_.layer_set(); }

    /// Gathers samples by depth as well; before the first.
    void make_deep(const DeepOptions& options);

    /// Null if it does not.
    const DeepFilm* deep() const { return deep_.get(); }

    /// Starts samples first_sample, first_sample + 1, … of a pixel; they must follow what the pixel
    /// has already.
    void begin_pixel(PixelAccumulator& accumulator, int x, int y, uint64_t first_sample) const;
    /// Moves the sums of the accumulator into the film.
    void end_pixel(PixelAccumulator& accumulator);

    /// First sample the pixel does not have yet.
    uint64_t next_sample(int x, int y) const { return sums_.record(x, y).end; }

    /// Keeps a pixel's rate beside its samples. Needs all tasks at rest.
    void set_rate(int x, int y, uint8_t rate) { sums_.set_rate(x, y, rate); }

    NoiseEstimate noise() const;
    uint64_t invalid_count() const;
    /// The first 16 bad samples by pixel and sample index, whatever order they came in.
    std::vector<BadSample> bad_samples() const;

    size_t memory_bytes() const {
        return sums_.memory_bytes() + (deep_ ? deep_->memory_bytes() : 0);
    }

    const accumulate::SampleSums& sums() const { return sums_; }

    /// Writes the file of light layers. Errors as image::write_layer_file; code "closure-failed"
    /// and "verify-failed" end with exit code 4.
    Result<WriteReport> write(const std::string& path, FileInfo info) const;

  private:
    accumulate::SampleSums sums_;
    std::unique_ptr<DeepFilm> deep_;
    mutable std::unique_ptr<std::mutex> bad_mutex_;
    std::vector<BadSample> bad_;
};

}  // namespace velatura::film
