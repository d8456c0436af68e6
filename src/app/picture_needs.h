// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/render_frame.h"

#include <cstdint>
#include <string>
#include <vector>

namespace velatura::app {

/// What a picture with its layers takes, in memory and in files, by its size and what is asked for
/// alone.
struct PictureNeeds {
    struct File {
        std::string name;
        int layers = 0, channels = 0;
        uint64_t most_bytes = 0;  ///< before compression, without sums
        uint64_t sums_bytes = 0;  ///< expected, of the sums that a render goes on from
    };

    std::vector<File> files;
    uint64_t film_bytes = 0;  ///< expected, with all samples, of layers that have light everywhere
    uint64_t writing_bytes = 0;  ///< expected, beside the film, while it is written
};

PictureNeeds picture_needs(const RenderJob& job, const FrameInput& input);

}  // namespace velatura::app
