// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accumulate/layer_sources.h"
#include "accumulate/sample_sums.h"
#include "image/image.h"

#include <array>
#include <string>
#include <vector>

namespace velatura::layers {

/// Of which samples.
enum class Selection { All, HalfA, HalfB };

using Planes = std::array<std::vector<float>, 3>;  // R, G, B, each [height][width]

struct Extent {
    float largest = 0.0f;
    bool is_finite = true;
    size_t bad_pixel = 0;
};

/// What the sums of every pixel are divided by.
std::vector<double> pixel_weights(const accumulate::SampleSums& sums, Selection selection);

/// The mean of a layer in every pixel.
Planes layer_planes(const accumulate::SampleSums& sums,
                    const std::vector<double>& weights,
                    const accumulate::LayerSource& source,
                    Selection selection);

Extent extent_of(const Planes& planes);

/// Rounds to the stored precision.
image::Channel stored_channel(std::string name, std::vector<float> plane, image::ChannelType type);

}  // namespace velatura::layers
