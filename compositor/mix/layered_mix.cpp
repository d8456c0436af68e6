// SPDX-License-Identifier: Apache-2.0
#include "compositor/mix/layered_mix.h"

#include "compositor/io/file_attributes.h"
#include "compositor/mix/layer_gains.h"
#include "compositor/mix/layered_header.h"
#include "compositor/mix/layered_parts.h"
#include "compositor/mix/layered_storage.h"
#include "compositor/mix/not_finite_layers.h"

#include <cmath>
#include <optional>
#include <utility>
#include <variant>

namespace velatura::compositor::mix {

LayeredMix::LayeredMix(const LayerStack& layout, const MixPlan& plan, const Look& look)
    : look_(look),
      plan_(layout, plan, std::exp2(look.exposure_stops)),
      image_(make_layered_image(plan_)) {}

/// A render var may have the beauty under a name of its own.
void LayeredMix::replace_copies_of_beauty(const std::array<Values, 3>& rendered) {
    if (plan_.layout.is_plain()) return;
    for (const accumulate::LayerEntry& e : plan_.layout.header().layers) {
        if (e.family != "data") continue;
        bool is_copy = true;
        for (size_t c = 0; c < 3 && is_copy; ++c) {
            const image::Channel* of = image_.channel({e.name, "", c});
            const auto* stored = of ? std::get_if<Values>(&of->data) : nullptr;
            is_copy = stored && *stored == rendered[c];
        }
        if (!is_copy) continue;
        for (size_t c = 0; c < 3; ++c)
            image_.channel({e.name, "", c})->data = image_.channel({"rgba", "", c})->data;
        plan_.outcomes[e.name] = LayerOutcome::Beauty;
    }
}

image::Image LayeredMix::image(std::vector<NotFiniteLayer>* not_finite) {
    const bool is_plain = plan_.layout.is_plain();
    std::array<Values, 3> rendered;
    for (size_t c = 0; c < 3; ++c)
        if (const image::Channel* beauty = image_.channel({"rgba", "", c}))
            rendered[c] = floats_of(*beauty);
    std::optional<GrayRows> gray;
    if (is_plain) gray.emplace(image_);
    NotFiniteLayers cleared;
    cleared.clear(image_);
    LayerGains gains(image_);
    std::array<Values, 3> sum_of_rows;
    if (is_plain)
        sum_of_rows = gains.apply_to_rows();
    else
        gains.apply();
    if (not_finite) {
        if (auto beyond = find_overflow(image_)) not_finite->push_back(*beyond);
        for (const auto& [layer, found] : cleared.found()) not_finite->push_back(found);
    }
    gains.set_variance();
    replace_copies_of_beauty(rendered);
    restore_types(image_);
    if (gray) gray->join();
    if (is_plain && !plan_.layout.has_beauty()) add_beauty_of_rows(image_, std::move(sum_of_rows));
    if (!is_plain) write_layered_header(image_);
    image_.image().attributes[mix_attribute] = look_to_json(look_);
    return std::move(image_.image());
}

}  // namespace velatura::compositor::mix
