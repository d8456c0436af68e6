// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/live_noise.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace velatura::compositor::window {

namespace {

/// Pixels times layers that are done within a tenth of a second or two.
constexpr size_t part_values = 1'500'000;

/// Parts in an order that spreads over the picture from the start: a step near the golden section.
size_t scattered(size_t index, size_t count) {
    size_t step = size_t(double(count) * 0.618);
    while (step > 1 && std::gcd(step, count) != 1) --step;
    return index * std::max<size_t>(step, 1) % count;
}

void add_rows(std::vector<RowNoise>& sums, const std::vector<RowNoise>& rows, double weight) {
    for (const RowNoise& row : rows) {
        const auto at = std::find_if(sums.begin(), sums.end(),
                                     [&](const RowNoise& s) { return s.name == row.name; });
        RowNoise& sum = at == sums.end() ? sums.emplace_back(RowNoise{row.name, 0}) : *at;
        sum.share += row.share * weight;
    }
}

std::vector<RowNoise> shares(std::vector<RowNoise> rows, double whole) {
    for (RowNoise& row : rows) row.share = whole > 0 ? row.share / whole : 0;
    std::stable_sort(rows.begin(), rows.end(),
                     [](const RowNoise& a, const RowNoise& b) { return a.share > b.share; });
    return rows;
}

}  // namespace

image::Image every_nth_row(const image::Image& image, size_t first, size_t step) {
    const auto width = size_t(image.data.width()), height = size_t(image.data.height());
    const size_t rows = (height - first + step - 1) / step;
    image::Image out;
    out.attributes = image.attributes;
    out.data = out.display = {0, 0, int(width), int(rows)};
    for (const image::Part& part : image.parts) {
        image::Part thinned;
        thinned.name = part.name;
        thinned.attributes = part.attributes;
        for (const image::Channel& from : part.channels) {
            image::Channel to = image::Channel::make(from.name, from.type(), width * rows);
            std::visit(
                [&](const auto& values) {
                    auto& thin = std::get<std::decay_t<decltype(values)>>(to.data);
                    for (size_t r = 0; r < rows; ++r) {
                        const auto* row = values.data() + (first + r * step) * width;
                        std::copy(row, row + width, thin.data() + r * width);
                    }
                },
                from.data);
            thinned.channels.push_back(std::move(to));
        }
        out.parts.push_back(std::move(thinned));
    }
    return out;
}

MixPlan every_nth_row(const MixPlan& plan, const image::Window& window, size_t first, size_t step) {
    const auto width = size_t(window.width()), height = size_t(window.height());
    MixPlan out = plan;
    for (Matte& matte : out.mattes) {
        std::vector<float> rows;
        for (size_t y = first; y < height; y += step) {
            const float* row = matte.values->data() + y * width;
            rows.insert(rows.end(), row, row + width);
        }
        matte.values = std::make_shared<const std::vector<float>>(std::move(rows));
    }
    return out;
}

LiveNoise::LiveNoise(const LayerStack& stack) {
    const size_t layers = std::max<size_t>(stack.header().layers.size(), 1);
    const auto height = size_t(std::max(stack.image().data.height(), 1));
    const size_t values = stack.image().data.pixel_count() * layers;
    parts_ = std::clamp<size_t>((values + part_values - 1) / part_values, 1, height);
}

void LiveNoise::begin() {
    done_ = 0;
    pixels_ = rendered_ = mix_ = 0;
    groups_.clear();
    bounces_.clear();
    error_.clear();
}

void LiveNoise::advance(const LayerStack& stack, const MixPlan& plan, const Look& look) {
    const size_t first = scattered(done_, parts_);
    auto rows = LayerStack::from_image(every_nth_row(stack.image(), first, parts_));
    const Result<NoiseForecast> forecast =
        rows ? forecast_noise(*rows, every_nth_row(plan, stack.image().data, first, parts_), look)
             : Result<NoiseForecast>(rows.error());
    if (!forecast) {
        error_ = forecast.error().message;
        return;
    }
    const auto pixels = double(rows->image().data.pixel_count());
    const double square = forecast->mix.value * forecast->mix.value * pixels;
    pixels_ += pixels;
    rendered_ += forecast->rendered.value * forecast->rendered.value * pixels;
    mix_ += square;
    add_rows(groups_, forecast->groups, square);
    add_rows(bounces_, forecast->bounces, square);
    ++done_;
}

double LiveNoise::rendered() const {
    return pixels_ > 0 ? std::sqrt(rendered_ / pixels_) : 0;
}

double LiveNoise::mix() const {
    return pixels_ > 0 ? std::sqrt(mix_ / pixels_) : 0;
}

std::vector<RowNoise> LiveNoise::groups() const {
    return shares(groups_, mix_);
}

std::vector<RowNoise> LiveNoise::bounces() const {
    return shares(bounces_, mix_);
}

}  // namespace velatura::compositor::window
