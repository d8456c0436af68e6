// SPDX-License-Identifier: Apache-2.0
#include "compositor/mix/mix.h"

#include "compositor/io/file_attributes.h"
#include "compositor/io/row_values.h"
#include "compositor/mix/layered_mix.h"
#include "compositor/mix/layered_plan.h"
#include "image/digest.h"
#include "image/display.h"
#include "image/formats.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <span>

namespace velatura::compositor::mix {

namespace {

/// One channel of one term.
struct Step {
    size_t term = 0, c = 0;
    std::optional<size_t> channel;  ///< of the strips; none: the layer itself is black
    std::optional<size_t> clamp;    ///< what a clamp took, of the strips
    float gain = 1;
};

/// A row on its way into the fold.
struct Rows {
    explicit Rows(size_t width) : values(width), clamp(width) {}

    std::vector<float> values, clamp;
};

/// Folds strips into the mixed image. Strips may come in any order and from several threads.
class Mixer {
  public:
    Mixer(const LayerStack& layout, const MixPlan& plan, const Look& look, image::ChannelType type);

    /// What strips must hold.
    std::span<const layers::ChannelRef> channels() const { return channels_; }

    void fold(const layers::Strip& strip);
    image::Image image(const Look& look);
    void list_not_finite(std::vector<NotFiniteLayer>& out) const;

  private:
    std::optional<size_t> request(const std::string& layer, size_t c);
    void add_step(size_t term, size_t c, float gain);
    void fold_row(const layers::Strip& strip, size_t row, Rows& rows);
    void load(const layers::Strip& strip, size_t channel, size_t row, size_t step, float* values);
    void give_back(const Step& step, size_t pixel, Rows& rows) const;
    void apply_mattes(const Step& step, size_t pixel, Rows& rows) const;
    void note_not_finite(const std::string& layer,
                         const layers::StripChannel& channel,
                         size_t first,
                         size_t pixel);

    const LayerStack& layout_;
    const MixPlan& plan_;
    const image::ChannelType type_;
    std::vector<MixPlan::Term> terms_;
    std::vector<layers::ChannelRef> channels_;  ///< each once
    std::vector<std::string> channel_layers_;   ///< per channel, for messages
    std::vector<size_t> channel_steps_;         ///< the first that loads it, which tells of it
    std::vector<Step> steps_;
    std::optional<size_t> alpha_;
    std::array<std::vector<float>, 3> fold_;
    std::vector<float> alpha_values_;
    std::mutex mutex_;
    std::map<std::string, NotFinite> not_finite_;  ///< first: pixel of the data window
};

Mixer::Mixer(const LayerStack& layout,
             const MixPlan& plan,
             const Look& look,
             image::ChannelType type)
    : layout_(layout), plan_(plan), type_(type), terms_(plan.all_terms()) {
    const size_t pixels = layout.image().data.pixel_count();
    const float exposure = std::exp2(look.exposure_stops);
    for (size_t t = 0; t < terms_.size(); ++t) {
        for (size_t c = 0; c < 3; ++c) add_step(t, c, terms_[t].gain[c] * exposure);
    }
    for (auto& f : fold_) f.assign(pixels, 0.0f);
    alpha_ = request("rgba", 3);
    if (alpha_) alpha_values_.assign(pixels, 0.0f);
}

/// The channel's number among those of the strips, whoever else may have asked for it.
std::optional<size_t> Mixer::request(const std::string& layer, size_t c) {
    const auto place = layout_.place(layer, c);
    if (!place) return std::nullopt;
    const auto at = std::find(channels_.begin(), channels_.end(), *place);
    if (at != channels_.end()) return size_t(at - channels_.begin());
    channels_.push_back(*place);
    channel_layers_.push_back(layer);
    channel_steps_.push_back(steps_.size());
    return channels_.size() - 1;
}

void Mixer::add_step(size_t term, size_t c, float gain) {
    // 0 times a finite value never changes a fold that began at +0
    if (gain == 0.0f) return;
    Step step{term, c, {}, {}, gain};
    step.channel = request(terms_[term].layer, c);
    if (!terms_[term].clamp_layer.empty()) step.clamp = request(terms_[term].clamp_layer, c);
    if (step.channel || step.clamp) steps_.push_back(step);
}

void Mixer::note_not_finite(const std::string& layer,
                            const layers::StripChannel& channel,
                            size_t first,
                            size_t pixel) {
    const auto width = size_t(layout_.image().data.width());
    const NotFinite found = find_not_finite(channel, first, width);
    const std::scoped_lock lock(mutex_);
    const auto [at, is_new] = not_finite_.try_emplace(layer, NotFinite{0, pixel + found.first});
    at->second.count += found.count;
    at->second.first = std::min(at->second.first, pixel + found.first);
}

void Mixer::load(
    const layers::Strip& strip, size_t channel, size_t row, size_t step, float* values) {
    const image::Window& window = layout_.image().data;
    const auto width = size_t(window.width());
    const bool has_bad = load_row(strip.channels[channel], row * width, width, values);
    if (has_bad && step == channel_steps_[channel]) {
        note_not_finite(channel_layers_[channel], strip.channels[channel], row * width,
                        (size_t(strip.y0 - window.y0) + row) * width);
    }
}

void Mixer::give_back(const Step& step, size_t pixel, Rows& rows) const {
    const MixPlan::Term& term = terms_[step.term];
    for (size_t i = 0; i < rows.values.size(); ++i)
        rows.values[i] += plan_.clamp_share(term, pixel + i) * rows.clamp[i];
}

void Mixer::apply_mattes(const Step& step, size_t pixel, Rows& rows) const {
    const MixPlan::Term& term = terms_[step.term];
    for (size_t i = 0; i < rows.values.size(); ++i)
        rows.values[i] *= plan_.matte_factor(term, step.c, pixel + i);
}

void Mixer::fold_row(const layers::Strip& strip, size_t row, Rows& rows) {
    const image::Window& window = layout_.image().data;
    const size_t width = rows.values.size();
    const size_t pixel = (size_t(strip.y0 - window.y0) + row) * width;
    for (size_t s = 0; s < steps_.size(); ++s) {
        const Step& step = steps_[s];
        float* values = rows.values.data();
        if (step.channel) {
            load(strip, *step.channel, row, s, values);
        } else {
            std::fill_n(values, width, 0.0f);
        }
        if (step.clamp) {
            load(strip, *step.clamp, row, s, rows.clamp.data());
            give_back(step, pixel, rows);
        }
        if (has_mattes(terms_[step.term])) apply_mattes(step, pixel, rows);
        float* fold = fold_[step.c].data() + pixel;
        const float gain = step.gain;
        for (size_t i = 0; i < width; ++i) fold[i] += gain * values[i];
    }
    if (alpha_) load(strip, *alpha_, row, channel_steps_[*alpha_], alpha_values_.data() + pixel);
}

void Mixer::fold(const layers::Strip& strip) {
    Rows rows(size_t(layout_.image().data.width()));
    for (size_t row = 0; row < size_t(strip.y1 - strip.y0); ++row) fold_row(strip, row, rows);
}

image::Channel float_channel(std::string name, std::vector<float> values) {
    image::Channel channel;
    channel.name = std::move(name);
    channel.data = std::move(values);
    return channel;
}

image::Channel as_half(const image::Channel& channel) {
    image::Channel half =
        image::Channel::make(channel.name, image::ChannelType::Half, channel.size());
    auto& values = std::get<std::vector<Imath::half>>(half.data);
    image::for_each_value(channel, [&](size_t i, float v) { values[i] = Imath::half(v); });
    return half;
}

/// Values that are infinite once they are stored.
NotFinite beyond(image::ChannelType type, const std::vector<float>& values) {
    NotFinite found{0, values.size()};
    for (size_t i = 0; i < values.size(); ++i) {
        const bool is_finite = type == image::ChannelType::Half ? Imath::half(values[i]).isFinite()
                                                                : std::isfinite(values[i]);
        if (is_finite) continue;
        ++found.count;
        found.first = std::min(found.first, i);
    }
    return found;
}

std::string digest_of_beauty(const image::Image& image) {
    std::vector<const image::Channel*> channels;
    for (const image::Channel& c : image.parts[0].channels) channels.push_back(&c);
    return image::digest_of(image.data, channels);
}

image::Image Mixer::image(const Look& look) {
    image::Image out;
    out.data = layout_.image().data;
    image::Part rgba;
    rgba.name = "rgba";
    const auto as_stored = [this](std::string name, std::vector<float> values) {
        image::Channel channel = float_channel(std::move(name), std::move(values));
        return type_ == image::ChannelType::Half ? as_half(channel) : channel;
    };
    rgba.attributes =
        layers::carried_attributes(layout_.image().parts[layout_.beauty_part()].attributes);
    if (!layout_.view().empty()) rgba.attributes["view"] = layout_.view();
    for (size_t c = 0; c < 3; ++c)
        rgba.channels.push_back(as_stored(rgb_names[c], std::move(fold_[c])));
    if (alpha_) rgba.channels.push_back(as_stored("A", std::move(alpha_values_)));
    out.parts.push_back(std::move(rgba));

    const accumulate::LayerEntry* described = layout_.header().find("rgba");
    accumulate::LayerEntry entry = described ? *described : accumulate::LayerEntry{};
    entry.name = entry.part = "rgba";
    if (!described) entry.family = "beauty";
    entry.type = type_ == image::ChannelType::Half ? "half" : "float";
    entry.is_empty = entry.in_sum = false;
    entry.digest = digest_of_beauty(out);
    layers::ResolvedLayers resolved;
    resolved.layers.push_back(std::move(entry));
    accumulate::LayerSet set;
    set.groups = layout_.header().lights;
    layers::write_layer_header(out, resolved, set, layout_.header().samples,
                               layers::file_info_of(layout_.image(), layout_.header()));
    out.attributes[mix_attribute] = look_to_json(look);
    return out;
}

void Mixer::list_not_finite(std::vector<NotFiniteLayer>& out) const {
    const image::Window& window = layout_.image().data;
    const auto width = size_t(window.width());
    NotFinite overflow{0, window.pixel_count()};
    for (const std::vector<float>& fold : fold_) {
        const NotFinite found = beyond(type_, fold);
        if (found.count == 0) continue;
        overflow.count += found.count;
        overflow.first = std::min(overflow.first, found.first);
    }
    if (overflow.count > 0)
        out.push_back({"", overflow.count, window.x0 + int(overflow.first % width),
                       window.y0 + int(overflow.first / width)});
    for (const auto& [layer, found] : not_finite_) {
        out.push_back({layer, found.count, window.x0 + int(found.first % width),
                       window.y0 + int(found.first / width)});
    }
}

/// Of the display window; 1 where the image has none, 0 beside its data.
std::vector<float> alpha_of(const image::Image& mixed) {
    const image::Channel* const stored = mixed.parts[0].find("A");
    const image::Window& frame = mixed.display;
    std::vector<float> alpha(frame.pixel_count(), 0.0f);
    for (int y = std::max(frame.y0, mixed.data.y0); y < std::min(frame.y1, mixed.data.y1); ++y)
        for (int x = std::max(frame.x0, mixed.data.x0); x < std::min(frame.x1, mixed.data.x1); ++x)
            alpha[frame.index(x, y)] = stored ? stored->value(mixed.data.index(x, y)) : 1.0f;
    return alpha;
}

/// Returns: pixels whose light is lost as their alpha is 0.
size_t divide_by(const std::vector<float>& alpha, std::vector<float>& rgb) {
    size_t lost = 0;
    for (size_t i = 0; i < alpha.size(); ++i) {
        const std::span<float, 3> pixel(&rgb[3 * i], 3);
        if (alpha[i] > 0.0f) {
            for (float& v : pixel) v /= alpha[i];
        } else {
            lost += std::any_of(pixel.begin(), pixel.end(), [](float v) { return v > 0.0f; });
            std::fill(pixel.begin(), pixel.end(), 0.0f);
        }
    }
    return lost;
}

std::vector<float> with_alpha(const std::vector<float>& rgb, const std::vector<float>& alpha) {
    std::vector<float> rgba(4 * alpha.size());
    for (size_t i = 0; i < alpha.size(); ++i) {
        std::copy_n(&rgb[3 * i], 3, &rgba[4 * i]);
        rgba[4 * i + 3] = alpha[i];
    }
    return rgba;
}

}  // namespace

image::Image apply_mix(const LayerStack& stack,
                       const MixPlan& plan,
                       const Look& look,
                       bool with_layers,
                       std::vector<NotFiniteLayer>* not_finite,
                       image::ChannelType type) {
    if (with_layers) {
        LayeredMix layered(stack, plan, look);
        layers::for_each_strip(stack.image(), layered.channels(),
                               [&](const layers::Strip& strip) { layered.take(strip); });
        return layered.image(not_finite);
    }
    Mixer mixer(stack, plan, look, type);
    layers::for_each_strip(stack.image(), mixer.channels(),
                           [&](const layers::Strip& strip) { mixer.fold(strip); });
    if (not_finite) mixer.list_not_finite(*not_finite);
    return mixer.image(look);
}

Result<image::Image> mix_file(const layers::StripReader& file,
                              const LayerStack& layout,
                              const MixPlan& plan,
                              const Look& look,
                              bool with_layers,
                              std::vector<NotFiniteLayer>* not_finite,
                              size_t strip_bytes,
                              image::ChannelType type) {
    if (with_layers) {
        LayeredMix layered(layout, plan, look);
        const auto read = file.read(
            layered.channels(), [&](const layers::Strip& strip) { layered.take(strip); },
            strip_bytes);
        if (!read) return read.error();
        return layered.image(not_finite);
    }
    Mixer mixer(layout, plan, look, type);
    const auto done = file.read(
        mixer.channels(), [&](const layers::Strip& strip) { mixer.fold(strip); }, strip_bytes);
    if (!done) return done.error();
    if (not_finite) mixer.list_not_finite(*not_finite);
    return mixer.image(look);
}

Result<void> write_display(const std::string& path,
                           const image::Image& mixed,
                           const Look& look,
                           const ImageStorage& storage,
                           std::vector<std::string>* warnings) {
    const auto color = image::color_of(mixed, look.input_space);
    if (!color) return color.error();
    const auto transform = image::DisplayTransform::make(look.display, look.view, *color);
    if (!transform) return transform.error();
    if (warnings)
        warnings->insert(warnings->end(), transform->warnings().begin(),
                         transform->warnings().end());
    const image::Window& frame = mixed.display;
    std::vector<float> rgb(3 * frame.pixel_count(), 0.0f);
    for (size_t c = 0; c < 3; ++c) {
        const image::Channel& channel = mixed.parts[0].channels[c];
        for (int y = std::max(frame.y0, mixed.data.y0); y < std::min(frame.y1, mixed.data.y1);
             ++y) {
            for (int x = std::max(frame.x0, mixed.data.x0); x < std::min(frame.x1, mixed.data.x1);
                 ++x) {
                rgb[3 * frame.index(x, y) + c] = channel.value(mixed.data.index(x, y));
            }
        }
    }
    if (!storage.has_alpha) {
        transform->apply(rgb);
        return image::write_display_image(
            path, {frame.width(), frame.height(), 3, std::move(rgb), mixed.pixel_aspect_ratio},
            storage.display);
    }
    const std::vector<float> alpha = alpha_of(mixed);
    const size_t lost = divide_by(alpha, rgb);
    if (lost > 0 && warnings)
        warnings->push_back(fmt::format(
            "{} pixels have light and no alpha, which {} cannot store: they are transparent", lost,
            std::filesystem::path(path).extension().string()));
    transform->apply(rgb);
    return image::write_display_image(
        path, {frame.width(), frame.height(), 4, with_alpha(rgb, alpha), mixed.pixel_aspect_ratio},
        storage.display);
}

}  // namespace velatura::compositor::mix
