// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "compositor/io/image_storage.h"
#include "compositor/look/controls.h"

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace velatura::compositor::mix {

/// What `velatura-comp mix` does with a file, or with each frame of a sequence.
struct MixJob {
    std::vector<std::string> inputs;  ///< .exr; several are one mix (input_files.h)
    std::string output;  ///< .exr or a display image; all may be sequences (base/frames.h)
    std::string view;    ///< of a stereo file; empty: the first
    Look look;
    std::string plate;                      ///< .exr under the mix (plate.h); empty: none
    bool with_layers = false;               ///< only to .exr, without a plate
    ImageStorage storage;                   ///< of the output
    bool is_lenient = false;                ///< leaves out what the file lacks
    bool is_strict = false;                 ///< refuses values that are not finite
    size_t memory_bytes = size_t(4) << 30;  ///< for all frames at work, of a sequence
};

/// How many frames are mixed side by side, and what each of them takes.
struct MemoryShare {
    size_t frames = 1;
    size_t frame_bytes = 0;  ///< image, mattes and gained layers; may be more than there is
    size_t strip_bytes = 0;  ///< for the readers of a frame
};

/// By what the first frame that is there needs.
MemoryShare share_memory(const MixJob& job, const std::vector<int>& frames);

/// Mixes one frame and writes the result under a temporary name, renamed when it is whole. Returns:
/// warnings. `frame` is where keys of the look are read; plate: of that frame.
/// Errors: "no-frame" (keys and no frame), "not-finite" (strict), and those of opening, planning
/// and writing.
Result<std::vector<std::string>> mix_one(const MixJob& job,
                                         const std::vector<std::string>& inputs,
                                         const std::string& output,
                                         std::optional<double> frame,
                                         size_t strip_bytes,
                                         const std::string& plate = {});

/// What became of a frame.
struct FrameOutcome {
    int frame = 0;
    std::string output;
    std::vector<std::string> warnings;
    std::optional<Error> error;  ///< "frame-missing", or as mix_one
};

/// Mixes frames side by side, as many as the memory allows. `told` is called once per frame, by one
/// thread at a time.
void mix_sequence(const MixJob& job,
                  const std::vector<int>& frames,
                  const std::function<void(const FrameOutcome&)>& told);

}  // namespace velatura::compositor::mix
