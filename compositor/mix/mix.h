// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "compositor/io/image_storage.h"
#include "compositor/io/layer_stack.h"
#include "compositor/look/controls.h"
#include "compositor/mix/mix_plan.h"

#include <string>
#include <vector>

namespace velatura::compositor::mix {

/// A layer whose NaN and infinite values a mix took as 0, or the mix itself, whose gains went
/// beyond what floats hold.
struct NotFiniteLayer {
    std::string layer;  ///< empty: the mix
    size_t values = 0;
    int x = 0, y = 0;  ///< the first of them, row by row
};

/// The mixed image over the data window: a part `rgba` (`type`, scene-linear, premultiplied,
/// alpha of the beauty) with a header that `verify` accepts, or with all layers of the file that
/// hold for the mix (layered_mix.h; `type` does not count then). Unit gains give the beauty bit for
/// bit, since the fold is the one that defines it. Exposure is a gain on everything. Values that
/// are not finite count as 0 and are told in `not_finite` when it is given, as are those of the
/// mix. Attributes of the file are kept, whatever their type; none is made up.
image::Image apply_mix(const LayerStack& stack,
                       const MixPlan& plan,
                       const Look& look,
                       bool with_layers,
                       std::vector<NotFiniteLayer>* not_finite = nullptr,
                       image::ChannelType type = image::ChannelType::Float);

/// The same bits from a file whose pixels are read strip by strip, by several readers: only the
/// parts and channels that the mix needs. `layout` is the file's, without pixels. Memory: the mixed
/// image and strips of at most `strip_bytes`, however many layers there are. Errors: "io-read".
Result<image::Image> mix_file(const layers::StripReader& file,
                              const LayerStack& layout,
                              const MixPlan& plan,
                              const Look& look,
                              bool with_layers,
                              std::vector<NotFiniteLayer>* not_finite = nullptr,
                              size_t strip_bytes = size_t(1) << 30,
                              image::ChannelType type = image::ChannelType::Float);

/// Shows a mixed image through the look's display and view and writes the display window of it,
/// with its pixel aspect. With alpha, colors are divided by it before they are shown; light where
/// it is 0 cannot be stored and is told. That, and what is not known of the colors, is added to
/// `warnings` when it is given. Errors: "unknown-space", "ocio-config", "ocio-view", "io-write".
Result<void> write_display(const std::string& path,
                           const image::Image& mixed,
                           const Look& look,
                           const ImageStorage& storage = {},
                           std::vector<std::string>* warnings = nullptr);

}  // namespace velatura::compositor::mix
