// SPDX-License-Identifier: Apache-2.0
#include "compositor/mix/layered_storage.h"

#include "base/tasks.h"
#include "compositor/io/file_attributes.h"
#include "image/digest.h"

#include <algorithm>
#include <utility>
#include <variant>

namespace velatura::compositor::mix {

using accumulate::LayerEntry;
using image::Channel;
using image::ChannelType;

namespace {

bool fits_half(const Channel& channel) {
    const auto* values = std::get_if<Values>(&channel.data);
    return values && std::all_of(values->begin(), values->end(),
                                 [](float v) { return float(Imath::half(v)) == v; });
}

}  // namespace

GrayRows::GrayRows(LayeredImage& image) : image_(image) {
    const LayeredPlan& plan = image.plan();
    for (const LayerEntry& e : plan.layout.header().layers) {
        const auto gray = plan.layout.place(e.name, 0);
        const bool is_gray = gray && gray == plan.layout.place(e.name, 1);
        if (!is_gray || plan.outcomes.at(e.name) == LayerOutcome::Same) continue;
        const auto at = image.place_of(*gray);
        if (!at) continue;
        image.assign({e.name, "", 0}, *at);
        image.at(*at).name = "R";
        for (size_t c = 1; c < 3; ++c) {
            Channel copy = image.at(*at);
            copy.name = rgb_names[c];
            image.add({e.name, "", c}, at->first, std::move(copy));
        }
        split_.push_back(e.name);
    }
}

void GrayRows::join() {
    for (const std::string& row : split_) {
        Channel& red = *image_.channel({row, "", 0});
        if (image_.channel({row, "", 1})->data != red.data ||
            image_.channel({row, "", 2})->data != red.data)
            continue;
        red.name = "Y";
        auto& channels =
            image_.image().parts[image_.place_of(LayerChannel{row, "", 0})->first].channels;
        std::erase_if(channels, [](const Channel& c) { return c.name == "G" || c.name == "B"; });
    }
}

void restore_types(LayeredImage& image) {
    const LayeredPlan& plan = image.plan();
    std::vector<LayerChannel> layers;
    for (const LayerEntry& e : plan.layout.header().layers) {
        const auto outcome = plan.outcomes.find(e.name);
        if (e.family == "halves" || outcome == plan.outcomes.end() ||
            outcome->second == LayerOutcome::Same)
            continue;
        for (const std::string& half : plan.halves) layers.push_back({e.name, half, 0});
    }
    parallel_for(layers.size(), [&](size_t l) {
        LayerChannel of = layers[l];
        bool fits = true;
        for (of.c = 0; of.c < 3 && fits; ++of.c) {
            const auto place = plan.layout.place(of.full_name(), of.c);
            fits = place && image.has(of) &&
                   plan.layout.image().parts[place->part].channels[place->channel].type() ==
                       ChannelType::Half &&
                   fits_half(*image.channel(of));
        }
        for (of.c = 0; of.c < 3 && fits; ++of.c) make_half(*image.channel(of));
    });
}

void add_beauty_of_rows(LayeredImage& image, std::array<Values, 3> sum) {
    const LayerStack& layout = image.plan().layout;
    auto& parts = image.image().parts;
    image::Part beauty;
    beauty.name = "rgba";
    for (size_t c = 0; c < 3; ++c) {
        Channel& of = beauty.channels.emplace_back();
        of.name = rgb_names[c];
        of.data = std::move(sum[c]);
    }
    const auto place = layout.place("rgba", 3);
    if (const auto alpha = place ? image.place_of(*place) : std::nullopt) {
        Channel copy = image.at(*alpha);
        copy.name = "A";
        beauty.channels.push_back(std::move(copy));
    }
    const auto is_bare = [](const Channel& c) { return c.name.find('.') == std::string::npos; };
    image::Part& first = parts[0];
    if (parts.size() == 1 && std::none_of(first.channels.begin(), first.channels.end(), is_bare)) {
        for (Channel& c : beauty.channels) first.channels.push_back(std::move(c));
        return;
    }
    if (first.name.empty()) first.name = "layers";
    for (image::Part& part : parts)
        if (part.name == beauty.name) part.name += "_rows";
    beauty.attributes =
        layers::carried_attributes(layout.image().parts[layout.beauty_part()].attributes);
    if (!layout.view().empty()) beauty.attributes["view"] = layout.view();
    parts.insert(parts.begin(), std::move(beauty));
}

}  // namespace velatura::compositor::mix
