// SPDX-License-Identifier: Apache-2.0
#include "compositor/mix/layered_image.h"

#include "base/tasks.h"

#include <algorithm>
#include <cstring>
#include <variant>

namespace velatura::compositor::mix {

using accumulate::LayerEntry;
using image::Channel;

Values floats_of(const Channel& channel) {
    Values values(channel.size());
    image::for_each_value(channel, [&](size_t i, float v) { values[i] = v; });
    return values;
}

void make_half(Channel& channel) {
    const auto& values = std::get<Values>(channel.data);
    std::vector<Imath::half> halves(values.size());
    for (size_t i = 0; i < values.size(); ++i) halves[i] = Imath::half(values[i]);
    channel.data = std::move(halves);
}

LayeredImage::LayeredImage(const LayeredPlan& plan) : plan_(plan) {
    const image::Image& file = plan.layout.image();
    image_.data = file.data;
    image_.display = file.display;
    image_.pixel_aspect_ratio = file.pixel_aspect_ratio;
}

void LayeredImage::keep(const layers::ChannelRef& from, Place to, bool is_computed) {
    of_file_[{from.part, from.channel}] = to;
    if (is_computed) return;
    read_.push_back(from);
    to_.push_back(to);
}

void LayeredImage::add(const LayerChannel& as, size_t part, Channel channel) {
    auto& channels = image_.parts[part].channels;
    assign(as, {part, channels.size()});
    channels.push_back(std::move(channel));
}

void LayeredImage::assign(const LayerChannel& as, Place at) {
    layers_[{as.full_name(), as.c}] = at;
}

void LayeredImage::take(const layers::Strip& strip) {
    const size_t first = image_.data.index(image_.data.x0, strip.y0);
    const size_t count = size_t(strip.y1 - strip.y0) * size_t(image_.data.width());
    for (size_t i = 0; i < to_.size(); ++i) {
        Channel& to = at(to_[i]);
        const size_t bytes = to.byte_count() / to.size();
        std::memcpy(static_cast<char*>(to.bytes()) + first * bytes, strip.channels[i].values,
                    count * bytes);
    }
}

std::optional<LayeredImage::Place> LayeredImage::place_of(const layers::ChannelRef& from) const {
    const auto known = of_file_.find({from.part, from.channel});
    if (known == of_file_.end()) return std::nullopt;
    return known->second;
}

std::optional<LayeredImage::Place> LayeredImage::place_of(const LayerChannel& of) const {
    const std::string name = of.full_name();
    if (const auto added = layers_.find({name, of.c}); added != layers_.end()) return added->second;
    const auto stored = plan_.layout.place(name, of.c);
    return stored ? place_of(*stored) : std::nullopt;
}

Channel* LayeredImage::channel(const LayerChannel& of) {
    const auto place = place_of(of);
    return place ? &at(*place) : nullptr;
}

Values* LayeredImage::values(const LayerChannel& of) {
    Channel* const found = channel(of);
    if (!found) return nullptr;
    if (!std::holds_alternative<Values>(found->data)) found->data = floats_of(*found);
    return std::get_if<Values>(&found->data);
}

void LayeredImage::for_each(
    std::initializer_list<LayerOutcome> outcomes,
    const std::function<void(const LayerEntry&, const LayerChannel&)>& body) const {
    std::vector<std::pair<const LayerEntry*, LayerChannel>> jobs;
    for (const LayerEntry& e : plan_.layout.header().layers) {
        const auto outcome = plan_.outcomes.find(e.name);
        if (e.family == "halves" || outcome == plan_.outcomes.end()) continue;
        if (std::find(outcomes.begin(), outcomes.end(), outcome->second) == outcomes.end())
            continue;
        for (const std::string& half : plan_.halves) {
            for (size_t c = 0; c < 3; ++c)
                if (has({e.name, half, c})) jobs.push_back({&e, {e.name, half, c}});
        }
    }
    parallel_for(jobs.size(), [&](size_t i) { body(*jobs[i].first, jobs[i].second); });
}

}  // namespace velatura::compositor::mix
