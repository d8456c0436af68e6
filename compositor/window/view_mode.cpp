// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/view_mode.h"

#include "canvas/false_color.h"
#include "image/formats.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace velatura::compositor::window {

namespace {

using Rgb = std::array<float, 3>;

constexpr std::array choices = {
    ChannelChoice{ShownChannel::Color, "RGB", "color", Action::ShowColor},
    ChannelChoice{ShownChannel::Red, "R", "red", Action::ShowRed},
    ChannelChoice{ShownChannel::Green, "G", "green", Action::ShowGreen},
    ChannelChoice{ShownChannel::Blue, "B", "blue", Action::ShowBlue},
    ChannelChoice{ShownChannel::Alpha, "A", "alpha", Action::ShowAlpha},
    ChannelChoice{ShownChannel::Luminance, "Y", "luminance", Action::ShowLuminance}};

/// Of linear Rec.709.
constexpr Rgb luminance = {0.2126f, 0.7152f, 0.0722f};
constexpr uint8_t is_not_finite = 1;

/// A tile and what is stored of it.
class Tile {
  public:
    Tile(const image::Image& image, const image::Window& tile)
        : image_(image),
          tile_({tile.x0 + image.display.x0, tile.y0 + image.display.y0, tile.x1 + image.display.x0,
                 tile.y1 + image.display.y0}) {}

    size_t pixel_count() const { return tile_.pixel_count(); }

    /// f(pixel of the tile, pixel of the file) for all that are stored.
    template <class F>
    void for_stored(F f) const {
        const image::Window& data = image_.data;
        for (int y = std::max(tile_.y0, data.y0); y < std::min(tile_.y1, data.y1); ++y) {
            for (int x = std::max(tile_.x0, data.x0); x < std::min(tile_.x1, data.x1); ++x)
                f(tile_.index(x, y), data.index(x, y));
        }
    }

    /// Values as they are; 0 where there are none, `otherwise` where the channel is missing.
    std::vector<float> values(const image::Channel* channel, float otherwise = 0) const {
        std::vector<float> values(pixel_count(), 0.0f);
        for_stored([&](size_t to, size_t from) {
            values[to] = channel ? channel->value(from) : otherwise;
        });
        return values;
    }

    void mark_not_finite(const image::Channel& channel, std::vector<uint8_t>& marks) const {
        for_stored([&](size_t to, size_t from) {
            if (!std::isfinite(channel.value(from))) marks[to] = is_not_finite;
        });
    }

  private:
    const image::Image& image_;
    image::Window tile_;
};

/// Marks pixels where a layer that the mix adds up is not finite; the mix takes those as 0.
void mark_inputs(const TileSource& source, const Tile& tile, std::vector<uint8_t>& marks) {
    if (source.not_finite.empty()) return;
    for (const auto* terms : {&source.plan.terms, &source.plan.shadow_terms}) {
        for (const mix::MixPlan::Term& term : *terms) {
            for (const std::string& layer : {term.layer, term.clamp_layer}) {
                for (size_t c = 0; c < 3 && !layer.empty(); ++c) {
                    const image::Channel* channel = source.stack.channel(layer, c);
                    if (channel && term.gain[c] != 0 && source.not_finite.contains(channel->name))
                        tile.mark_not_finite(*channel, marks);
                }
            }
        }
    }
}

/// Takes values that are not finite as 0, and marks them.
void clean(std::vector<float>& values, size_t per_pixel, std::vector<uint8_t>& marks) {
    for (size_t i = 0; i < values.size(); ++i) {
        if (std::isfinite(values[i])) continue;
        values[i] = 0;
        marks[i / per_pixel] = is_not_finite;
    }
}

/// Scene-linear colors of a layer, exposed.
std::vector<float> layer_colors(const TileSource& source,
                                const ShownLayer& layer,
                                const Tile& tile) {
    const image::Part& part = source.stack.image().parts[layer.part];
    const float exposure = std::exp2(source.exposure_stops);
    std::vector<float> rgb(3 * tile.pixel_count(), 0.0f);
    for (size_t c = 0; c < 3; ++c) {
        const image::Channel* channel = part.find(layer.channels[c]);
        if (!channel) continue;
        const std::vector<float> values = tile.values(channel);
        for (size_t i = 0; i < values.size(); ++i) rgb[3 * i + c] = exposure * values[i];
    }
    return rgb;
}

std::vector<float> alphas(const TileSource& source, const ViewMode& mode, const Tile& tile) {
    if (!mode.layer) return tile.values(source.stack.channel("rgba", 3), 1);
    const std::string& name = mode.layer->channels[3];
    const image::Part& part = source.stack.image().parts[mode.layer->part];
    return tile.values(name.empty() ? nullptr : part.find(name), 1);
}

void isolate(std::vector<float>& rgb, ShownChannel channel) {
    if (channel == ShownChannel::Color) return;
    for (size_t i = 0; i < rgb.size(); i += 3) {
        float gray = 0;
        if (channel == ShownChannel::Luminance) {
            for (size_t c = 0; c < 3; ++c) gray += luminance[c] * rgb[i + c];
        } else {
            gray = rgb[i + size_t(channel) - size_t(ShownChannel::Red)];
        }
        std::fill_n(rgb.begin() + std::ptrdiff_t(i), 3, gray);
    }
}

constexpr float middle_gray = 0.18f, stops_beside_it = 6;
/// Of the noise map: 10^-3 to 1.
constexpr float decades_of_noise = 3;

float luminance_of(const float* rgb) {
    float sum = 0;
    for (size_t c = 0; c < 3; ++c) sum += luminance[c] * rgb[c];
    return sum;
}

const image::Channel* find_channel(const LayerStack& stack, const std::string& name) {
    for (const image::Part& part : stack.image().parts)
        if (const image::Channel* channel = part.find(name)) return channel;
    return nullptr;
}

/// Places on the scale. rgb: what is shown, scene-linear.
std::vector<float> scale_places(const TileSource& source,
                                const ViewMode& mode,
                                const Tile& tile,
                                const std::vector<float>& rgb) {
    std::vector<float> places(tile.pixel_count(), 0.0f);
    if (mode.false_color == FalseColor::Stops) {
        for (size_t i = 0; i < places.size(); ++i) {
            const float y = luminance_of(&rgb[3 * i]);
            if (y > 0)
                places[i] = (std::log2(y / middle_gray) + stops_beside_it) / (2 * stops_beside_it);
        }
        return places;
    }
    const image::Channel* channel = find_channel(source.stack, layer_of(mode.false_color));
    if (!channel) return places;
    places = tile.values(channel);
    if (mode.false_color == FalseColor::Samples) {
        for (float& v : places) v /= std::max(mode.most_samples, 1.0f);
        return places;
    }
    std::array<std::vector<float>, 3> beauty;
    for (size_t c = 0; c < 3; ++c) beauty[c] = tile.values(source.stack.channel("rgba", c));
    for (size_t i = 0; i < places.size(); ++i) {
        const float mean = (beauty[0][i] + beauty[1][i] + beauty[2][i]) / 3;
        const float error = std::sqrt(std::max(places[i], 0.0f));
        if (error == 0) continue;
        places[i] = mean > 0 ? std::log10(error / mean) / decades_of_noise + 1 : 1.0f;
    }
    return places;
}

ShownTile show_scale(const std::vector<float>& places, const std::vector<uint8_t>& marks) {
    ShownTile out;
    out.rgba.reserve(4 * places.size());
    for (size_t i = 0; i < places.size(); ++i) {
        const bool is_bad = marks[i] != 0 || !std::isfinite(places[i]);
        if (is_bad) ++out.flagged.not_finite;
        const auto color = is_bad ? not_finite_mark : scale_color(places[i]);
        out.rgba.insert(out.rgba.end(), color.begin(), color.end());
        out.rgba.push_back(255);
    }
    return out;
}

/// Which of the three channels is worst, as a mark; none: nothing is wrong.
const std::array<uint8_t, 3>* mark_of(
    const float* scene, const float* display, bool is_alpha, bool is_bad, FlaggedPixels& flagged) {
    if (is_bad) {
        ++flagged.not_finite;
        return &not_finite_mark;
    }
    const auto is_above = [&](float v) { return is_alpha ? v > 1 : v >= 1; };
    if (is_above(display[0]) || is_above(display[1]) || is_above(display[2])) {
        ++flagged.above;
        return &above_mark;
    }
    if (scene[0] < 0 || scene[1] < 0 || scene[2] < 0) {
        ++flagged.below;
        return &below_mark;
    }
    return nullptr;
}

/// Over the bytes of the screen, so that it is the same red in any view.
void draw_matte(const Tile& tile, const std::vector<float>& matte, std::vector<uint8_t>& rgba) {
    tile.for_stored([&](size_t to, size_t from) {
        const float share = matte_strength * matte[from];
        for (size_t c = 0; c < 3; ++c) {
            uint8_t& byte = rgba[4 * to + c];
            byte = uint8_t(std::lround((1 - share) * float(byte) + share * float(matte_color[c])));
        }
    });
}

}  // namespace

std::span<const ChannelChoice> channel_choices() {
    return choices;
}

std::string ViewMode::text() const {
    std::string text = layer ? layer->name : std::string();
    if (channel != ShownChannel::Color) {
        const auto at = std::find_if(choices.begin(), choices.end(),
                                     [&](const ChannelChoice& c) { return c.channel == channel; });
        text += (text.empty() ? "" : ", ") + std::string(at->name);
    }
    constexpr std::array names = {"", "stops about 0.18", "samples per pixel",
                                  "relative standard error"};
    if (false_color != FalseColor::None)
        text += (text.empty() ? "" : ", ") + std::string(names[size_t(false_color)]);
    return text;
}

std::vector<ScaleMark> scale_of(const ViewMode& mode) {
    switch (mode.false_color) {
        case FalseColor::None:
            break;
        case FalseColor::Stops:
            return {{0, "-6"}, {0.25f, "-3"}, {0.5f, "0"}, {0.75f, "+3"}, {1, "+6"}};
        case FalseColor::Samples:
            return {{0, "0"},
                    {0.5f, fmt::format("{:.4g}", mode.most_samples / 2)},
                    {1, fmt::format("{:.4g}", mode.most_samples)}};
        case FalseColor::Noise:
            return {{0, "0.1 %"}, {1 / 3.0f, "1 %"}, {2 / 3.0f, "10 %"}, {1, "100 %"}};
    }
    return {};
}

std::array<uint8_t, 3> scale_color(float t) {
    const std::array<float, 3> color = canvas::glow(double(t));
    return {image::display_byte(color[0]), image::display_byte(color[1]),
            image::display_byte(color[2])};
}

const char* layer_of(FalseColor color) {
    return color == FalseColor::Samples ? "sampleCount"
           : color == FalseColor::Noise ? "variance"
                                        : "";
}

FlaggedPixels& FlaggedPixels::operator+=(const FlaggedPixels& other) {
    not_finite += other.not_finite;
    above += other.above;
    below += other.below;
    return *this;
}

std::string FlaggedPixels::text() const {
    std::string text;
    const auto add = [&](size_t count, const char* what) {
        if (count > 0) text += fmt::format("{}{} px {}", text.empty() ? "" : " · ", count, what);
    };
    add(not_finite, "NaN/Inf");
    add(above, "clipped");
    add(below, "negative");
    return text;
}

ShownTile show_tile(const TileSource& source, const ViewMode& mode, const image::Window& window) {
    const Tile tile(source.stack.image(), window);
    std::vector<uint8_t> marks(tile.pixel_count(), 0);
    const bool is_alpha = mode.channel == ShownChannel::Alpha;
    std::vector<float> rgb;
    if (is_alpha) {
        for (const float v : alphas(source, mode, tile)) rgb.insert(rgb.end(), 3, v);
    } else if (mode.layer) {
        rgb = layer_colors(source, *mode.layer, tile);
    } else {
        rgb = mix_tile(source.stack, source.plan, source.exposure_stops, window);
        mark_inputs(source, tile, marks);
    }
    if (!is_alpha) isolate(rgb, mode.channel);
    clean(rgb, 3, marks);
    if (mode.false_color != FalseColor::None) {
        ShownTile out = show_scale(scale_places(source, mode, tile, rgb), marks);
        if (source.matte) draw_matte(tile, *source.matte, out.rgba);
        return out;
    }
    std::vector<float> shown = rgb;
    if (!is_alpha) source.transform.apply(shown);
    ShownTile out;
    out.rgba.resize(4 * marks.size());
    for (size_t i = 0; i < marks.size(); ++i) {
        for (size_t c = 0; c < 3; ++c) out.rgba[4 * i + c] = image::display_byte(shown[3 * i + c]);
        out.rgba[4 * i + 3] = 255;
        const auto* mark =
            mark_of(&rgb[3 * i], &shown[3 * i], is_alpha, marks[i] != 0, out.flagged);
        if (mark && mode.flags_pixels)
            std::copy(mark->begin(), mark->end(), out.rgba.begin() + std::ptrdiff_t(4 * i));
    }
    if (source.matte) draw_matte(tile, *source.matte, out.rgba);
    return out;
}

void FlaggedPixelCounts::take(size_t look,
                              uint64_t version,
                              const image::Window& tile,
                              const FlaggedPixels& flagged) {
    tiles_[look][{tile.x0, tile.y0}] = {version, tile.pixel_count(), flagged};
}

std::optional<FlaggedPixels> FlaggedPixelCounts::of(size_t look,
                                                    uint64_t version,
                                                    size_t pixels) const {
    FlaggedPixels sum;
    size_t counted = 0;
    for (const auto& [corner, tile] : tiles_[look]) {
        if (tile.version != version) continue;
        sum += tile.flagged;
        counted += tile.pixels;
    }
    return counted == pixels ? std::optional(sum) : std::nullopt;
}

}  // namespace velatura::compositor::window
