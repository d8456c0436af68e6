// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <limits>

namespace velatura {

/// Where images are decoded, and how much that may take.
struct DecodeLimits {
    /// In decoder processes; else in the process that uses them: for trusted files.
    bool is_sandboxed = true;
    /// CPU time of a decoder process for one request; ten times as long by the clock.
    double seconds = 60;
    size_t bytes = size_t(8) << 30;  ///< memory of a decoder process
    /// Images that may take more, or more than `bytes`, have a decoder process anyway.
    size_t in_process_bytes = std::numeric_limits<size_t>::max();
};

/// What the files of a scene may ask for before a reader says no: far beyond what people make, and
/// far below what ends a machine. What protects the stack (depths) or follows from bytes that are
/// there has no place here.
struct Limits {
    size_t prims = 20'000'000;  ///< of one stage
    size_t prims_per_spec =
        1000;                 ///< composed sites that one spec may give rise to, on the average
    size_t layers = 100'000;  ///< opened for one stage
    size_t array_bytes =
        size_t(1)
        << 30;  ///< of what a .usdc file holds compressed, beside 1024 for each of its bytes
    int image_side = 1 << 20;  ///< pixels of a texture
    DecodeLimits decoding;
};

/// Those of this process, which its readers ask. Plugins have none of their own: they are told.
const Limits& limits();

/// Those for the decoders of this process at this moment: what is decoded in it takes a part of
/// what a MemoryLimit leaves.
DecodeLimits decode_limits();

/// Before the scene is opened: not while other threads read.
void set_limits(const Limits& limits);

}  // namespace velatura
