// SPDX-License-Identifier: Apache-2.0
#include "view/film_levels.h"

#include "layers/layer_header.h"
#include "layers/layer_image.h"
#include "layers/resolve.h"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

namespace velatura::view {

using compositor::LayerStack;
using compositor::window::Levels;

namespace {

/// With room for every channel of the other one; what is new is black.
void add_channels(image::Image& image, const image::Image& other) {
    for (const image::Part& part : other.parts) {
        auto at = std::find_if(image.parts.begin(), image.parts.end(),
                               [&](const image::Part& p) { return p.name == part.name; });
        if (at == image.parts.end()) {
            image::Part none;
            none.name = part.name;
            none.attributes = part.attributes;
            at = image.parts.insert(image.parts.end(), std::move(none));
        }
        for (const image::Channel& channel : part.channels) {
            if (!at->find(channel.name))
                at->channels.push_back(
                    image::Channel::make(channel.name, channel.type(), image.data.pixel_count()));
        }
    }
}

/// Writes the part's pixels, black where it does not store the channel.
void copy_pixels(image::Channel& to,
                 const image::Window& of_to,
                 const image::Channel* from,
                 const image::Window& of_from) {
    if (from && from->type() != to.type() && to.type() != image::ChannelType::Float) {
        std::vector<float> wide(to.size());
        for (size_t i = 0; i < wide.size(); ++i) wide[i] = to.value(i);
        to.data = std::move(wide);
    }
    const int x0 = std::max(of_to.x0, of_from.x0), x1 = std::min(of_to.x1, of_from.x1);
    std::visit(
        [&](auto& values) {
            using Values = std::decay_t<decltype(values)>;
            using T = typename Values::value_type;
            const Values* const same = from ? std::get_if<Values>(&from->data) : nullptr;
            for (int y = std::max(of_to.y0, of_from.y0); y < std::min(of_to.y1, of_from.y1); ++y)
                for (int x = x0; x < x1; ++x) {
                    T& value = values[of_to.index(x, y)];
                    const size_t i = of_from.index(x, y);
                    value = same ? (*same)[i] : from ? T(from->value(i)) : T(0);
                }
        },
        to.data);
}

/// The image with the part over it; none: they do not have the same layers.
std::optional<image::Image> put_over(const image::Image& behind, const image::Image& part) {
    const auto of_whole = layers::read_layer_header(behind),
               of_part = layers::read_layer_header(part);
    if (!of_whole || !of_part || of_whole->layers.size() != of_part->layers.size() ||
        of_whole->closure.size() != of_part->closure.size())
        return std::nullopt;
    layers::ResolvedLayers resolved;
    resolved.layers = of_whole->layers;
    resolved.closure = of_whole->closure;
    for (size_t i = 0; i < resolved.layers.size(); ++i) {
        accumulate::LayerEntry& entry = resolved.layers[i];
        const accumulate::LayerEntry& other = of_part->layers[i];
        if (entry.name != other.name) return std::nullopt;
        if (entry.is_empty) entry = other;
        entry.digest.clear();
    }
    // Layers are folded in the order in which they are listed
    for (size_t f = 0; f < resolved.closure.size(); ++f) {
        std::vector<std::string>& order = resolved.closure[f].order;
        const std::vector<std::string> own = order, others = of_part->closure[f].order;
        order.clear();
        const auto has = [](const std::vector<std::string>& names, const std::string& name) {
            return std::find(names.begin(), names.end(), name) != names.end();
        };
        for (const accumulate::LayerEntry& entry : resolved.layers)
            if (has(own, entry.name) || has(others, entry.name)) order.push_back(entry.name);
    }
    image::Image whole = behind;
    add_channels(whole, part);
    for (image::Part& p : whole.parts)
        for (image::Channel& channel : p.channels)
            copy_pixels(channel, whole.data, part.find(channel.name), part.data);
    accumulate::LayerSet set;
    set.groups = of_whole->lights;
    layers::write_layer_header(whole, resolved, set, of_whole->samples,
                               layers::file_info_of(behind, *of_whole));
    return whole;
}

}  // namespace

Result<std::shared_ptr<const Levels>> film_levels(const film::Film& film,
                                                  const film::FileInfo& info,
                                                  int reduction,
                                                  const image::Window& frame,
                                                  const image::Image* behind) {
    auto image = layers::make_layer_image(film.sums(), info, false);
    if (!image) return image.error();
    if (behind) {
        if (auto whole = put_over(*behind, image->image)) image->image = std::move(*whole);
    }
    auto stack = LayerStack::from_image(std::move(image->image));
    if (!stack) return stack.error();
    auto levels = Levels::make_draft(std::make_shared<const LayerStack>(std::move(*stack)),
                                     reduction, frame.width(), frame.height());
    if (!levels) return levels.error();
    return std::make_shared<const Levels>(std::move(*levels));
}

}  // namespace velatura::view
