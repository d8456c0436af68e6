// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/render_frame.h"

#include <cstdint>
#include <string>
#include <vector>

namespace velatura::app {

/// What an image with its layers takes, in memory and in files, by its size and what is asked for
/// alone.
struct ImageNeeds {
    struct File {
        std::string name;
        int layers = 0, channels = 0;
        uint64_t max_bytes = 0;   ///< before compression, without sums
        uint64_t sums_bytes = 0;  ///< expected, of the sums that a render goes on from
    };

    std::vector<File> files;
    uint64_t film_bytes = 0;   ///< expected, with all samples, of layers that have light everywhere
    uint64_t splat_bytes = 0;  ///< expected, of light tracing where it may be used
    uint64_t writing_bytes = 0;  ///< expected, beside the film, while it is written
};

/// Channels that a script of Nuke may have; more of a file are not read.
inline constexpr int max_host_channels = 1023;

/// Says so if the file may have more, and what to leave out.
void warn_of_many_channels(const RenderJob& job, const FrameInput& input, Diagnostics& diagnostics);

ImageNeeds image_needs(const RenderJob& job, const FrameInput& input);

}  // namespace velatura::app
