// SPDX-License-Identifier: Apache-2.0
#include "film/film.h"

#include "accumulate/picked_values.h"
#include "accumulate/pixel_means.h"
#include "base/check.h"
#include "statistics/stated_error.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <tuple>

namespace velatura::film {

namespace {

constexpr size_t logged_bad_samples = 16;

using accumulate::AccumulatorTable;
using accumulate::DenseDyadicSums;
using accumulate::Triple;

Triple triple(const Imath::V3f& v) {
    return {double(v.x), double(v.y), double(v.z)};
}

bool comes_before(const BadSample& a, const BadSample& b) {
    return std::tie(a.sample, a.y, a.x) < std::tie(b.sample, b.y, b.x);
}

/// Why the sample would spoil the image or, by data that is not finite, the data layers.
BadSampleReason fault_of(const SampleRadiance& s) {
    if (const BadSampleReason bad = s.bad_reason(); bad != BadSampleReason::None) return bad;
    if (!std::isfinite(s.weight) || !std::isfinite(s.alpha)) return BadSampleReason::Other;
    if (!s.has_hit) return BadSampleReason::None;
    const bool is_fine = is_finite(s.albedo) && is_finite(s.N) && is_finite(s.P) &&
                         std::isfinite(s.Z) && std::isfinite(s.st.x) && std::isfinite(s.st.y);
    return is_fine ? BadSampleReason::None : BadSampleReason::Other;
}

}  // namespace

PixelAccumulator::PixelAccumulator(const LayerSet& set)
    : table_(set),
      cell_of_(table_.total_count(), 0),
      has_mattes_(set.has_mattes()),
      named_data_(set.named_data),
      picks_(set.picking_filters().size()) {}

inline void PixelAccumulator::put(uint32_t accumulator, const Triple& value) {
    const uint32_t known = cell_of_[accumulator];
    const uint32_t cell = known != 0 ? known - 1 : open_cell(accumulator);
    if (cell < DenseDyadicSums::capacity) {
        // Adding to +0 turns −0 into +0, as the sparse sums do
        dense_.at(cell) += value;
    } else {
        sparse_[cell - DenseDyadicSums::capacity].add(record_.first, record_.end, value);
    }
}

inline void PixelAccumulator::deposit(uint32_t accumulator, double weight, const Triple& value) {
    const Triple weighted{weight * value.x, weight * value.y, weight * value.z};
    put(accumulator, weighted);
    // The even samples make half A
    if (record_.end % 2 != 0) return;
    const uint32_t half = table_.half_of(accumulator);
    if (half != AccumulatorTable::absent) put(half, weighted);
}

uint32_t PixelAccumulator::open_cell(uint32_t accumulator) {
    const size_t cell = used_++;
    if (cell == sums_.size()) {
        sums_.emplace_back();
        if (cell >= DenseDyadicSums::capacity) sparse_.emplace_back();
    }
    if (cell < DenseDyadicSums::capacity) dense_.add_column();
    sums_[cell].accumulator = accumulator;
    cell_of_[accumulator] = uint32_t(used_);
    return uint32_t(cell);
}

void PixelAccumulator::add(const SampleRadiance& s) {
    if (const BadSampleReason fault = fault_of(s); fault != BadSampleReason::None) {
        ++record_.invalid;
        if (bad_.size() < logged_bad_samples)
            bad_.push_back({x_, y_, record_.end, to_string(fault)});
        end_sample();
        return;
    }
    const auto w = double(s.weight);
    for (const uint32_t accumulator : s.touched_)
        deposit(accumulator, w, s.values_[accumulator].sum);
    deposit(AccumulatorTable::coverage, 1.0, {w * double(s.alpha), w, 1.0});
    if (s.has_hit) {
        if (table_.albedo() != AccumulatorTable::absent) {
            deposit(table_.albedo(), w, triple(s.albedo));
            deposit(table_.normal(), w, triple(s.N));
            deposit(table_.position(), w, triple(s.P));
            deposit(table_.surface(), w, {double(s.st.x), double(s.st.y), double(s.Z)});
            deposit(table_.hits(), 1.0, {0.0, w, 1.0});
        }
        if (!record_.has_ids) {
            record_.prim_id = s.prim_id;
            record_.instance_id = s.instance_id;
            record_.has_ids = true;
        }
    }
    if (has_mattes_) add_mattes(s);
    if (!named_data_.empty()) add_named_data(s);
    if (deep_) deep_->add(x_, y_, s);
    end_sample();
}

void PixelAccumulator::add_mattes(const SampleRadiance& s) {
    constexpr size_t looked_back = 8;
    const int64_t weight = accumulate::matte_weight(double(s.weight));
    for (size_t kind = 0; kind < s.matte_ids.size(); ++kind) {
        const uint32_t id = s.matte_ids[kind];
        if (id == 0) continue;
        // Most samples meet what one of the last met; end_pixel joins the rest
        const auto oldest = mattes_.end() - std::ptrdiff_t(std::min(looked_back, mattes_.size()));
        const auto known = std::find_if(
            oldest, mattes_.end(),
            [=](const accumulate::MatteWeight& m) { return m.id == id && m.kind == kind; });
        if (known != mattes_.end())
            known->weight += weight;
        else
            mattes_.push_back({uint8_t(kind), id, weight});
    }
}

void PixelAccumulator::add_named_data(const SampleRadiance& s) {
    const auto w = double(s.weight);
    size_t picked = 0;
    for (size_t i = 0; i < named_data_.size(); ++i) {
        const accumulate::DataLayer& layer = named_data_[i];
        const accumulate::PickedValue& value = s.data[i];
        const size_t pick = picked;
        picked += size_t(!layer.is_summed());
        // A primvar of the scene is no reason to do without the sample's light
        const bool is_sound =
            std::ranges::all_of(value.values, [](float v) { return std::isfinite(v); });
        if (!value.is_there || !is_sound) continue;
        if (!layer.is_summed()) {
            accumulate::pick(layer.filter, picks_[pick], value);
            continue;
        }
        const auto v = [&](size_t k) { return double(value.values[k]); };
        const uint32_t first = table_.named_data(i);
        deposit(first, w, {v(0), v(1), v(2)});
        deposit(first + 1, 1.0, {w * v(3), w, 1.0});
    }
}

void PixelAccumulator::end_sample() {
    dense_.next_sample();
    ++record_.end;
    if (record_.first == 0 && std::has_single_bit(record_.end)) keep_mean();
}

void PixelAccumulator::keep_mean() {
    mean_before_ = last_mean_;
    last_mean_ = accumulate::mean_of(sum_so_far(AccumulatorTable::beauty),
                                     sum_so_far(AccumulatorTable::coverage));
}

/// Of the beauty or the coverage, at a power of two, where there is one node.
Triple PixelAccumulator::sum_so_far(uint32_t accumulator) const {
    return dense_.first(cell_of_[accumulator] - 1);
}

void PixelAccumulator::finish_sparse() {
    const auto nodes = accumulate::DyadicRule(record_.first).nodes(record_.first, record_.end);
    for (size_t i = DenseDyadicSums::capacity; i < used_; ++i) {
        accumulate::SparseDyadicSum& sum = sparse_[i - DenseDyadicSums::capacity];
        sum.finish(record_.first, nodes, sums_[i].nodes);
        sum.clear();
    }
}

Film::Film(const Window& data_window, const LayerSet& set, const FilmOptions& options)
    : sums_(data_window, set, options.final_sample_end),
      bad_mutex_(std::make_unique<std::mutex>()) {}

Film::Film(accumulate::SampleSums sums, std::vector<BadSample> bad)
    : sums_(std::move(sums)), bad_mutex_(std::make_unique<std::mutex>()), bad_(std::move(bad)) {}

void Film::make_deep(const DeepOptions& options) {
    deep_ = std::make_unique<DeepFilm>(window(), options);
}

void Film::begin_pixel(PixelAccumulator& accumulator, int x, int y, uint64_t first_sample) const {
    VELATURA_DCHECK(accumulator.used_ == 0, "end_pixel was not called");
    accumulator.deep_ = deep_.get();
    accumulator.x_ = x;
    accumulator.y_ = y;
    accumulator.record_ = {};
    accumulator.record_.first = accumulator.record_.end = first_sample;
    accumulator.dense_.begin(first_sample);
    // Among the first cells whatever else the samples bring: keep_mean() asks for them
    accumulator.open_cell(AccumulatorTable::beauty);
    accumulator.open_cell(AccumulatorTable::coverage);
}

void Film::end_pixel(PixelAccumulator& a) {
    for (size_t i = 0; i < std::min(a.used_, DenseDyadicSums::capacity); ++i)
        a.dense_.finish(i, a.sums_[i].nodes);
    if (a.used_ > DenseDyadicSums::capacity) a.finish_sparse();
    for (size_t i = 0; i < a.used_; ++i) a.cell_of_[a.sums_[i].accumulator] = 0;
    sums_.append(a.x_, a.y_, a.record_,
                 std::span<const accumulate::NodeSums>(a.sums_.data(), a.used_));
    a.used_ = 0;
    if (a.record_.first == 0 && a.record_.end > 1)
        sums_.set_earlier_mean(a.x_, a.y_,
                               std::has_single_bit(a.record_.end) ? a.mean_before_ : a.last_mean_);
    if (!a.mattes_.empty()) {
        accumulate::join_matte_weights(a.mattes_);
        sums_.mattes()->add(a.x_, a.y_, a.mattes_);
        a.mattes_.clear();
    }
    for (size_t i = 0; i < a.picks_.size(); ++i) {
        sums_.picks()->add(a.x_, a.y_, i, a.picks_[i]);
        a.picks_[i] = {};
    }
    if (a.bad_.empty()) return;

    // Keep the smallest ones, so that the list does not depend on the schedule
    const std::lock_guard lock(*bad_mutex_);
    bad_.insert(bad_.end(), a.bad_.begin(), a.bad_.end());
    std::sort(bad_.begin(), bad_.end(), comes_before);
    if (bad_.size() > logged_bad_samples) bad_.resize(logged_bad_samples);
    a.bad_.clear();
}

NoiseEstimate Film::noise() const {
    const Window& w = window();
    NoiseEstimate result;
    uint64_t samples = 0;
    result.samples_min = ~uint64_t(0);
    for (int y = w.y0; y < w.y1; ++y) {
        for (int x = w.x0; x < w.x1; ++x) {
            const accumulate::PixelRecord& record = sums_.record(x, y);
            const uint64_t own = record.end - record.first;
            result.samples_min = std::min(result.samples_min, own);
            result.samples_max = std::max(result.samples_max, own);
            samples += own;
            result.invalid += record.invalid;
        }
    }
    result.samples_mean = double(samples) / double(w.pixel_count());
    const std::optional<statistics::RelativeError> error = statistics::half_image_error(sums_);
    result.is_known = error.has_value();
    if (error) result.error = *error;
    return result;
}

uint64_t Film::invalid_count() const {
    uint64_t count = 0;
    for (int y = window().y0; y < window().y1; ++y) {
        for (int x = window().x0; x < window().x1; ++x) count += sums_.record(x, y).invalid;
    }
    return count;
}

std::vector<BadSample> Film::bad_samples() const {
    const std::lock_guard lock(*bad_mutex_);
    return bad_;
}

Result<WriteReport> Film::write(const std::string& path, FileInfo info) const {
    info.bad_samples = bad_samples();
    return layers::write_layer_file(path, sums_, info);
}

}  // namespace velatura::film
