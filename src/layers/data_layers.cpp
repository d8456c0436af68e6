// SPDX-License-Identifier: Apache-2.0
#include "layers/data_layers.h"

#include "accumulate/pixel_means.h"
#include "statistics/image_change.h"

#include <algorithm>
#include <initializer_list>
#include <limits>

namespace velatura::layers {

namespace {

/// The channels of a layer once more, under another name.
void add_alias(const accumulate::DataAlias& alias,
               image::Part& part,
               std::vector<accumulate::LayerEntry>& layers) {
    const auto known = std::find_if(
        layers.begin(), layers.end(),
        [&](const accumulate::LayerEntry& e) { return e.name == alias.of && e.part == part.name; });
    if (known == layers.end()) return;
    accumulate::LayerEntry entry = *known;
    entry.name = alias.name;
    layers.push_back(std::move(entry));
    const size_t count = part.channels.size();
    for (size_t i = 0; i < count; ++i) {
        const std::string& name = part.channels[i].name;
        const size_t dot = std::min(name.find('.'), name.size());
        if (name.substr(0, dot) != alias.of) continue;
        image::Channel copy = part.channels[i];
        copy.name = alias.name + name.substr(dot);
        part.channels.push_back(std::move(copy));
    }
}

/// Of the beauty's mean, per channel: from its halves where they were asked for, else from how it
/// changed at last.
std::array<double, 3> variance_of(const accumulate::SampleSums& sums, int x, int y) {
    const std::optional<statistics::PixelChange> change =
        sums.layer_set().halves ? std::nullopt : statistics::pixel_change(sums, x, y);
    if (!change)
        return accumulate::resolve_halves(sums, x, y, accumulate::AccumulatorTable::beauty)
            .variance;
    std::array<double, 3> variance = change->square;
    for (double& v : variance)
        v *= statistics::net_factor(statistics::usual_slope) *
             statistics::net_factor(statistics::usual_slope);
    return variance;
}

}  // namespace

image::Part data_part(const accumulate::SampleSums& sums,
                      std::vector<accumulate::LayerEntry>& layers) {
    const accumulate::AccumulatorTable& table = sums.table();
    const image::Window& window = sums.window();
    image::Part part;
    part.name = "data";
    part.attributes["colorInteropID"] = std::string("data");
    const size_t pixels = window.pixel_count();
    const auto add = [&](const char* layer, std::initializer_list<const char*> suffixes,
                         image::ChannelType type) {
        accumulate::LayerEntry entry;
        entry.name = layer;
        entry.family = "data";
        entry.part = part.name;
        entry.type = type == image::ChannelType::Uint ? "uint" : "float";
        layers.push_back(entry);
        const size_t first = part.channels.size();
        for (const char* suffix : suffixes) {
            part.channels.push_back(
                image::Channel::make(std::string(layer) + suffix, type, pixels));
        }
        return first;
    };
    const size_t albedo = add("albedo", {".R", ".G", ".B"}, image::ChannelType::Float);
    const size_t normal = add("N", {".X", ".Y", ".Z"}, image::ChannelType::Float);
    const size_t position = add("P", {".X", ".Y", ".Z"}, image::ChannelType::Float);
    const size_t depth = add("Z", {""}, image::ChannelType::Float);
    const size_t st = add("st", {".U", ".V"}, image::ChannelType::Float);
    const size_t prim = add("primId", {""}, image::ChannelType::Uint);
    const size_t instance = add("instanceId", {""}, image::ChannelType::Uint);
    const size_t count = add("sampleCount", {""}, image::ChannelType::Uint);
    const size_t variance = add("variance", {""}, image::ChannelType::Float);
    const size_t invalid = add("invalid", {""}, image::ChannelType::Uint);

    // Radiance may be so large that its variance is more than a float holds
    static constexpr double largest = double(std::numeric_limits<float>::max());
    const auto set_float = [&part](size_t channel, size_t i, double sum, double weight) {
        std::get<std::vector<float>>(part.channels[channel].data)[i] =
            weight == 0.0 ? 0.0f : float(std::clamp(sum / weight, -largest, largest));
    };
    const auto set_triple = [&set_float](size_t first, size_t i, const accumulate::Triple& sum,
                                         double weight) {
        set_float(first, i, sum.x, weight);
        set_float(first + 1, i, sum.y, weight);
        set_float(first + 2, i, sum.z, weight);
    };
    const auto set_uint = [&part](size_t channel, size_t i, uint32_t v) {
        std::get<std::vector<uint32_t>>(part.channels[channel].data)[i] = v;
    };
    accumulate::for_each_row(window, [&](int y) {
        for (int x = window.x0; x < window.x1; ++x) {
            const size_t i = window.index(x, y);
            const accumulate::Triple coverage =
                sums.total(x, y, accumulate::AccumulatorTable::coverage);
            const double all = accumulate::weight_of(coverage);
            // Color and normal blend with nothing at silhouettes; positions are means over what
            // was hit
            const double hit = accumulate::weight_of(sums.total(x, y, table.hits()));
            set_triple(albedo, i, sums.total(x, y, table.albedo()), all);
            set_triple(normal, i, sums.total(x, y, table.normal()), all);
            set_triple(position, i, sums.total(x, y, table.position()), hit);
            const accumulate::Triple surface = sums.total(x, y, table.surface());
            set_float(st, i, surface.x, hit);
            set_float(st + 1, i, surface.y, hit);
            set_float(depth, i, surface.z, hit);
            const accumulate::PixelRecord& record = sums.record(x, y);
            set_uint(prim, i, record.prim_id);
            set_uint(instance, i, record.instance_id);
            set_uint(count, i, uint32_t(coverage.z));
            set_uint(invalid, i, record.invalid);
            const std::array<double, 3> v = variance_of(sums, x, y);
            set_float(variance, i, v[0] + v[1] + v[2], 3.0);
        }
    });
    for (const accumulate::DataAlias& alias : sums.layer_set().data_aliases)
        add_alias(alias, part, layers);
    return part;
}

}  // namespace velatura::layers
