// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "image/display.h"
#include "image/image.h"

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace velatura::compositor::inspect {

/// A layer of an EXR file by its channels, whatever wrote it.
struct LayerChannels {
    enum class Kind : uint8_t {
        Light,      ///< R G B and perhaps more, scene-linear
        Albedo,     ///< R G B in [0, 1]
        Direction,  ///< X Y Z in [−1, 1]
        Position,   ///< X Y Z anywhere
        Plane,      ///< two channels, texture coordinates
        Ids,        ///< whole numbers
        Matte,      ///< ranks of a Cryptomatte: id and coverage, twice
        Scalar      ///< anything else
    };

    std::string name;  ///< `rgba` for the bare R G B
    std::vector<const image::Channel*> channels;

    Kind kind() const;
};

/// In the file's order, alpha with its colors; bookkeeping left out. Of layers with one name in
/// several parts, the first keeps it; the others are named by their part.
std::vector<LayerChannels> layers_of(const image::Image& image);

/// Mean luminance (linear Rec.709) over the data window; values that are not finite count as 0.
/// Only for Kind::Light, as the next.
double mean_luminance(const LayerChannels& layer);

/// The stops that bring the 95th percentile of the luminance to 0.8; 0 for what is black.
float fitting_stops(const LayerChannels& layer);

/// The values of a layer that are finite and not 0.
struct ValueRange {
    float low = std::numeric_limits<float>::infinity(),
          high = -std::numeric_limits<float>::infinity();
};

/// What thumbnail() shows from black to white, of Kind::Scalar alone: null for other layers, and
/// where all is 0.
std::optional<ValueRange> shown_range(const LayerChannels& layer);

/// A layer as people can see it, over the display window: means over the pixels, then the display
/// transform or false colors. Returns: [height][width][3] in [0, 1].
std::vector<float> thumbnail(const image::Image& image,
                             const LayerChannels& layer,
                             int width,
                             int height,
                             float stops,
                             const image::DisplayTransform& transform);

}  // namespace velatura::compositor::inspect
