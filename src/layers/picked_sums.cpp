// SPDX-License-Identifier: Apache-2.0
#include "layers/picked_sums.h"

#include "accumulate/picked_values.h"
#include "image/channel_index.h"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <cmath>
#include <string>
#include <vector>

namespace velatura::layers {

namespace {

constexpr std::array<const char*, 6> words = {"there", "z", "v0", "v1", "v2", "v3"};
constexpr std::string_view prefix = "sums_pick";

std::string channel_name(size_t layer, size_t word) {
    return fmt::format("{}{}.{}", prefix, layer, words[word]);
}

std::array<uint32_t, 6> words_of(const accumulate::PickedValue& value) {
    std::array<uint32_t, 6> out = {};
    if (!value.is_there) return out;
    out[0] = 1;
    out[1] = std::bit_cast<uint32_t>(value.depth);
    for (size_t k = 0; k < value.values.size(); ++k)
        out[2 + k] = std::bit_cast<uint32_t>(value.values[k]);
    return out;
}

}  // namespace

void store_picked_values(const accumulate::SampleSums& sums, image::Part& part) {
    const image::Window& w = sums.window();
    for (size_t layer = 0; layer < sums.picks()->filters().size(); ++layer) {
        std::array<std::vector<uint32_t>, words.size()> values;
        for (auto& v : values) v.resize(w.pixel_count());
        for (int y = w.y0; y < w.y1; ++y) {
            for (int x = w.x0; x < w.x1; ++x) {
                const auto split = words_of(sums.picks()->at(x, y, layer));
                for (size_t k = 0; k < split.size(); ++k) values[k][w.index(x, y)] = split[k];
            }
        }
        for (size_t k = 0; k < words.size(); ++k) {
            image::Channel channel;
            channel.name = channel_name(layer, k);
            channel.data = std::move(values[k]);
            part.channels.push_back(std::move(channel));
        }
    }
}

bool is_picked_value(std::string_view name) {
    return name.starts_with(prefix);
}

Result<void> read_picked_values(const image::Image& image, accumulate::SampleSums& sums) {
    const Error damaged{"sums-damaged", "the stored sums are damaged"};
    const image::ChannelIndex named(image);
    const image::Window& w = image.data;
    for (size_t layer = 0; layer < sums.picks()->filters().size(); ++layer) {
        std::array<const std::vector<uint32_t>*, words.size()> values{};
        for (size_t k = 0; k < words.size(); ++k) {
            const image::Channel* channel = named.find(channel_name(layer, k));
            values[k] = channel ? std::get_if<std::vector<uint32_t>>(&channel->data) : nullptr;
            if (!values[k] || values[k]->size() != w.pixel_count()) return damaged;
        }
        for (int y = w.y0; y < w.y1; ++y) {
            for (int x = w.x0; x < w.x1; ++x) {
                const size_t i = w.index(x, y);
                if ((*values[0])[i] == 0) continue;
                accumulate::PickedValue value;
                value.is_there = true;
                value.depth = std::bit_cast<float>((*values[1])[i]);
                for (size_t k = 0; k < value.values.size(); ++k) {
                    value.values[k] = std::bit_cast<float>((*values[2 + k])[i]);
                    if (!std::isfinite(value.values[k])) return damaged;
                }
                if (std::isnan(value.depth)) return damaged;
                sums.picks()->add(x, y, layer, value);
            }
        }
    }
    return {};
}

}  // namespace velatura::layers
