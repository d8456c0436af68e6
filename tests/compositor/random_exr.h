// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "image/image.h"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace velatura::compositor {

/// A file as nobody would make it and as some program might: names of any printable characters,
/// parts over windows of their own, tiles, types, NaN, odd metadata. The same for a seed.
struct RandomExr {
    enum class Beauty { Bare, Named, None, NoLight };

    struct Channel {
        std::string name;
        image::ChannelType type = image::ChannelType::Float;
        std::vector<float> values;  ///< of the part's window, as a reader gets them
    };

    struct Part {
        std::string name;
        image::Window data;
        bool is_far = false;  ///< so far off that it is skipped
        std::vector<Channel> channels;
        /// Names of layers, each once.
        std::vector<std::string> layers;
    };

    std::string what;  ///< for messages
    Beauty beauty = Beauty::Bare;
    std::string beauty_layer;  ///< of the first part; empty: bare channels
    image::Window display;
    float pixel_aspect = 1;
    std::vector<Part> parts;

    const Channel* beauty_channel(size_t c) const;
};

/// Writes it by OpenEXR alone.
RandomExr write_random_exr(uint64_t seed, const std::string& path);

}  // namespace velatura::compositor
