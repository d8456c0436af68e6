// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/matte_pick.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>

namespace velatura::compositor::window {

namespace {

const image::Channel* rank_channel(const image::Image& image,
                                   const std::string& layer,
                                   size_t rank,
                                   size_t place) {
    // Two ranks to a layer of four channels: id and coverage in RG, then in BA
    static constexpr const char* short_names[] = {"R", "G", "B", "A"};
    static constexpr const char* long_names[] = {"red", "green", "blue", "alpha"};
    const std::string name = fmt::format("{}{:02}.", layer, rank / 2);
    const size_t c = 2 * (rank % 2) + place;
    const image::Channel* channel = image.find(name + short_names[c]);
    if (!channel) channel = image.find(name + long_names[c]);
    return channel && channel->type() == image::ChannelType::Float ? channel : nullptr;
}

}  // namespace

std::string PickedObject::text() const {
    return fmt::format("{} {:.0f} %",
                       name.empty() ? fmt::format("id {:08x} without a name", id) : name,
                       100 * coverage);
}

MattePicker::MattePicker(const LayerStack& stack)
    : mattes_(layers::cryptomattes_of(stack.image(), stack.path())) {
    for (const layers::Cryptomatte& matte : mattes_) {
        if (rank_channel(stack.image(), matte.layer, 0, 0)) layers_.push_back(matte.layer);
    }
}

std::vector<PickedObject> MattePicker::at(const LayerStack& stack,
                                          const std::string& layer,
                                          int x,
                                          int y) const {
    std::vector<PickedObject> objects;
    const image::Image& image = stack.image();
    const int fx = x + image.display.x0, fy = y + image.display.y0;
    const auto matte = std::find_if(mattes_.begin(), mattes_.end(),
                                    [&](const layers::Cryptomatte& m) { return m.layer == layer; });
    if (matte == mattes_.end() || !image.data.contains(fx, fy)) return objects;
    const size_t pixel = image.data.index(fx, fy);
    for (size_t rank = 0;; ++rank) {
        const image::Channel* ids = rank_channel(image, layer, rank, 0);
        const image::Channel* shares = rank_channel(image, layer, rank, 1);
        if (!ids || !shares) break;
        const auto id = std::bit_cast<uint32_t>(ids->value(pixel));
        const float coverage = shares->value(pixel);
        if (id == 0 || !(coverage > 0)) continue;
        const auto named = std::find_if(matte->names.begin(), matte->names.end(),
                                        [&](const layers::MatteName& n) { return n.id == id; });
        objects.push_back(
            {layer, named == matte->names.end() ? std::string() : named->name, id, coverage});
    }
    std::stable_sort(objects.begin(), objects.end(),
                     [](const auto& a, const auto& b) { return a.coverage > b.coverage; });
    return objects;
}

std::string matte_text(const std::string& layer, std::span<const std::string> names) {
    if (names.empty()) return {};
    std::string text = layer + ":";
    for (const std::string& name : names) {
        if (&name != &names.front()) text += ',';
        // One name counts as it stands
        for (const char c : name) {
            if (names.size() > 1 && c == ',') text += '\\';
            text += c;
        }
    }
    return text;
}

}  // namespace velatura::compositor::window
