// SPDX-License-Identifier: Apache-2.0
#include "compositor/inspect/diff.h"

#include "base/unique_names.h"
#include "image/digest.h"
#include "statistics/relative_error.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>

namespace velatura::compositor::inspect {

namespace {

/// A channel by the name that it is compared by.
struct Named {
    std::string name;
    const image::Channel* channel;
};

using Channels = std::vector<Named>;

const image::Channel* named(const Channels& channels, const std::string& name) {
    for (const Named& c : channels) {
        if (c.name == name) return c.channel;
    }
    return nullptr;
}

bool has_same_bits(const image::Channel& a, const image::Channel& b) {
    return a.type() == b.type() && a.byte_count() == b.byte_count() &&
           std::memcmp(a.bytes(), b.bytes(), a.byte_count()) == 0;
}

std::string suffix_of(const std::string& channel) {
    return channel.substr(channel.rfind('.') + 1);
}

bool is_color(const Named& channel) {
    const std::string suffix = suffix_of(channel.channel->name);
    return suffix == "R" || suffix == "G" || suffix == "B";
}

/// What stands before the last dot; the bare colors are `rgba`.
std::string layer_of(const std::string& channel) {
    const bool is_beauty =
        channel.size() == 1 && std::string("RGBA").find(channel) != std::string::npos;
    return is_beauty ? "rgba" : channel.substr(0, channel.rfind('.'));
}

/// All channels by names that are each there once: a name that an earlier part has, as those of the
/// other eye or of parts with bare colors, is told by its part.
std::map<std::string, Channels> named_layers(const image::Image& image) {
    std::map<std::string, Channels> layers;
    UniqueNames names;
    for (const image::Part& part : image.parts) {
        for (const image::Channel& c : part.channels) {
            if (image::is_bookkeeping(c.name)) continue;
            const bool is_first = !names.has(c.name);
            const std::string prefix = is_first ? "" : part.name + " ";
            layers[prefix + layer_of(c.name)].push_back({names.make(prefix + c.name), &c});
        }
    }
    return layers;
}

/// With the alphas of layers with color apart.
std::map<std::string, Channels> compared_layers(const image::Image& image) {
    std::map<std::string, Channels> layers;
    for (auto& [name, channels] : named_layers(image)) {
        const bool has_color = std::any_of(channels.begin(), channels.end(), is_color);
        for (const Named& c : channels) {
            const bool is_alpha = suffix_of(c.channel->name) == "A";
            layers[has_color && is_alpha ? name + ".A" : name].push_back(c);
        }
    }
    return layers;
}

/// relative_square of the difference of a value and its reference.
double square_of(double difference, double reference) {
    if (difference == 0) return 0;
    if (!std::isfinite(difference) || !std::isfinite(reference))
        return std::numeric_limits<double>::infinity();
    return statistics::relative_square(difference * difference, reference);
}

LayerDifference compare_layer(const image::Window& w,
                              const std::string& name,
                              const Channels& a,
                              const Channels& b) {
    LayerDifference d;
    d.layer = name;
    const size_t pixels = w.pixel_count();
    std::vector<bool> is_different(pixels, false);
    double sum = 0, squares = 0;
    for (const auto& [channel, x] : a) {
        const image::Channel* y = named(b, channel);
        if (!y) {
            d.only_in_a = true;
            continue;
        }
        for (size_t i = 0; i < pixels; ++i) {
            const double u = double(x->value(i)), v = double(y->value(i));
            double difference = std::abs(u - v);
            if (u == v || (std::isnan(u) && std::isnan(v))) difference = 0;
            if (std::isnan(difference)) difference = std::numeric_limits<double>::infinity();
            if (difference > 0) is_different[i] = true;
            if (difference > d.largest) {
                d.largest = difference;
                d.x = w.x0 + int(i % size_t(w.width()));
                d.y = w.y0 + int(i / size_t(w.width()));
            }
            sum += difference;
            squares += square_of(difference, v);
        }
    }
    if (a.size() < b.size()) d.only_in_b = true;
    const double terms = double(pixels) * double(a.size());
    d.mean = terms > 0 ? sum / terms : 0;
    d.rel_mse = terms > 0 ? squares / terms : 0;
    for (const bool different : is_different) d.different += different;
    return d;
}

}  // namespace

Result<Difference> compare(const image::Image& a, const image::Image& b) {
    if (a.data != b.data) {
        return Error{"diff-window",
                     fmt::format("the data windows differ: {}×{} at {},{} and {}×{} at {},{}",
                                 a.data.width(), a.data.height(), a.data.x0, a.data.y0,
                                 b.data.width(), b.data.height(), b.data.x0, b.data.y0)};
    }
    Difference result;
    result.is_equal = true;
    const auto in_a = compared_layers(a), in_b = compared_layers(b);
    for (const auto& [name, channels] : in_a) {
        const auto other = in_b.find(name);
        LayerDifference d;
        if (other == in_b.end()) {
            d.layer = name;
            d.only_in_a = true;
        } else {
            d = compare_layer(a.data, name, channels, other->second);
            for (const auto& [channel, c] : channels) {
                const image::Channel* o = named(other->second, channel);
                if (!o || !has_same_bits(*c, *o)) result.is_equal = false;
            }
        }
        if (d.only_in_a || d.only_in_b) result.is_equal = false;
        result.worst_rel_mse = std::max(result.worst_rel_mse, d.rel_mse);
        result.layers.push_back(std::move(d));
    }
    for (const auto& [name, channels] : in_b) {
        if (in_a.count(name) != 0) continue;
        LayerDifference d;
        d.layer = name;
        d.only_in_b = true;
        result.is_equal = false;
        result.layers.push_back(std::move(d));
    }
    return result;
}

image::Image difference_image(const image::Image& a, const image::Image& b) {
    image::Image out;
    out.data = a.data;
    out.display = a.display;
    image::Part part;
    const auto in_b = named_layers(b);
    for (const auto& [layer, channels] : named_layers(a)) {
        const auto other = in_b.find(layer);
        if (other == in_b.end()) continue;
        for (const auto& [name, c] : channels) {
            const image::Channel* o = named(other->second, name);
            if (!o || c->type() == image::ChannelType::Uint ||
                o->type() == image::ChannelType::Uint)
                continue;
            image::Channel d = image::Channel::make(name, image::ChannelType::Float, c->size());
            auto& values = std::get<std::vector<float>>(d.data);
            for (size_t i = 0; i < values.size(); ++i) values[i] = c->value(i) - o->value(i);
            part.channels.push_back(std::move(d));
        }
    }
    out.parts.push_back(std::move(part));
    return out;
}

}  // namespace velatura::compositor::inspect
