// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "image/window.h"

#include <cstdint>
#include <string>
#include <vector>

namespace velatura::layers {

/// A wish for further samples of a render where a mix of its layers is noisy: what
/// `velatura-comp request` writes and `velatura render --for-mix` reads.
struct TopUpRequest {
    std::string scene_hash, settings_hash;  ///< of the render
    double samples = 0;            ///< per pixel in the mean, those that are there included
    std::string look_json = "{}";  ///< of the mix
    image::Window window;
    /// [pixel of the window] Samples in proportion to it lower the error of the mix most. A pixel's
    /// own samples must not enter into its own value, only into those of pixels up to
    /// `top_up_reach` away, so that the image keeps its mean.
    std::vector<float> priority;
    std::vector<uint64_t> present;  ///< samples of every pixel when the request was made
};

inline constexpr int top_up_reach = 3;  ///< pixels, in each direction

/// Writes `path`, a JSON file, and beside it the priorities as STEM.priority.exr. Errors:
/// "io-write", "verify-failed", "bad-request" (2^32 samples or more).
Result<void> write_top_up(const std::string& path, const TopUpRequest& request);

/// Errors: "io-open", "io-read", "bad-request" (no request, or damaged).
Result<TopUpRequest> read_top_up(const std::string& path);

/// How many samples every pixel should have, so that there are `mean` of them in the mean, none has
/// fewer than are there, and the others are powers of two (docs/engineering/hard_cases.md H45) in
/// proportion to the priority.
///
/// A pixel's count depends on its own samples in no way: its priority does not, and the factor of
/// proportion is reckoned tile by tile from the pixels that are further away than `top_up_reach`.
/// Args: priority, present = of the request, so that a render stopped on the way comes to the same
/// counts; mean = taken as 0 where it is no number, and as 2^32 - 1 where it is more.
std::vector<uint64_t> place_samples(const image::Window& window,
                                    const std::vector<float>& priority,
                                    const std::vector<uint64_t>& present,
                                    double mean);

}  // namespace velatura::layers
