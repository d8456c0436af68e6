// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/pixel_readout.h"

#include "compositor/window/tile_mix.h"

#include <algorithm>
#include <cmath>

namespace velatura::compositor::window {

namespace {

/// A value of the file at a pixel of the picture.
float value_at(const image::Image& image, const image::Channel* channel, int x, int y) {
    const int fx = x + image.display.x0, fy = y + image.display.y0;
    return channel && image.data.contains(fx, fy) ? channel->value(image.data.index(fx, fy)) : 0.0f;
}

std::vector<float> data_values(const image::Image& image, const std::string& name, int x, int y) {
    std::vector<float> values;
    for (const image::Part& part : image.parts) {
        for (const image::Channel& channel : part.channels) {
            if (channel.name == name || channel.name.starts_with(name + "."))
                values.push_back(value_at(image, &channel, x, y));
        }
    }
    return values;
}

}  // namespace

PixelReadout read_pixel(
    const LayerStack& stack, const MixPlan& plan, float exposure_stops, int x, int y) {
    const image::Image& image = stack.image();
    PixelReadout out;
    out.x = x;
    out.y = y;
    const std::vector<float> mix = mix_tile(stack, plan, exposure_stops, {x, y, x + 1, y + 1});
    std::copy(mix.begin(), mix.end(), out.mix.begin());
    if (const image::Channel* alpha = image.find("A")) out.alpha = value_at(image, alpha, x, y);

    const float exposure = std::exp2(exposure_stops);
    const auto add = [&](const std::string& layer, const std::array<float, 3>& gain) {
        PixelReadout::Layer row;
        row.name = layer;
        for (size_t c = 0; c < 3; ++c) {
            row.stored[c] = value_at(image, stack.channel(layer, c), x, y);
            row.gain[c] = gain[c] * exposure;
        }
        out.layers.push_back(std::move(row));
    };
    for (const MixPlan::Term& term : plan.terms) add(term.layer, term.gain);
    for (const MixPlan::Term& term : plan.shadow_terms) add(term.layer, term.gain);
    for (const image::LayerEntry& entry : stack.header().layers) {
        if (entry.family == "data") {
            out.data.push_back({entry.name, data_values(image, entry.name, x, y)});
        } else if (entry.family != "halves" && !entry.is_empty) {
            const bool is_listed =
                std::any_of(out.layers.begin(), out.layers.end(),
                            [&](const PixelReadout::Layer& l) { return l.name == entry.name; });
            if (!is_listed) add(entry.name, {0, 0, 0});
        }
    }
    return out;
}

}  // namespace velatura::compositor::window
