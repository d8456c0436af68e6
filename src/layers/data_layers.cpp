// SPDX-License-Identifier: Apache-2.0
#include "layers/data_layers.h"

#include "accumulate/picked_values.h"
#include "accumulate/pixel_means.h"
#include "layers/layer_planes.h"
#include "statistics/image_change.h"

#include <algorithm>
#include <cmath>
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

/// Radiance may be so large that its variance is more than a float holds.
float clamped_quotient(double sum, double weight) {
    constexpr auto largest = double(std::numeric_limits<float>::max());
    return weight == 0.0 ? 0.0f : float(std::clamp(sum / weight, -largest, largest));
}

/// The values of one named data layer in a pixel; 0 where no sample has any.
std::array<float, 4> named_values(
    const accumulate::SampleSums& sums, size_t layer, size_t picked, int x, int y) {
    const accumulate::DataLayer& data = sums.layer_set().named_data[layer];
    if (!data.is_summed()) return sums.picks()->at(x, y, picked).values;
    const uint32_t first = sums.table().named_data(layer);
    const accumulate::Triple a = sums.total(x, y, first), b = sums.total(x, y, first + 1);
    const double weight = accumulate::weight_of(
        data.is_premultiplied ? sums.total(x, y, accumulate::AccumulatorTable::coverage) : b);
    return {clamped_quotient(a.x, weight), clamped_quotient(a.y, weight),
            clamped_quotient(a.z, weight), clamped_quotient(b.x, weight)};
}

/// The channels of one named data layer, and its entry.
void add_named(const accumulate::SampleSums& sums,
               size_t layer,
               size_t picked,
               image::Part& part,
               std::vector<accumulate::LayerEntry>& layers) {
    constexpr float largest_half = 65504.0f;
    const accumulate::DataLayer& data = sums.layer_set().named_data[layer];
    const image::Window& w = sums.window();
    std::vector<std::vector<float>> planes(data.width());
    for (auto& plane : planes) plane.resize(w.pixel_count());
    accumulate::for_each_row(w, [&](int y) {
        for (int x = w.x0; x < w.x1; ++x) {
            const std::array<float, 4> values = named_values(sums, layer, picked, x, y);
            for (size_t c = 0; c < planes.size(); ++c) planes[c][w.index(x, y)] = values[c];
        }
    });
    const bool fits_half =
        std::all_of(planes.begin(), planes.end(), [&](const std::vector<float>& plane) {
            return std::all_of(plane.begin(), plane.end(),
                               [&](float v) { return std::abs(v) <= largest_half; });
        });
    const bool is_half = data.is_half && fits_half;
    for (size_t c = 0; c < planes.size(); ++c)
        part.channels.push_back(
            stored_channel(data.channel(c), std::move(planes[c]),
                           is_half ? image::ChannelType::Half : image::ChannelType::Float));
    accumulate::LayerEntry entry;
    entry.name = data.name;
    entry.family = "data";
    entry.part = part.name;
    entry.type = is_half ? "half" : "float";
    entry.source = data.source == accumulate::DataSource::Primvar
                       ? "primvar:" + data.primvar
                       : std::string(accumulate::name_of(data.source));
    if (!data.group.empty()) entry.group = data.group;
    entry.filter = std::string(accumulate::name_of(data.filter));
    layers.push_back(std::move(entry));
}

/// albedo, N, P, Z, st, ids, counts and variance.
void add_usual(const accumulate::SampleSums& sums,
               image::Part& part,
               std::vector<accumulate::LayerEntry>& layers) {
    const accumulate::AccumulatorTable& table = sums.table();
    const image::Window& window = sums.window();
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

    const auto set_float = [&part](size_t channel, size_t i, double sum, double weight) {
        std::get<std::vector<float>>(part.channels[channel].data)[i] =
            clamped_quotient(sum, weight);
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
}

}  // namespace

image::Part data_part(const accumulate::SampleSums& sums,
                      std::vector<accumulate::LayerEntry>& layers) {
    const accumulate::LayerSet& set = sums.layer_set();
    image::Part part;
    part.name = "data";
    part.attributes["colorInteropID"] = std::string("data");
    if (set.data_layers) add_usual(sums, part, layers);
    for (const accumulate::DataAlias& alias : set.data_aliases) add_alias(alias, part, layers);
    size_t picked = 0;
    for (size_t i = 0; i < set.named_data.size(); ++i) {
        add_named(sums, i, picked, part, layers);
        picked += size_t(!set.named_data[i].is_summed());
    }
    return part;
}

}  // namespace velatura::layers
