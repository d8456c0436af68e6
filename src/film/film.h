// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accumulate/matte_sums.h"
#include "accumulate/sample_sums.h"
#include "film/deep_film.h"
#include "film/layer_set.h"
#include "film/sample_radiance.h"
#include "layers/layer_file.h"
#include "statistics/hidden_light.h"
#include "statistics/image_error.h"

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

namespace velatura::film {

using layers::BadSample;
using layers::FileInfo;
using layers::WriteReport;

/// Sums of one pixel over consecutive samples. One per thread, reused for every pixel: between
/// Film::begin_pixel() and Film::end_pixel() it belongs to one pixel.
class PixelAccumulator {
  public:
    explicit PixelAccumulator(const LayerSet& set);

    /// Adds the next sample: first_sample of begin_pixel(), then one more each time. Bad samples
    /// (not finite, negative, out of range) are counted and skipped.
    void add(const SampleRadiance& sample);

    /// Index of the sample that the next add() takes.
    uint64_t next_sample() const { return record_.end; }

  private:
    friend class Film;

    void deposit(uint32_t accumulator, double weight, const accumulate::Triple& value);
    void put(uint32_t accumulator, const accumulate::Triple& value);
    uint32_t open_cell(uint32_t accumulator);
    void add_mattes(const SampleRadiance& sample);
    void add_named_data(const SampleRadiance& sample);
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
    std::vector<accumulate::DataLayer> named_data_;
    std::vector<accumulate::PickedValue> picks_;   ///< of those named data layers that are not sums
    std::vector<accumulate::MatteWeight> mattes_;  ///< in the order of the samples
    DeepFilm* deep_ = nullptr;                     ///< of the film, if it is deep
};

/// Noise of the image, estimated from its two half images.
struct NoiseEstimate {
    statistics::RelativeError error;            ///< √relMSE (docs/engineering/numerics.md, Error)
    uint64_t samples_min = 0, samples_max = 0;  ///< per pixel
    double samples_mean = 0;                    ///< spp
    uint64_t invalid = 0;                       ///< bad samples of all pixels
    bool is_known = false;  ///< false before every pixel has a sample in each half
};

/// What a Film can know before its first sample.
struct FilmOptions {
    /// Upper bound of sample indices, exclusive. Saves memory for counts that are no power of two
    /// and changes no bit. 0 = unknown; required with FileInfo::store_sums.
    uint64_t final_sample_end = 0;
};

/// Accumulates samples into light layers.
///
/// Result:  a function of the samples alone: independent of the order of tiles and passes, of
///          threads, and of how the range of samples is split among films that are merged.
/// Shape:   pixels of window(), origin top left; tiles of 16×16 pixels, aligned to its corner.
/// Units:   scene-linear radiance, premultiplied by alpha; memory in bytes.
/// Threads: different tiles can be filled at the same time; a tile, and a pixel, belongs to one
///          task at a time. "At rest" below: no task fills the film.
/// Ref:     docs/adr/0003-dyadic-sums.md.
class Film {
  public:
    static constexpr int tile_size = accumulate::SampleSums::tile_size;

    // Construction

    /// An empty film.
    Film(const Window& data_window, const LayerSet& set, const FilmOptions& options = {});

    /// Resumes from stored sums and the bad samples that were found so far.
    Film(accumulate::SampleSums sums, std::vector<BadSample> bad);

    /// Accumulates a deep image as well. Before the first sample.
    void make_deep(const DeepOptions& options);

    // Filling. Each pixel: begin_pixel(), PixelAccumulator::add() …, end_pixel()

    /// Starts samples first_sample, first_sample + 1, … of the pixel (x, y) of the window.
    /// They must follow those that the pixel has.
    void begin_pixel(PixelAccumulator& accumulator, int x, int y, uint64_t first_sample) const;

    /// Moves the sums of the accumulator into the film.
    void end_pixel(PixelAccumulator& accumulator);

    /// Light that samples may find too seldom to show its noise, as a trial says. At rest.
    void set_hidden_light(const statistics::HiddenLight& light) { hidden_ = light; }

    const statistics::HiddenLight& hidden_light() const { return hidden_; }

    /// Index of the first sample that the pixel lacks.
    uint64_t next_sample(int x, int y) const { return sums_.record(x, y).end; }

    /// Stores the sampling rate of a pixel with its samples. At rest.
    void set_rate(int x, int y, uint8_t rate) { sums_.set_rate(x, y, rate); }

    // Reading. At rest, except for window() and layer_set()

    /// Pixels that are rendered: the EXR data window.
    const Window& window() const { return sums_.window(); }

    const LayerSet& layer_set() const { return sums_.layer_set(); }

    NoiseEstimate noise() const;

    /// Number of bad samples.
    uint64_t invalid_count() const;

    /// The first 16 bad samples by pixel and sample index, in whatever order they came.
    std::vector<BadSample> bad_samples() const;

    /// Samples by depth; null without make_deep().
    const DeepFilm* deep() const { return deep_.get(); }

    /// The sums themselves, for merging and resuming.
    const accumulate::SampleSums& sums() const { return sums_; }

    size_t memory_bytes() const {
        return sums_.memory_bytes() + (deep_ ? deep_->memory_bytes() : 0);
    }

    /// Writes the EXR of light layers (docs/reference/layers.md).
    /// Errors: those of layers::write_layer_file; "closure-failed" (layers do not sum to the
    ///         beauty) and "verify-failed" (the written file differs) are exit code 4.
    Result<WriteReport> write(const std::string& path, FileInfo info) const;

  private:
    accumulate::SampleSums sums_;
    statistics::HiddenLight hidden_;
    std::unique_ptr<DeepFilm> deep_;
    mutable std::unique_ptr<std::mutex> bad_mutex_;
    std::vector<BadSample> bad_;
};

}  // namespace velatura::film
