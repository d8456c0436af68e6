// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/shown_layers.h"

#include <algorithm>
#include <cctype>
#include <optional>

namespace velatura::compositor::window {

namespace {

/// Red, green, blue or alpha by the part of a name after its last dot.
std::optional<size_t> place_of(std::string suffix) {
    static const std::array<std::vector<std::string>, 4> names = {
        {{"r", "red", "x", "u"}, {"g", "green", "y", "v"}, {"b", "blue", "z"}, {"a", "alpha"}}};
    std::transform(suffix.begin(), suffix.end(), suffix.begin(),
                   [](unsigned char c) { return char(std::tolower(c)); });
    for (size_t c = 0; c < names.size(); ++c) {
        if (std::find(names[c].begin(), names[c].end(), suffix) != names[c].end()) return c;
    }
    return std::nullopt;
}

bool is_bare_color(const std::string& name) {
    return name == "R" || name == "G" || name == "B" || name == "A";
}

/// The layer that a channel belongs to, and where in it; 0 for a layer of its own.
struct Belonging {
    std::string layer;
    std::optional<size_t> place;
};

Belonging belonging_of(const image::Part& part, const std::string& channel) {
    const size_t dot = channel.rfind('.');
    if (dot == std::string::npos) {
        if (!is_bare_color(channel)) return {channel, std::nullopt};
        return {"rgba", place_of(channel)};
    }
    const auto place = place_of(channel.substr(dot + 1));
    const std::string layer = channel.substr(0, dot);
    if (!place) return {channel, std::nullopt};
    // `light.R` beside `light.X` would be one layer of two spellings: the second is its own
    const auto same = [&](const image::Channel& c) {
        return c.name != channel && c.name.starts_with(layer + ".") &&
               c.name.find('.', dot + 1) == std::string::npos &&
               place_of(c.name.substr(dot + 1)) == place && c.name < channel;
    };
    if (std::any_of(part.channels.begin(), part.channels.end(), same))
        return {channel, std::nullopt};
    return {layer, place};
}

bool is_half_image(const LayerStack& stack, const std::string& layer) {
    const accumulate::LayerEntry* entry = stack.header().find(layer);
    return entry && entry->family == "halves";
}

}  // namespace

std::vector<ShownLayer> shown_layers(const LayerStack& stack) {
    std::vector<ShownLayer> layers;
    const auto layer_of = [&](const std::string& name, size_t part) -> ShownLayer& {
        const auto at = std::find_if(layers.begin(), layers.end(), [&](const ShownLayer& l) {
            return l.name == name && l.part == part;
        });
        if (at != layers.end()) return *at;
        return layers.emplace_back(ShownLayer{name, part, {}});
    };
    const image::Image& image = stack.image();
    for (size_t p = 0; p < image.parts.size(); ++p) {
        for (const image::Channel& channel : image.parts[p].channels) {
            const Belonging b = belonging_of(image.parts[p], channel.name);
            ShownLayer& layer = layer_of(b.layer, p);
            if (b.place) {
                layer.channels[*b.place] = channel.name;
            } else {
                layer.channels = {channel.name, channel.name, channel.name, {}};
            }
        }
    }
    for (ShownLayer& layer : layers) {
        auto& c = layer.channels;
        const auto of_color = std::count_if(c.begin(), c.begin() + 3,
                                            [](const std::string& name) { return !name.empty(); });
        if (of_color > 1) continue;
        const std::string only = !c[0].empty()   ? c[0]
                                 : !c[1].empty() ? c[1]
                                 : !c[2].empty() ? c[2]
                                                 : c[3];
        c[0] = c[1] = c[2] = only;
    }
    // Parts of other programs often hold `R G B` each: they are told apart by the part
    for (ShownLayer& layer : layers) {
        const auto same = [&](const ShownLayer& l) {
            return l.part != layer.part && l.name == layer.name;
        };
        if (layer.part > 0 && std::any_of(layers.begin(), layers.end(), same))
            layer.name = image.parts[layer.part].name + " " + layer.name;
    }
    std::stable_partition(layers.begin(), layers.end(),
                          [](const ShownLayer& l) { return l.name == "rgba"; });
    std::stable_partition(layers.begin(), layers.end(),
                          [&](const ShownLayer& l) { return !is_half_image(stack, l.name); });
    return layers;
}

}  // namespace velatura::compositor::window
