// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/mix/layer_outcomes.h"
#include "compositor/mix/layered_plan.h"
#include "image/image.h"
#include "layers/strip_reader.h"

#include <cstddef>
#include <functional>
#include <initializer_list>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace velatura::compositor::mix {

using Values = std::vector<float>;

Values floats_of(const image::Channel& channel);

/// Rounds a channel of floats to halves.
void make_half(image::Channel& channel);

/// The image of a mix with layers, and where in it the channels of the file and of its layers are.
/// It is laid out by make_layered_image (layered_parts.h), filled strip by strip, then changed in
/// place.
class LayeredImage {
  public:
    using Place = std::pair<size_t, size_t>;  ///< part and channel of the image

    /// Without parts. Refers to `plan`.
    explicit LayeredImage(const LayeredPlan& plan);

    const LayeredPlan& plan() const { return plan_; }

    image::Image& image() { return image_; }

    /// A channel of the file is kept at `to`; its values come in strips, or are computed.
    void keep(const layers::ChannelRef& from, Place to, bool is_computed);
    /// Appends a channel to a part.
    void add(const LayerChannel& as, size_t part, image::Channel channel);
    /// A channel that is there already is that of a layer, too.
    void assign(const LayerChannel& as, Place at);

    /// What strips must hold.
    std::span<const layers::ChannelRef> channels() const { return read_; }

    /// Strips may come in any order and from several threads.
    void take(const layers::Strip& strip);

    /// Empty: the channel of the file, or the layer, is not in the image.
    std::optional<Place> place_of(const layers::ChannelRef& from) const;
    std::optional<Place> place_of(const LayerChannel& of) const;

    bool has(const LayerChannel& of) const { return place_of(of).has_value(); }

    image::Channel& at(Place place) { return image_.parts[place.first].channels[place.second]; }

    /// Null where the layer is not in the image.
    image::Channel* channel(const LayerChannel& of);
    /// The same as floats: a channel of another type becomes one of floats.
    Values* values(const LayerChannel& of);

    /// R, G and B of the layers of some outcomes and of their half images, in parallel.
    void for_each(
        std::initializer_list<LayerOutcome> outcomes,
        const std::function<void(const accumulate::LayerEntry&, const LayerChannel&)>& body) const;

  private:
    const LayeredPlan& plan_;
    image::Image image_;
    std::vector<layers::ChannelRef> read_;
    std::vector<Place> to_;                                   ///< by index in read_
    std::map<std::pair<size_t, size_t>, Place> of_file_;      ///< by part and channel of the file
    std::map<std::pair<std::string, size_t>, Place> layers_;  ///< of layers that were added
};

}  // namespace velatura::compositor::mix
