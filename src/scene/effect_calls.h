// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "scene/effect.h"

#include <array>
#include <cstdint>
#include <utility>

namespace velatura::scene {

/// How often the code of each effect ran.
struct EffectCalls {
    std::array<uint64_t, effect_count> count = {};

    uint64_t of(Effect e) const { return count[size_t(e)]; }

    EffectCalls& operator+=(const EffectCalls& o) {
        for (size_t i = 0; i < effect_count; ++i) count[i] += o.count[i];
        return *this;
    }
};

/// Of this thread since the last take_effect_calls(): one addition in memory, without any argument
/// to hand through ten tiers. A plugin, which has a copy of its own, counts nothing.
inline constinit thread_local EffectCalls thread_effect_calls = {};

inline void count_call(Effect effect) {
    ++thread_effect_calls.count[size_t(effect)];
}

/// The calls of this thread since it was last asked. Whatever task asks adds them to the same
/// total.
inline EffectCalls take_effect_calls() {
    return std::exchange(thread_effect_calls, {});
}

}  // namespace velatura::scene
