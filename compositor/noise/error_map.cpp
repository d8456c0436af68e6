// SPDX-License-Identifier: Apache-2.0
#include "compositor/noise/error_map.h"

#include "canvas/canvas.h"
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

using canvas::Canvas;

constexpr float range_stops = 4;  // to either side of the middle

constexpr int scale_height = 44, bar_height = 14, margin = 6;
constexpr Canvas::Color background = {0.11f, 0.11f, 0.12f}, letters = {0.92f, 0.92f, 0.92f};

/// A value of the scale, t in [0, 1].
std::string scale_label(double middle, float t) {
    const double percent = 100 * middle * std::exp2(double((2 * t - 1) * range_stops));
    const char* const open = t <= 0 ? "<" : t >= 1 ? ">" : "";
    return percent < 99.5 ? fmt::format("{}{:.2g} %", open, percent)
                          : fmt::format("{}{:.0f} %", open, percent);
}

/// The colors, and below them the errors that they mean: a 16th of the middle, the middle and 16
/// times it, and those between where there is space.
void draw_scale(Canvas& canvas, int top, double middle) {
    const int left = margin, width = canvas.width() - 2 * margin, bar = top + margin;
    for (int x = 0; x < width; ++x)
        canvas.fill(left + x, bar, 1, bar_height,
                    canvas::heat(float(x) / float(std::max(width - 1, 1))));
    constexpr float all[] = {0, 0.25f, 0.5f, 0.75f, 1};
    const bool has_space = width >= 5 * 90;
    for (const float t : all) {
        if (!has_space && t != 0 && t != 0.5f && t != 1) continue;
        const std::string text = scale_label(middle, t);
        const int text_width = Canvas::text_width(text);
        const int x = left + int(t * float(width - 1));
        canvas.fill(x, bar + bar_height, 1, 4, letters);
        canvas.write(std::clamp(x - text_width / 2, left, left + width - text_width),
                     bar + bar_height + 6, text_width, text, letters);
    }
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
    Canvas canvas(std::max(frame.width(), min_map_width), frame.height() + scale_height,
                  background);
    canvas.paste(0, 0, frame.width(), frame.height(), rgb);
    draw_scale(canvas, frame.height(), middle);
    return image::write_display_image(path, canvas.width(), canvas.height(), canvas.rgb());
}

}  // namespace velatura::compositor::noise
