// SPDX-License-Identifier: Apache-2.0
#include "compositor/mix/not_finite_layers.h"

#include "compositor/io/row_values.h"
#include "layers/strip_reader.h"

#include <algorithm>
#include <utility>

namespace velatura::compositor::mix {

using accumulate::LayerEntry;
using image::Channel;
using image::ChannelType;

void NotFiniteLayers::note(const NotFiniteLayer& found) {
    const std::scoped_lock lock(mutex_);
    const auto [at, is_new] = found_.try_emplace(found.layer, found);
    if (is_new) return;
    at->second.values += found.values;
    if (std::pair(found.y, found.x) < std::pair(at->second.y, at->second.x)) {
        at->second.x = found.x;
        at->second.y = found.y;
    }
}

void NotFiniteLayers::clear(const std::string& layer, const image::Window& data, Channel& channel) {
    if (channel.type() == ChannelType::Uint) return;
    const layers::StripChannel stored{channel.type(), channel.bytes()};
    Values finite(channel.size());
    if (load_row(stored, 0, finite.size(), finite.data())) {
        const NotFinite found = find_not_finite(stored, 0, finite.size());
        const auto width = size_t(data.width());
        note({layer, found.count, data.x0 + int(found.first % width),
              data.y0 + int(found.first / width)});
    }
    channel.data = std::move(finite);
}

void NotFiniteLayers::clear(LayeredImage& image) {
    using enum LayerOutcome;
    const LayeredPlan& plan = image.plan();
    const image::Window& data = image.image().data;
    image.for_each({Graded, Shadow, Beside, Uniform, Clamp},
                   [&](const LayerEntry&, const LayerChannel& of) {
                       clear(of.full_name(), data, *image.channel(of));
                   });
    const bool is_gained = plan.mix.family == "beauty" || plan.mix.family == "plain";
    for (size_t c = is_gained ? 0 : 3; c < 4; ++c) {
        const auto stored = plan.layout.place("rgba", c);
        const auto place = stored ? image.place_of(*stored) : std::nullopt;
        // Shades of gray have one channel for all three; rows are cleared with the others
        const bool is_row = c == 3 && plan.layout.is_plain() && !plan.layout.has_beauty();
        if (!place || is_row) continue;
        Channel* const split = c < 3 ? image.channel({"rgba", "", c}) : nullptr;
        Channel& of_beauty = split ? *split : image.at(*place);
        const ChannelType type = of_beauty.type();
        clear("rgba", data, of_beauty);
        if (c == 3 && type == ChannelType::Half) make_half(of_beauty);
    }
}

std::optional<NotFiniteLayer> find_overflow(LayeredImage& image) {
    using enum LayerOutcome;
    const image::Window& data = image.image().data;
    NotFinite all{0, data.pixel_count()};
    std::mutex mutex;
    image.for_each({Beauty, Graded, Sum, Shadow, Beside, Uniform, Clamp},
                   [&](const LayerEntry&, const LayerChannel& of) {
                       const Channel& channel = *image.channel(of);
                       const NotFinite found =
                           find_not_finite({channel.type(), channel.bytes()}, 0, channel.size());
                       const std::scoped_lock lock(mutex);
                       all.count += found.count;
                       if (found.count > 0) all.first = std::min(all.first, found.first);
                   });
    if (all.count == 0) return std::nullopt;
    const auto width = size_t(data.width());
    return NotFiniteLayer{"", all.count, data.x0 + int(all.first % width),
                          data.y0 + int(all.first / width)};
}

}  // namespace velatura::compositor::mix
