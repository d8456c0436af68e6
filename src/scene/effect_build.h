// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "scene/effect.h"

#include <initializer_list>

/// Enumerators of Effect with commas between; velatura_effects.cmake gives them to the files that
/// ask is_built().
#ifndef VELATURA_WITHOUT_EFFECTS
#define VELATURA_WITHOUT_EFFECTS
#endif

namespace velatura::scene {

/// Whether this build can run the effect. All can, but those that measure what the tests for an
/// effect cost scenes without it (`./dev bench without`, docs/reference/effects.md): every test for
/// an effect that runs per path asks this first, and where it is false nothing of the test is left.
/// Static: files of one build may differ.
static constexpr bool is_built(Effect effect) {
    using enum Effect;
    for (const Effect e : std::initializer_list<Effect>{VELATURA_WITHOUT_EFFECTS})
        if (e == effect) return false;
    return true;
}

}  // namespace velatura::scene
