// SPDX-License-Identifier: Apache-2.0
#include "compositor/diff.h"

#include "image/layer_check.h"
#include "image/relative_error.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>

namespace velatura::compositor {

namespace {

using Channels = std::vector<const image::Channel*>;

const image::Channel* named(const Channels& channels, const std::string& name) {
    for (const image::Channel* c : channels) {
        if (c->name == name) return c;
    }
    return nullptr;
}

bool has_same_bits(const image::Channel& a, const image::Channel& b) {
    return a.type() == b.type() && a.byte_count() == b.byte_count() &&
           std::memcmp(a.bytes(), b.bytes(), a.byte_count()) == 0;
}

bool is_colour(const image::Channel& channel) {
    const std::string suffix = channel.name.substr(channel.name.rfind('.') + 1);
    return suffix == "R" || suffix == "G" || suffix == "B";
}

bool is_alpha(const image::Channel& channel) {
    return channel.name.substr(channel.name.rfind('.') + 1) == "A";
}

/// With the alphas of layers with colour apart.
std::map<std::string, Channels> compared_layers(const image::Image& image) {
    std::map<std::string, Channels> layers;
    for (auto& [name, channels] : image::channels_by_layer(image)) {
        const bool has_colour = std::any_of(channels.begin(), channels.end(),
                                            [](const image::Channel* c) { return is_colour(*c); });
        for (const image::Channel* c : channels)
            layers[has_colour && is_alpha(*c) ? name + ".A" : name].push_back(c);
    }
    return layers;
}

/// relative_square of the difference of a value and its reference.
double square_of(double difference, double reference) {
    if (difference == 0) return 0;
    if (!std::isfinite(difference) || !std::isfinite(reference))
        return std::numeric_limits<double>::infinity();
    return image::relative_square(difference * difference, reference);
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
    for (const image::Channel* x : a) {
        const image::Channel* y = named(b, x->name);
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
            for (const image::Channel* c : channels) {
                const image::Channel* o = named(other->second, c->name);
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
    for (const image::Part& p : a.parts) {
        for (const image::Channel& c : p.channels) {
            const image::Channel* o = b.find(c.name);
            if (!o || c.type() == image::ChannelType::Uint || o->type() == image::ChannelType::Uint)
                continue;
            image::Channel d = image::Channel::make(c.name, image::ChannelType::Float, c.size());
            auto& values = std::get<std::vector<float>>(d.data);
            for (size_t i = 0; i < values.size(); ++i) values[i] = c.value(i) - o->value(i);
            part.channels.push_back(std::move(d));
        }
    }
    out.parts.push_back(std::move(part));
    return out;
}

}  // namespace velatura::compositor
