// SPDX-License-Identifier: Apache-2.0
#include "compositor/noise/error_map.h"

#include "canvas/color_scale.h"
#include "canvas/false_color.h"
#include "image/box_mean.h"
#include "image/formats.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace velatura::compositor::noise {

namespace {

constexpr float range_stops = 4;  // to either side of the middle

/// A value of the scale, t in [0, 1].
std::string scale_text(double middle, float t) {
    const double percent = 100 * middle * std::exp2(double((2 * t - 1) * range_stops));
    const char* const open = t <= 0 ? "<" : t >= 1 ? ">" : "";
    return percent < 99.5 ? fmt::format("{}{:.2g} %", open, percent)
                          : fmt::format("{}{:.0f} %", open, percent);
}

image::Channel root_of(const char* name, const std::vector<double>& squares) {
    image::Channel channel = image::Channel::make(name, image::ChannelType::Float, squares.size());
    auto& values = std::get<std::vector<float>>(channel.data);
    std::transform(squares.begin(), squares.end(), values.begin(),
                   [](double s) { return float(std::sqrt(s)); });
    return channel;
}

}  // namespace

image::Image error_image(const LayerStack& stack, const MixError& mix) {
    const image::Image& in = stack.image();
    image::Image out;
    out.data = in.data;
    out.display = in.display;
    out.pixel_aspect_ratio = in.pixel_aspect_ratio;
    const size_t pixels = in.data.pixel_count();
    const int width = in.data.width(), height = in.data.height();
    image::Part part;
    part.name = "error";
    std::vector<double> squares(pixels), relative(pixels, 0.0);
    constexpr const char* names[] = {"R", "G", "B"};
    for (size_t c = 0; c < 3; ++c) {
        for (size_t i = 0; i < pixels; ++i) {
            squares[i] = mix.variance(c, i);
            relative[i] += mix.relative_square(c, i) / 3;
        }
        part.channels.push_back(
            root_of(names[c], image::box_mean(squares, width, height, pooling_radius)));
    }
    part.channels.push_back(
        root_of("relative", image::box_mean(relative, width, height, pooling_radius)));
    out.parts.push_back(std::move(part));
    return out;
}

Result<void> write_error_image(const std::string& path, const image::Image& errors, double middle) {
    const image::Window& frame = errors.display;
    std::vector<float> rgb(3 * frame.pixel_count(), 0.0f);
    const image::Channel& relative = *errors.find("relative");
    for (int y = std::max(frame.y0, errors.data.y0); y < std::min(frame.y1, errors.data.y1); ++y) {
        for (int x = std::max(frame.x0, errors.data.x0); x < std::min(frame.x1, errors.data.x1);
             ++x) {
            const double value = double(relative.value(errors.data.index(x, y)));
            if (!(value > 0) || !(middle > 0)) continue;
            const auto stops = float(std::log2(value / middle));
            const auto color =
                canvas::heat(std::clamp(0.5f + stops / (2 * range_stops), 0.0f, 1.0f));
            std::copy(color.begin(), color.end(), &rgb[3 * frame.index(x, y)]);
        }
    }
    std::vector<canvas::ScaleLabel> labels;
    for (const float t : {0.0f, 0.5f, 1.0f}) labels.push_back({t, scale_text(middle, t)});
    const canvas::Canvas map = canvas::with_heat_scale(frame.width(), frame.height(), rgb, labels);
    return image::write_display_image(path, map.width(), map.height(), map.rgb());
}

}  // namespace velatura::compositor::noise
