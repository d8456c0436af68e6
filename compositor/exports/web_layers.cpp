// SPDX-License-Identifier: Apache-2.0
#include "compositor/exports/web_layers.h"

#include "base/base64.h"
#include "base/tasks.h"
#include "compositor/exports/web_pack.h"
#include "compositor/io/row_values.h"

#include <Imath/half.h>

#include <algorithm>
#include <atomic>
#include <cmath>

namespace velatura::compositor::exports {

namespace {

constexpr float largest_half = 65504;
constexpr double smallest_scale = 1.0 / 32;

/// What one pixel of the smaller row or column takes of the larger one.
struct Share {
    size_t first = 0;
    std::vector<float> weights;
};

std::vector<Share> shares(int from, int to) {
    std::vector<Share> all(size_t(to), Share{});
    const double step = double(from) / to;
    for (size_t i = 0; i < all.size(); ++i) {
        const double begin = double(i) * step, end = std::min(begin + step, double(from));
        all[i].first = size_t(begin);
        for (auto k = all[i].first; double(k) < end - 1e-9; ++k)
            all[i].weights.push_back(
                float((std::min(end, double(k + 1)) - std::max(begin, double(k))) / step));
    }
    return all;
}

WebSize size_of(const LayerStack& stack) {
    return {stack.image().display.width(), stack.image().display.height()};
}

WebSize scaled(WebSize size, double scale) {
    const auto side = [&](int s) { return std::max(1, int(std::lround(s * scale))); };
    return {side(size.width), side(size.height)};
}

std::vector<uint16_t> halves_of(const std::vector<float>& rgb, size_t& clamped) {
    std::vector<uint16_t> halves(rgb.size());
    for (size_t i = 0; i < rgb.size(); ++i) {
        const float v = std::clamp(rgb[i], -largest_half, largest_half);
        clamped += v != rgb[i];
        halves[i] = Imath::half(v).bits();
    }
    return halves;
}

/// One row of 16 in eight: what the whole takes, within some percent.
size_t estimated_bytes(const LayerStack& stack, std::span<const std::string> layers) {
    constexpr int band = 16, every = 8;
    const WebSize size = size_of(stack);
    const auto row = 3 * size_t(size.width);
    std::atomic<size_t> bytes = 0;
    parallel_for(layers.size(), [&](size_t i) {
        const std::vector<float> all = window_of(stack, layers[i]);
        std::vector<float> some;
        for (int y = 0; y < size.height; ++y) {
            if (size.height >= band * every && y / band % every != every / 2) continue;
            const auto begin = all.begin() + std::ptrdiff_t(size_t(y) * row);
            some.insert(some.end(), begin, begin + std::ptrdiff_t(row));
        }
        size_t clamped = 0;
        const int rows = int(some.size() / row);
        const std::string packed = pack_planes(halves_of(some, clamped), size.width, rows);
        bytes += size_t(double(packed.size()) * 4 / 3 * size.height / rows);
    });
    return bytes;
}

WebLayers layers_of(const LayerStack& stack, std::span<const std::string> layers, WebSize size) {
    WebLayers made;
    made.size = size;
    made.halves.resize(layers.size());
    made.packed.resize(layers.size());
    std::atomic<size_t> clamped = 0;
    parallel_for(layers.size(), [&](size_t i) {
        size_t beyond = 0;
        made.halves[i] =
            halves_of(scaled_down(window_of(stack, layers[i]), size_of(stack), size), beyond);
        made.packed[i] = to_base64(pack_planes(made.halves[i], size.width, size.height));
        clamped += beyond;
    });
    made.clamped = clamped;
    for (const std::string& packed : made.packed) made.bytes += packed.size();
    return made;
}

}  // namespace

std::vector<float> window_of(const LayerStack& stack, const std::string& layer) {
    const image::Window& frame = stack.image().display;
    const image::Window& data = stack.image().data;
    const image::Window both = {std::max(frame.x0, data.x0), std::max(frame.y0, data.y0),
                                std::min(frame.x1, data.x1), std::min(frame.y1, data.y1)};
    std::vector<float> rgb(3 * frame.pixel_count(), 0.0f);
    if (both.is_empty()) return rgb;
    std::vector<float> row(size_t(both.width()));
    for (size_t c = 0; c < 3; ++c) {
        const image::Channel* channel = stack.channel(layer, c);
        if (!channel) continue;
        for (int y = both.y0; y < both.y1; ++y) {
            load_row({channel->type(), channel->bytes()}, data.index(both.x0, y), row.size(),
                     row.data());
            const size_t first = frame.index(both.x0, y);
            for (size_t i = 0; i < row.size(); ++i) rgb[3 * (first + i) + c] = row[i];
        }
    }
    return rgb;
}

std::vector<float> scaled_down(const std::vector<float>& rgb, WebSize from, WebSize to) {
    if (from == to) return rgb;
    const std::vector<Share> columns = shares(from.width, to.width),
                             rows = shares(from.height, to.height);
    const auto old_row = 3 * size_t(from.width), new_row = 3 * size_t(to.width);
    std::vector<float> out(new_row * size_t(to.height), 0.0f), line(old_row);
    for (size_t y = 0; y < rows.size(); ++y) {
        std::fill(line.begin(), line.end(), 0.0f);
        for (size_t k = 0; k < rows[y].weights.size(); ++k) {
            const float* source = rgb.data() + (rows[y].first + k) * old_row;
            for (size_t i = 0; i < old_row; ++i) line[i] += rows[y].weights[k] * source[i];
        }
        float* sums = out.data() + y * new_row;
        for (size_t x = 0; x < columns.size(); ++x) {
            for (size_t k = 0; k < columns[x].weights.size(); ++k) {
                const float* pixel = line.data() + 3 * (columns[x].first + k);
                for (size_t c = 0; c < 3; ++c) sums[3 * x + c] += columns[x].weights[k] * pixel[c];
            }
        }
    }
    return out;
}

WebLayers fitted_layers(const LayerStack& stack,
                        std::span<const std::string> layers,
                        size_t max_bytes) {
    const WebSize full = size_of(stack);
    const auto scale_for = [&](double scale, size_t bytes) {
        // A little less, as smaller images are harder to predict
        return std::min(
            1.0, scale * std::sqrt(0.98 * double(max_bytes) / double(std::max<size_t>(bytes, 1))));
    };
    double scale = scale_for(1.0, estimated_bytes(stack, layers));
    WebLayers best;
    constexpr int tries = 6;
    for (int t = 0; t < tries && scale >= smallest_scale; ++t) {
        const WebSize size = scaled(full, scale);
        if (!best.packed.empty() && size.width <= best.size.width) break;
        WebLayers made = layers_of(stack, layers, size);
        const bool fits = made.bytes <= max_bytes;
        const double next = scale_for(scale, made.bytes);
        // What is left over counts only where it makes a difference
        const bool is_enough = size == full || made.bytes > max_bytes / 100 * 92;
        if (fits) best = std::move(made);
        if (fits && is_enough) break;
        scale = fits ? next : std::min(next, 0.98 * scale);
    }
    return best;
}

}  // namespace velatura::compositor::exports
