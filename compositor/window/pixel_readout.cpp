// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/pixel_readout.h"

#include "compositor/window/tile_mix.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

namespace velatura::compositor::window {

namespace {

/// A value of the file at a pixel of the image.
float value_at(const image::Image& image, const image::Channel* channel, int x, int y) {
    const int fx = x + image.display.x0, fy = y + image.display.y0;
    return channel && image.data.contains(fx, fy) ? channel->value(image.data.index(fx, fy)) : 0.0f;
}

std::vector<float> data_values(const LayerStack& stack, const std::string& name, int x, int y) {
    std::vector<float> values;
    for (const layers::ChannelRef& place : stack.data_channels(name)) {
        const image::Channel& channel = stack.image().parts[place.part].channels[place.channel];
        values.push_back(value_at(stack.image(), &channel, x, y));
    }
    return values;
}

/// Puts together the readout of one pixel.
class Reader {
  public:
    Reader(const LayerStack& stack, const mix::MixPlan& plan, PixelReadout& out)
        : stack_(stack), plan_(plan), out_(out) {
        const image::Image& image = stack.image();
        const int fx = out.x + image.display.x0, fy = out.y + image.display.y0;
        if (image.data.contains(fx, fy)) pixel_ = image.data.index(fx, fy);
    }

    /// A layer with what the mix makes of it here: gain, mattes, and what is given back of a clamp.
    void add_term(const mix::MixPlan::Term& term, float exposure) {
        Rgb gain{}, given_back{};
        for (size_t c = 0; c < 3; ++c) {
            gain[c] = term.gain[c] * exposure;
            // Where nothing is stored there is no matte either
            if (!pixel_) continue;
            gain[c] *= plan_.matte_factor(term, c, *pixel_);
            given_back[c] = gain[c] * plan_.clamp_share(term, *pixel_);
        }
        add(term.layer, gain);
        if (!term.clamp_layer.empty()) add(term.clamp_layer, given_back);
    }

    /// A layer that the mix does not use, if it is not listed.
    void add_unused(const std::string& layer) { add(layer, {}); }

    void add_data(const std::string& name) {
        out_.data.push_back({name, data_values(stack_, name, out_.x, out_.y)});
    }

  private:
    using Rgb = std::array<float, 3>;

    void add(const std::string& layer, const Rgb& gain) {
        const auto at = std::find_if(out_.layers.begin(), out_.layers.end(),
                                     [&](const PixelReadout::Layer& l) { return l.name == layer; });
        // A plan may take up a layer twice, with and without a matte
        PixelReadout::Layer& row = at == out_.layers.end() ? begin(layer) : *at;
        for (size_t c = 0; c < 3; ++c) row.gain[c] += gain[c];
    }

    PixelReadout::Layer& begin(const std::string& layer) {
        PixelReadout::Layer& row = out_.layers.emplace_back();
        row.name = layer;
        for (size_t c = 0; c < 3; ++c)
            row.stored[c] = value_at(stack_.image(), stack_.channel(layer, c), out_.x, out_.y);
        return row;
    }

    const LayerStack& stack_;
    const mix::MixPlan& plan_;
    PixelReadout& out_;
    std::optional<size_t> pixel_;  ///< of the data window; none: not stored
};

}  // namespace

std::string data_text(const std::vector<float>& values) {
    constexpr float id_of_nothing = 0x1p32f;  // 4294967295 as a float
    std::string line;
    for (const float v : values) {
        if (!line.empty()) line += ' ';
        const bool is_whole = std::abs(v) < id_of_nothing && v == std::trunc(v);
        line += v == id_of_nothing ? std::string("none")
                : is_whole         ? fmt::format("{:.0f}", v)
                                   : fmt::format("{:.4g}", v);
    }
    return line;
}

PixelReadout read_pixel(
    const LayerStack& stack, const mix::MixPlan& plan, float exposure_stops, int x, int y) {
    const image::Image& image = stack.image();
    PixelReadout out;
    out.x = x;
    out.y = y;
    const std::vector<float> mix = mix_tile(stack, plan, exposure_stops, {x, y, x + 1, y + 1});
    std::copy(mix.begin(), mix.end(), out.mix.begin());
    if (const image::Channel* alpha = stack.channel("rgba", 3))
        out.alpha = value_at(image, alpha, x, y);

    const float exposure = std::exp2(exposure_stops);
    Reader reader(stack, plan, out);
    for (const mix::MixPlan::Term& term : plan.terms) reader.add_term(term, exposure);
    for (const mix::MixPlan::Term& term : plan.shadow_terms) reader.add_term(term, exposure);
    for (const accumulate::LayerEntry& entry : stack.header().layers) {
        if (entry.family == "data") {
            reader.add_data(entry.name);
        } else if (entry.family != "halves" && !entry.is_empty) {
            reader.add_unused(entry.name);
        }
    }
    return out;
}

}  // namespace velatura::compositor::window
