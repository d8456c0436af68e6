// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <functional>

namespace velatura::bench {

/// What a render spends its time on.
enum class Part { Tracing, Surfaces, Shading, Texture, Lights, Sampling, Film, Loop, Other, Count };

const char* name_of(Part part);

/// Shares of time, by Part; they sum to 1.
using Shares = std::array<double, size_t(Part::Count)>;

/// Runs work on the calling thread while a timer notes every half millisecond which function is at
/// work, and says to which tier they belong. What is inlined counts for the tier that it is inlined
/// into; Tracing is accel and the quadrics that it asks, Other what is in libraries, mathematical
/// functions above all. All zero where the system does not tell.
Shares profile(const std::function<void()>& work);

/// Instructions that the calling thread executes for work; 0 where the processor's counters are out
/// of reach, as on many virtual machines.
double instructions_of(const std::function<void()>& work);

}  // namespace velatura::bench
