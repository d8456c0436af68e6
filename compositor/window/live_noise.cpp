// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/live_noise.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace velatura::compositor::window {

namespace {

/// Pixels times layers that are done within a tenth of a second or two.
constexpr size_t part_values = 1'500'000;

/// Parts in an order that spreads over the image from the start: a step near the golden section.
size_t scattered(size_t index, size_t count) {
    size_t step = size_t(double(count) * 0.618);
    while (step > 1 && std::gcd(step, count) != 1) --step;
    return index * std::max<size_t>(step, 1) % count;
}

}  // namespace

image::Image rows_of(const image::Image& image, int first, int end) {
    const auto width = size_t(image.data.width()), rows = size_t(end - first);
    image::Image out;
    out.attributes = image.attributes;
    out.data = out.display = {0, 0, int(width), int(rows)};
    for (const image::Part& part : image.parts) {
        image::Part cut;
        cut.name = part.name;
        cut.attributes = part.attributes;
        for (const image::Channel& from : part.channels) {
            image::Channel to = image::Channel::make(from.name, from.type(), width * rows);
            std::visit(
                [&](const auto& values) {
                    auto& kept = std::get<std::decay_t<decltype(values)>>(to.data);
                    std::copy_n(values.data() + size_t(first) * width, width * rows, kept.data());
                },
                from.data);
            cut.channels.push_back(std::move(to));
        }
        out.parts.push_back(std::move(cut));
    }
    return out;
}

mix::MixPlan rows_of(const mix::MixPlan& plan, int width, int first, int end) {
    mix::MixPlan out = plan;
    for (Matte& matte : out.mattes) {
        const float* const begin = matte.values->data() + size_t(first) * size_t(width);
        matte.values = std::make_shared<const std::vector<float>>(
            begin, begin + size_t(end - first) * size_t(width));
    }
    return out;
}

LiveNoise::LiveNoise(const LayerStack& stack) {
    const size_t layers = std::max<size_t>(stack.header().layers.size(), 1);
    const auto height = size_t(std::max(stack.image().data.height(), 1));
    const size_t values = stack.image().data.pixel_count() * layers;
    const size_t wanted = std::max<size_t>((values + part_values - 1) / part_values, 1);
    rows_ = int(std::max<size_t>((height + wanted - 1) / wanted, 1));
    parts_ = (height + size_t(rows_) - 1) / size_t(rows_);
}

void LiveNoise::begin() {
    done_ = 0;
    sum_ = {};
    error_.clear();
}

void LiveNoise::advance(const LayerStack& stack, const mix::MixPlan& plan, const Look& look) {
    constexpr int radius = statistics::Neighborhood::radius;
    const image::Window& window = stack.image().data;
    const int first = int(scattered(done_, parts_)) * rows_,
              end = std::min(first + rows_, window.height());
    const int top = std::max(first - radius, 0), bottom = std::min(end + radius, window.height());
    auto strip = LayerStack::from_image(rows_of(stack.image(), top, bottom));
    if (!strip) {
        error_ = strip.error().message;
        return;
    }
    const auto added = sum_.add(*strip, rows_of(plan, window.width(), top, bottom), look, top,
                                first - top, end - top);
    if (!added) {
        error_ = added.error().message;
        return;
    }
    ++done_;
}

}  // namespace velatura::compositor::window
