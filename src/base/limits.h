// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

namespace velatura {

/// How long and how much the decoder of one picture may take, in a process of its own.
struct DecodeLimits {
    double seconds = 60;  ///< of CPU time, for one request; ten times as long by the clock
    size_t bytes = size_t(8) << 30;
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
    int picture_side = 1 << 20;  ///< pixels of a texture
    DecodeLimits decoding;
};

/// Those of this process, which its readers ask. Plugins have none of their own: they are told.
const Limits& limits();

/// Before the scene is opened: not while other threads read.
void set_limits(const Limits& limits);

}  // namespace velatura
