// SPDX-License-Identifier: Apache-2.0
#include "layers/cryptomatte_layers.h"

#include "accumulate/matte_sums.h"
#include "accumulate/pixel_means.h"
#include "base/tasks.h"
#include "image/channel_index.h"
#include "layers/cryptomatte.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <optional>
#include <string_view>

namespace velatura::layers {

namespace {

constexpr std::array<const char*, 4> words = {"kind", "id", "w0", "w1"};

constexpr std::string_view slot_prefix = "sums_matte";
/// Larger than that of any filter: what it divides by is its mean, and no more than a few tenths of
/// it are negative.
constexpr double max_filter_weight = 16;

std::string slot_name(size_t slot, size_t word) {
    return fmt::format("{}{}.{}", slot_prefix, slot, words[word]);
}

/// The channels of every slot, in the order of `words`.
using StoredSlots = std::vector<std::array<const std::vector<uint32_t>*, words.size()>>;

/// Null where one is missing or no such channel.
std::optional<StoredSlots> stored_slots(const image::Image& image) {
    StoredSlots slots;
    size_t count = 0;
    for (const image::Part& part : image.parts) {
        for (const image::Channel& c : part.channels) count += size_t(is_matte_sum(c.name));
    }
    if (count % words.size() != 0) return std::nullopt;
    slots.resize(count / words.size());
    const image::ChannelIndex named(image);
    for (size_t s = 0; s < slots.size(); ++s) {
        for (size_t k = 0; k < words.size(); ++k) {
            const image::Channel* channel = named.find(slot_name(s, k));
            slots[s][k] = channel ? std::get_if<std::vector<uint32_t>>(&channel->data) : nullptr;
            if (!slots[s][k] || slots[s][k]->size() != image.data.pixel_count())
                return std::nullopt;
        }
    }
    return slots;
}

std::vector<float>& floats(image::Channel& channel) {
    return std::get<std::vector<float>>(channel.data);
}

/// Of one Cryptomatte in one pixel whose samples weigh `total`, greatest coverage first.
std::vector<MatteShare> ranked(const std::vector<accumulate::MatteWeight>& list,
                               accumulate::MatteKind kind,
                               double total) {
    std::vector<accumulate::MatteWeight> of_kind;
    for (const accumulate::MatteWeight& m : list) {
        if (m.kind == uint8_t(kind)) of_kind.push_back(m);
    }
    // Weights of both signs: what covers less than nothing counts by how much
    std::sort(of_kind.begin(), of_kind.end(),
              [](const accumulate::MatteWeight& a, const accumulate::MatteWeight& b) {
                  const int64_t wa = std::abs(a.weight), wb = std::abs(b.weight);
                  return wa != wb ? wa > wb : a.id < b.id;
              });
    std::vector<MatteShare> shares;
    for (const accumulate::MatteWeight& m : of_kind)
        shares.push_back({m.id, double(m.weight) * accumulate::MatteWeight::unit / total});
    return shares;
}

void list_layers(const image::Part& part, std::vector<accumulate::LayerEntry>& layers) {
    for (const image::Channel& c : part.channels) {
        const std::string layer = c.name.substr(0, c.name.find('.'));
        if (!layers.empty() && layers.back().name == layer) continue;
        accumulate::LayerEntry entry;
        entry.name = layer;
        entry.family = "cryptomatte";
        entry.part = part.name;
        entry.type = c.type() == image::ChannelType::Half ? "half" : "float";
        layers.push_back(std::move(entry));
    }
}

}  // namespace

image::Part make_matte_part(const std::string& layer, int levels, size_t pixels) {
    image::Part part;
    part.name = layer;
    part.attributes["colorInteropID"] = std::string("data");
    for (const char* c : {".R", ".G", ".B"})
        part.channels.push_back(image::Channel::make(layer + c, image::ChannelType::Half, pixels));
    for (int pair = 0; pair < (levels + 1) / 2; ++pair) {
        for (const char* c : {"R", "G", "B", "A"})
            part.channels.push_back(image::Channel::make(fmt::format("{}{:02}.{}", layer, pair, c),
                                                         image::ChannelType::Float, pixels));
    }
    return part;
}

void store_mattes(std::span<const MatteShare> ranked, int levels, size_t i, image::Part& part) {
    std::array<double, 3> preview{};
    for (size_t rank = 0; rank < ranked.size(); ++rank) {
        const auto& [id, coverage] = ranked[rank];
        // Any three bytes of a hash are a color to tell things apart by
        for (size_t c = 0; c < 3; ++c)
            preview[c] += coverage * double(id >> (8 * c) & 255u) / 255.0;
        if (rank >= size_t(levels)) continue;
        floats(part.channels[3 + 2 * rank])[i] = std::bit_cast<float>(id);
        floats(part.channels[4 + 2 * rank])[i] = float(coverage);
    }
    for (size_t c = 0; c < 3; ++c)
        std::get<std::vector<Imath::half>>(part.channels[c].data)[i] =
            Imath::half(float(preview[c]));
}

void add_cryptomattes(const accumulate::SampleSums& sums,
                      const MatteNames& names,
                      ResolvedLayers& resolved) {
    if (!sums.mattes()) return;
    const image::Window& w = sums.window();
    const int levels = sums.layer_set().matte_levels;
    for (const accumulate::MatteKind kind : accumulate::matte_kinds) {
        if (!sums.layer_set().has_mattes(kind)) continue;
        image::Part part =
            make_matte_part(std::string(accumulate::matte_layer(kind)), levels, w.pixel_count());
        parallel_for(size_t(w.height()), [&](size_t row) {
            const int y = w.y0 + int(row);
            for (int x = w.x0; x < w.x1; ++x) {
                const double weight =
                    accumulate::weight_of(sums.total(x, y, accumulate::AccumulatorTable::coverage));
                if (weight == 0.0) continue;
                store_mattes(ranked(sums.mattes()->at(x, y), kind, weight), levels, w.index(x, y),
                             part);
            }
        });
        list_layers(part, resolved.layers);

        Cryptomatte matte{part.name, {}};
        const std::vector<uint32_t> used = sums.mattes()->used_ids(uint8_t(kind));
        for (const std::string& name : names[size_t(kind)]) {
            const uint32_t id = matte_id(name);
            if (std::binary_search(used.begin(), used.end(), id)) matte.names.push_back({name, id});
        }
        // Readers look at the first part's header, or at that of the part with the channels
        describe_cryptomatte(matte, resolved.image.attributes);
        describe_cryptomatte(matte, part.attributes);
        resolved.image.parts.push_back(std::move(part));
    }
}

void store_matte_sums(const accumulate::MatteSums& mattes,
                      const image::Window& window,
                      image::Part& part) {
    const size_t pixels = window.pixel_count(), first = part.channels.size();
    size_t slots = 0;
    for (int y = window.y0; y < window.y1; ++y) {
        for (int x = window.x0; x < window.x1; ++x) {
            const std::vector<accumulate::MatteWeight> list = mattes.at(x, y);
            for (; slots < list.size(); ++slots) {
                for (size_t k = 0; k < words.size(); ++k)
                    part.channels.push_back(image::Channel::make(slot_name(slots, k),
                                                                 image::ChannelType::Uint, pixels));
            }
            for (size_t s = 0; s < list.size(); ++s) {
                const auto weight = uint64_t(list[s].weight);
                const std::array<uint32_t, 4> values = {list[s].kind, list[s].id, uint32_t(weight),
                                                        uint32_t(weight >> 32)};
                for (size_t k = 0; k < values.size(); ++k) {
                    image::Channel& channel = part.channels[first + 4 * s + k];
                    std::get<std::vector<uint32_t>>(channel.data)[window.index(x, y)] = values[k];
                }
            }
        }
    }
}

bool is_matte_sum(std::string_view channel_name) {
    return channel_name.starts_with(slot_prefix);
}

Result<void> read_matte_sums(const image::Image& image, accumulate::SampleSums& sums) {
    const Error damaged{"sums-damaged", "the stored sums are damaged"};
    const auto slots = stored_slots(image);
    if (!slots) return damaged;
    const image::Window& w = image.data;
    std::vector<accumulate::MatteWeight> list;
    for (int y = w.y0; y < w.y1; ++y) {
        for (int x = w.x0; x < w.x1; ++x) {
            const size_t i = w.index(x, y);
            const accumulate::PixelRecord& record = sums.record(x, y);
            // So that no sum of all samples that a file can number overflows
            std::array<int64_t, accumulate::matte_kinds.size()> left{};
            left.fill(int64_t(record.end - record.first) *
                      accumulate::matte_weight(max_filter_weight));
            list.clear();
            for (const auto& slot : *slots) {
                const auto weight =
                    int64_t(uint64_t((*slot[2])[i]) | uint64_t((*slot[3])[i]) << 32);
                const uint32_t kind = (*slot[0])[i];
                if (weight == 0) continue;
                if (kind >= accumulate::matte_kinds.size() || weight > left[kind] ||
                    weight < -left[kind])
                    return damaged;
                left[kind] -= std::abs(weight);
                list.push_back({uint8_t(kind), (*slot[1])[i], weight});
            }
            accumulate::join_matte_weights(list);
            sums.mattes()->add(x, y, list);
        }
    }
    return {};
}

}  // namespace velatura::layers
