// SPDX-License-Identifier: Apache-2.0
#include "statistics/layer_changes.h"

#include "accumulate/pixel_means.h"
#include "statistics/image_change.h"
#include "statistics/relative_error.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <iterator>

namespace velatura::statistics {

namespace {

constexpr int step = 4;  // pixels, both ways

std::vector<accumulate::LayerSource> sources_of(const accumulate::SampleSums& sums) {
    const accumulate::LayerSet& set = sums.layer_set();
    std::vector<accumulate::LayerSource> sources;
    const auto add = [&sources](std::vector<accumulate::LayerSource> more) {
        sources.insert(sources.end(), std::make_move_iterator(more.begin()),
                       std::make_move_iterator(more.end()));
    };
    if (set.bounce_layers || set.has_cells()) add(accumulate::bounce_sources(set, sums.table()));
    if (set.group_layers || set.has_cells()) add(accumulate::group_sources(set, sums.table()));
    add(accumulate::path_sources(set, sums.table(), "lobes"));
    return sources;
}

}  // namespace

LayerChanges::LayerChanges(const accumulate::SampleSums& sums) : sources_(sources_of(sums)) {
    if (sources_.empty()) return;
    const image::Window& w = sums.window();
    for (int y = w.y0 + std::min(step, w.height()) / 2; y < w.y1; y += step)
        for (int x = w.x0 + std::min(step, w.width()) / 2; x < w.x1; x += step)
            pixels_.push_back({x, y});
    means_.resize(3 * pixels_.size() * sources_.size());
    squares_.resize(pixels_.size() * sources_.size());
}

accumulate::Triple LayerChanges::mean_of_layer(const accumulate::SampleSums& sums,
                                               const Pixel& pixel,
                                               const accumulate::LayerSource& source,
                                               double weight) const {
    accumulate::Triple sum;
    if (weight == 0.0) return sum;
    for (const uint32_t a : source.plus) sum += sums.total(pixel.x, pixel.y, a);
    return {sum.x / weight, sum.y / weight, sum.z / weight};
}

void LayerChanges::keep(const accumulate::SampleSums& sums) {
    for (size_t p = 0; p < pixels_.size(); ++p) {
        Pixel& pixel = pixels_[p];
        const accumulate::PixelRecord& record = sums.record(pixel.x, pixel.y);
        if (record.first != 0 || !std::has_single_bit(record.end) || record.end == pixel.kept)
            continue;
        pixel.kept = record.end;
        const double weight = accumulate::weight_of(
            sums.total(pixel.x, pixel.y, accumulate::AccumulatorTable::coverage));
        for (size_t s = 0; s < sources_.size(); ++s) {
            const accumulate::Triple mean = mean_of_layer(sums, pixel, sources_[s], weight);
            float* kept = &means_[3 * (p * sources_.size() + s)];
            kept[0] = float(mean.x);
            kept[1] = float(mean.y);
            kept[2] = float(mean.z);
        }
    }
}

void LayerChanges::observe(const accumulate::SampleSums& sums) {
    for (size_t p = 0; p < pixels_.size(); ++p) {
        Pixel& pixel = pixels_[p];
        const accumulate::PixelRecord& record = sums.record(pixel.x, pixel.y);
        if (pixel.kept == 0 || !std::has_single_bit(record.end) || record.end < 2 * pixel.kept)
            continue;
        pixel.is_known = true;
        const double times = double(record.end - pixel.kept) / double(pixel.kept);
        const double weight = accumulate::weight_of(
            sums.total(pixel.x, pixel.y, accumulate::AccumulatorTable::coverage));
        const std::array<double, 3> base = error_base(sums, pixel.x, pixel.y);
        for (size_t s = 0; s < sources_.size(); ++s) {
            const accumulate::Triple mean = mean_of_layer(sums, pixel, sources_[s], weight);
            const std::array<double, 3> now = {mean.x, mean.y, mean.z};
            double square = 0;
            for (size_t c = 0; c < 3; ++c) {
                const double change = now[c] - double(means_[3 * (p * sources_.size() + s) + c]);
                square += relative_square(change * change / times, base[c]) / 3;
            }
            squares_[p * sources_.size() + s] = float(square);
        }
    }
}

std::vector<LayerNoise> LayerChanges::noise(double slope) const {
    std::vector<LayerNoise> layers;
    if (!std::all_of(pixels_.begin(), pixels_.end(), [](const Pixel& p) { return p.is_known; }) ||
        pixels_.empty())
        return layers;
    for (size_t s = 0; s < sources_.size(); ++s) {
        double sum = 0;
        for (size_t p = 0; p < pixels_.size(); ++p)
            sum += double(squares_[p * sources_.size() + s]);
        layers.push_back(
            {sources_[s].entry.name, net_factor(slope) * std::sqrt(sum / double(pixels_.size()))});
    }
    return layers;
}

}  // namespace velatura::statistics
