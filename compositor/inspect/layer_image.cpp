// SPDX-License-Identifier: Apache-2.0
#include "compositor/inspect/layer_image.h"

#include "base/hash.h"
#include "canvas/false_color.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cmath>
#include <set>
#include <string_view>
#include <unordered_map>

namespace velatura::compositor::inspect {

namespace {

using Kind = LayerChannels::Kind;
using Color = std::array<float, 3>;

constexpr std::array<double, 3> luminance_weights = {0.2126, 0.7152, 0.0722};

std::string layer_of(const std::string& channel) {
    const size_t dot = channel.rfind('.');
    if (dot != std::string::npos) return channel.substr(0, dot);
    const bool is_beauty = channel == "R" || channel == "G" || channel == "B" || channel == "A";
    return is_beauty ? "rgba" : channel;
}

/// Of a layer that an earlier part has as well.
std::string name_in_part(const std::string& layer, const std::string& part) {
    return layer == "rgba" ? part : part + "." + layer;
}

std::string suffix_of(const image::Channel& channel) {
    return channel.name.substr(channel.name.rfind('.') + 1);
}

/// R G B, X Y Z …: the order that people expect, which is not the file's.
int rank_of(const image::Channel& channel) {
    static const std::string order = "RGBXYZUVA";
    const std::string suffix = suffix_of(channel);
    const size_t at = suffix.size() == 1 ? order.find(suffix[0]) : std::string::npos;
    return at == std::string::npos ? int(order.size()) : int(at);
}

bool are(const std::vector<const image::Channel*>& channels, std::string_view suffixes) {
    for (size_t c = 0; c < suffixes.size(); ++c) {
        if (c == channels.size() || suffix_of(*channels[c]) != suffixes.substr(c, 1)) return false;
    }
    return true;
}

float finite(float v) {
    return std::isfinite(v) ? v : 0.0f;
}

double luminance(const LayerChannels& layer, size_t pixel) {
    double y = 0;
    for (size_t c = 0; c < 3; ++c)
        y += luminance_weights[c] * double(finite(layer.channels[c]->value(pixel)));
    return y;
}

/// What of a thumbnail's pixel to look at in the layer.
struct Box {
    int x0, y0, x1, y1;
};

Box box_of(const image::Window& frame, int width, int height, int x, int y) {
    const auto part = [](int first, int length, int i, int n) {
        return first + int(int64_t(length) * i / n);
    };
    Box box = {part(frame.x0, frame.width(), x, width), part(frame.y0, frame.height(), y, height),
               part(frame.x0, frame.width(), x + 1, width),
               part(frame.y0, frame.height(), y + 1, height)};
    box.x1 = std::max(box.x1, box.x0 + 1);
    box.y1 = std::max(box.y1, box.y0 + 1);
    return box;
}

/// Means of the channels over a box; of ids and mattes the pixel in its middle. Zero outside the
/// data window.
std::array<float, 3> sampled(const image::Window& data,
                             const LayerChannels& layer,
                             Kind kind,
                             Box box) {
    std::array<double, 3> sums{};
    if (kind == Kind::Ids || kind == Kind::Matte) {
        box.x0 = (box.x0 + box.x1) / 2;
        box.y0 = (box.y0 + box.y1) / 2;
        box.x1 = box.x0 + 1;
        box.y1 = box.y0 + 1;
    }
    const int count = (box.x1 - box.x0) * (box.y1 - box.y0);
    for (int y = std::max(box.y0, data.y0); y < std::min(box.y1, data.y1); ++y) {
        for (int x = std::max(box.x0, data.x0); x < std::min(box.x1, data.x1); ++x) {
            for (size_t c = 0; c < std::min<size_t>(3, layer.channels.size()); ++c)
                sums[c] += double(finite(layer.channels[c]->value(data.index(x, y))));
        }
    }
    return {float(sums[0] / count), float(sums[1] / count), float(sums[2] / count)};
}

Color color_of_id(float id) {
    const uint64_t bits = mix64(uint64_t(double(id)) + 1);
    const auto channel = [bits](int shift) {
        return 0.15f + 0.8f * float((bits >> shift) & 255) / 255.0f;
    };
    return {channel(0), channel(8), channel(16)};
}

struct Range : ValueRange {
    void add(float v) {
        if (!std::isfinite(v) || v == 0.0f) return;
        low = std::min(low, v);
        high = std::max(high, v);
    }

    float share(float v) const {
        return high > low  ? std::clamp((v - low) / (high - low), 0.0f, 1.0f)
               : v == 0.0f ? 0.0f
                           : 1.0f;
    }
};

std::array<Range, 3> ranges_of(const LayerChannels& layer) {
    std::array<Range, 3> ranges;
    for (size_t c = 0; c < std::min<size_t>(3, layer.channels.size()); ++c)
        image::for_each_value(*layer.channels[c], [&](size_t, float v) { ranges[c].add(v); });
    return ranges;
}

Color false_color(Kind kind, const std::array<float, 3>& v, const std::array<Range, 3>& ranges) {
    switch (kind) {
        case Kind::Direction:
            return {0.5f + 0.5f * v[0], 0.5f + 0.5f * v[1], 0.5f + 0.5f * v[2]};
        case Kind::Position:
            return {ranges[0].share(v[0]), ranges[1].share(v[1]), ranges[2].share(v[2])};
        case Kind::Plane:
            return {v[0] - std::floor(v[0]), v[1] - std::floor(v[1]), 0.0f};
        case Kind::Matte: {
            const Color color = color_of_id(float(std::bit_cast<uint32_t>(v[0]) >> 8));
            return {v[1] * color[0], v[1] * color[1], v[1] * color[2]};
        }
        case Kind::Ids:
            return v[0] >= 4294967040.0f ? Color{} : color_of_id(v[0]);
        default:
            return canvas::heat(ranges[0].share(v[0]));
    }
}

}  // namespace

LayerChannels::Kind LayerChannels::kind() const {
    const bool is_whole = channels[0]->type() == image::ChannelType::Uint;
    if (is_whole) return name.find("Id") != std::string::npos ? Kind::Ids : Kind::Scalar;
    const bool is_ranked = name.starts_with("Crypto") && std::isdigit(uint8_t(name.back())) != 0;
    if (is_ranked && channels.size() >= 2) return Kind::Matte;
    if (are(channels, "RGB")) return name == "albedo" ? Kind::Albedo : Kind::Light;
    if (channels.size() == 2) return Kind::Plane;
    // Red, green and alpha are three channels and no color
    if (channels.size() < 3 || suffix_of(*channels[0]) == "R") return Kind::Scalar;
    return name == "N" || name == "Ng" || name == "normal" ? Kind::Direction : Kind::Position;
}

std::vector<LayerChannels> layers_of(const image::Image& image) {
    std::vector<LayerChannels> layers;
    std::set<std::string> names;
    for (const image::Part& part : image.parts) {
        std::unordered_map<std::string, size_t> places;
        for (const image::Channel& channel : part.channels) {
            if (channel.name.starts_with("sums")) continue;
            const std::string name = layer_of(channel.name);
            const auto [at, is_new] = places.try_emplace(name, layers.size());
            if (is_new) {
                const bool is_taken = !names.insert(name).second;
                layers.push_back({is_taken ? name_in_part(name, part.name) : name, {}});
            }
            layers[at->second].channels.push_back(&channel);
        }
    }
    for (LayerChannels& layer : layers) {
        std::stable_sort(layer.channels.begin(), layer.channels.end(),
                         [](const image::Channel* a, const image::Channel* b) {
                             return rank_of(*a) < rank_of(*b);
                         });
    }
    return layers;
}

double mean_luminance(const LayerChannels& layer) {
    double sum = 0;
    for (size_t i = 0; i < layer.channels[0]->size(); ++i) sum += luminance(layer, i);
    return sum / double(layer.channels[0]->size());
}

float fitting_stops(const LayerChannels& layer) {
    std::vector<double> values;
    for (size_t i = 0; i < layer.channels[0]->size(); ++i) {
        const double y = luminance(layer, i);
        if (y > 0) values.push_back(y);
    }
    if (values.empty()) return 0;
    const auto at = values.begin() + std::ptrdiff_t(values.size() * 19 / 20);
    std::nth_element(values.begin(), at, values.end());
    return float(std::log2(0.8 / *at));
}

std::optional<ValueRange> shown_range(const LayerChannels& layer) {
    if (layer.kind() != Kind::Scalar) return std::nullopt;
    const ValueRange range = ranges_of(layer)[0];
    return range.low <= range.high ? std::optional(range) : std::nullopt;
}

std::vector<float> thumbnail(const image::Image& image,
                             const LayerChannels& layer,
                             int width,
                             int height,
                             float stops,
                             const image::DisplayTransform& transform) {
    const Kind kind = layer.kind();
    const bool is_color = kind == Kind::Light || kind == Kind::Albedo;
    const float gain = kind == Kind::Light ? std::exp2(stops) : 1.0f;
    const auto ranges = is_color ? std::array<Range, 3>{} : ranges_of(layer);
    std::vector<float> rgb(3 * size_t(width) * size_t(height));
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const auto v =
                sampled(image.data, layer, kind, box_of(image.display, width, height, x, y));
            const Color color = is_color ? Color{gain * v[0], gain * v[1], gain * v[2]}
                                         : false_color(kind, v, ranges);
            std::copy(color.begin(), color.end(),
                      &rgb[3 * (size_t(y) * size_t(width) + size_t(x))]);
        }
    }
    if (is_color) transform.apply(rgb);
    return rgb;
}

}  // namespace velatura::compositor::inspect
