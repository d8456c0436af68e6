// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/denoise/denoise.h"
#include "compositor/denoise/denoise_choice.h"

namespace velatura::compositor::denoise {

/// True for light, which is filtered; false for data, mattes and half images (those go with their
/// layer).
bool is_filtered(const accumulate::LayerEntry& entry);

/// What denoising reads without looking twice: the beauty as floats, light layers and half images
/// whole, two half images or none, albedo and N whole where they are stored. A half image may be
/// listed as black. Errors: "layer-missing" (the header names it as stored), "layers-damaged" (not
/// the type of light), "denoise-inputs" (one half image without the other).
Result<void> check_denoisable(const LayerStack& stack);

/// A copy of the file to be filled, without exact sums: what is denoised does not merge. Layers
/// whose filtered values may not fit half are float. Errors: "denoised-twice".
Result<image::Image> denoised_file_like(const LayerStack& stack);

/// After the filtered layers are in: makes the beauty their fold, settles coarser families, the
/// variance and the header. Errors: "closure-failed".
Result<void> finish_denoised_file(const LayerStack& stack,
                                  const DenoiseGuides& guides,
                                  const FilterChoice& choice,
                                  image::Image& out,
                                  DenoiseReport& report);

}  // namespace velatura::compositor::denoise
