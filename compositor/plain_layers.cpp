// SPDX-License-Identifier: Apache-2.0
#include "compositor/plain_layers.h"

#include "base/unique_names.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <optional>
#include <vector>

namespace velatura::compositor {

namespace {

using image::ChannelPlace;

std::string lower(std::string text) {
    for (char& c : text) c = char(std::tolower(static_cast<unsigned char>(c)));
    return text;
}

/// A layer by the name of its channels before the last dot, or by its part.
struct NamedLayer {
    std::string name;
    std::array<std::optional<ChannelPlace>, 4> channels;  ///< R G B A
    bool is_bare = false;                                 ///< channels without a dot

    bool has_colour() const { return channels[0] && channels[1] && channels[2]; }
};

std::optional<size_t> component(const std::string& suffix) {
    constexpr std::array<std::array<const char*, 2>, 4> names = {
        {{"r", "red"}, {"g", "green"}, {"b", "blue"}, {"a", "alpha"}}};
    for (size_t c = 0; c < names.size(); ++c) {
        if (lower(suffix) == names[c][0] || lower(suffix) == names[c][1]) return c;
    }
    return std::nullopt;
}

std::vector<NamedLayer> colour_layers(const image::Image& image) {
    std::vector<NamedLayer> layers;
    for (size_t p = 0; p < image.parts.size(); ++p) {
        const image::Part& part = image.parts[p];
        for (size_t c = 0; c < part.channels.size(); ++c) {
            const std::string& full = part.channels[c].name;
            const size_t dot = full.rfind('.');
            const bool is_bare = dot == std::string::npos;
            const auto index = component(is_bare ? full : full.substr(dot + 1));
            if (!index) continue;
            const std::string name = is_bare ? part.name : full.substr(0, dot);
            auto at = std::find_if(layers.begin(), layers.end(), [&](const NamedLayer& l) {
                return l.name == name && l.is_bare == is_bare;
            });
            if (at == layers.end()) at = layers.insert(at, {name, {}, is_bare});
            if (!at->channels[*index]) at->channels[*index] = ChannelPlace{p, c};
        }
    }
    std::erase_if(layers, [](const NamedLayer& l) { return !l.has_colour(); });
    return layers;
}

/// What comes after the view layer: `ViewLayer.DiffDir` of Cycles → `DiffDir`. All of a name whose
/// dots mean something else, as those of a light path expression do.
std::string end_of(const std::string& name) {
    const size_t dot = name.rfind('.');
    const bool is_expression = name.find_first_of("<>[](){}'\"|*+^") != std::string::npos;
    return is_expression || dot == std::string::npos || dot + 1 == name.size()
               ? name
               : name.substr(dot + 1);
}

std::string last_word(const std::string& name) {
    return lower(end_of(name));
}

bool is_beauty_name(const std::string& name) {
    constexpr std::array words = {"combined", "rgba", "rgb", "beauty", "c"};
    return std::find(words.begin(), words.end(), last_word(name)) != words.end();
}

/// Passes that hold no light: of Cycles, Arnold, pbrt, RenderMan, Karma.
bool is_data_name(const std::string& name) {
    const std::string word = last_word(name);
    constexpr std::array words = {"albedo",   "n",      "ns",          "ng",      "p",
                                  "position", "normal", "uv",          "st",      "z",
                                  "depth",    "vector", "motion",      "diffcol", "glosscol",
                                  "transcol", "mist",   "motionvector"};
    constexpr std::array beginnings = {"crypto", "denoising", "rgbalbedo", "id_", "debug"};
    return std::find(words.begin(), words.end(), word) != words.end() ||
           std::any_of(beginnings.begin(), beginnings.end(),
                       [&](const char* b) { return word.starts_with(b); }) ||
           word.ends_with("albedo") || word.ends_with("normal");
}

const NamedLayer* find_beauty(const std::vector<NamedLayer>& layers) {
    const auto named_or_unnamed = [](const NamedLayer& l) {
        return l.is_bare && (l.name.empty() || is_beauty_name(l.name));
    };
    auto at = std::find_if(layers.begin(), layers.end(), named_or_unnamed);
    if (at == layers.end()) {
        at = std::find_if(layers.begin(), layers.end(),
                          [](const NamedLayer& l) { return is_beauty_name(l.name); });
    }
    if (at == layers.end()) {
        at = std::find_if(layers.begin(), layers.end(),
                          [](const NamedLayer& l) { return l.is_bare && !is_data_name(l.name); });
    }
    return at == layers.end() ? nullptr : &*at;
}

/// Names that a control can be typed with: the last word where that is enough to tell rows apart.
std::string row_name(const NamedLayer& layer, const std::vector<NamedLayer>& layers) {
    const std::string last = end_of(layer.name);
    const auto same = std::count_if(layers.begin(), layers.end(),
                                    [&](const NamedLayer& l) { return end_of(l.name) == last; });
    return same == 1 ? last : layer.name;
}

image::LayerEntry entry_of(const std::string& name, const char* family) {
    image::LayerEntry entry;
    entry.name = name;
    entry.family = family;
    entry.type = "mixed";
    return entry;
}

}  // namespace

Result<PlainLayers> plain_layers(const image::Image& image) {
    const std::vector<NamedLayer> layers = colour_layers(image);
    const NamedLayer* beauty = find_beauty(layers);
    if (!beauty) return Error{"not-layers", "the file has no channels R, G and B of a picture"};

    constexpr std::array suffixes = {"R", "G", "B", "A"};
    PlainLayers plain;
    plain.header.layers.push_back(entry_of("rgba", "beauty"));
    for (size_t c = 0; c < 4; ++c) {
        if (beauty->channels[c]) plain.channels.emplace(suffixes[c], *beauty->channels[c]);
    }
    UniqueNames names;
    names.take("rgba");
    for (const NamedLayer& layer : layers) {
        if (&layer == beauty) continue;
        const std::string name = names.make(row_name(layer, layers));
        const bool is_row = !is_data_name(layer.name);
        plain.header.layers.push_back(entry_of(name, is_row ? "plain" : "data"));
        if (is_row) plain.header.lights.push_back({name, {}, false});
        if (is_row) plain.header.layers.back().group = name;
        for (size_t c = 0; c < 3; ++c)
            plain.channels.emplace(name + "." + suffixes[c], *layer.channels[c]);
    }
    plain.header.lights.push_back({names.make("rest"), {}, false});
    return plain;
}

}  // namespace velatura::compositor
