// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/denoised_layers.h"

#include "compositor/denoise/denoise.h"
#include "image/digest.h"
#include "layers/layer_check.h"
#include "layers/layer_header.h"
#include "layers/resolve.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <variant>
#include <vector>

namespace velatura::compositor::window {

namespace {

/// The header of pixels that were changed since.
void renew_digests(image::Image& image, const layers::LayerHeader& header) {
    layers::ResolvedLayers resolved;
    resolved.closure = header.closure;
    resolved.layers = header.layers;
    const auto channels = layers::channels_by_layer(image);
    for (accumulate::LayerEntry& entry : resolved.layers) {
        const auto at = channels.find(entry.name);
        if (at != channels.end()) entry.digest = image::digest_of(image.data, at->second);
    }
    accumulate::LayerSet set;
    set.groups = header.lights;
    layers::write_layer_header(image, resolved, set, header.samples,
                               layers::file_info_of(image, header));
}

/// Those of a region over a whole image have none.
bool has_digests(const layers::LayerHeader& header) {
    return std::none_of(header.layers.begin(), header.layers.end(),
                        [](const accumulate::LayerEntry& entry) {
                            return !entry.is_empty && entry.digest.empty();
                        });
}

/// A mean of n pixels has a variance n times smaller.
void scale_variance(image::Image& image, float factor) {
    for (image::Part& part : image.parts)
        for (image::Channel& channel : part.channels) {
            if (channel.name != "variance") continue;
            if (auto* values = std::get_if<std::vector<float>>(&channel.data))
                for (float& v : *values) v *= factor;
        }
}

}  // namespace

Result<std::shared_ptr<const Levels>> denoised_levels(const Levels& levels, size_t level) {
    denoise::DenoiseReport report;
    Result<image::Image> image = Error{"", ""};
    const LayerStack& shown = levels.stack(level);
    if (shown.is_plain()) return Error{"not-layers", "the denoiser needs a file of light layers"};
    if (level == 0 && has_digests(shown.header())) {
        image = denoise::denoise(shown, report);
    } else {
        image::Image smaller = shown.image();
        scale_variance(smaller, float(std::ldexp(1.0, -2 * int(level))));
        renew_digests(smaller, shown.header());
        auto stack = LayerStack::from_image(std::move(smaller));
        if (!stack) return stack.error();
        image = denoise::denoise(*stack, report);
    }
    if (!image) return image.error();
    auto stack = LayerStack::from_image(std::move(*image));
    if (!stack) return stack.error();
    const image::Window& frame = levels.image_frame();
    auto made = Levels::make_draft(std::make_shared<const LayerStack>(std::move(*stack)),
                                   levels.reduction() << level, frame.width(), frame.height());
    if (!made) return made.error();
    return std::make_shared<const Levels>(std::move(*made));
}

void DenoisedLayers::offer(std::shared_ptr<const Levels> levels) {
    if (levels == newest_) return;
    newest_ = std::move(levels);
    is_done_ = false;
}

void DenoisedLayers::advance(bool stays) {
    if (!newest_ || is_done_ || jobs_.is_busy()) return;
    const size_t quick = newest_->quick_level();
    const bool is_new = begun_ != newest_;
    if (!is_new && (is_begun_whole_ || !stays)) return;
    const size_t level = is_new ? quick : 0;
    begun_ = newest_;
    is_begun_whole_ = level == 0;
    jobs_.add([levels = newest_, level] { return denoised_levels(*levels, level); });
}

std::optional<Result<std::shared_ptr<const Levels>>> DenoisedLayers::take() {
    auto taken = jobs_.take();
    if (taken && begun_ == newest_ && (is_begun_whole_ || !*taken)) is_done_ = true;
    return taken;
}

void DenoisedLayers::clear() {
    newest_.reset();
    begun_.reset();
    is_begun_whole_ = false;
    is_done_ = true;
    jobs_.drop();
}

}  // namespace velatura::compositor::window
