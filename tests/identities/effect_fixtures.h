// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "scene/effect.h"

#include <span>
#include <string>
#include <string_view>

namespace velatura::test {

/// A way in which a prim gets into a stage.
enum class Arrival {
    Direct,
    Deep,
    Instance,
    NestedInstance,
    PointInstance,
    Variant,
    Reference,
    Inherit,
    Payload,
    Specialize,
    Untyped
};

inline constexpr Arrival arrivals[] = {
    Arrival::Direct,        Arrival::Deep,       Arrival::Instance,  Arrival::NestedInstance,
    Arrival::PointInstance, Arrival::Variant,    Arrival::Reference, Arrival::Inherit,
    Arrival::Payload,       Arrival::Specialize, Arrival::Untyped};

const char* name_of(Arrival arrival);

/// Text of one effect: what a scene authors to call for it, and to author it so that it does
/// nothing.
struct EffectFixture {
    scene::Effect effect;
    std::string_view name;  ///< of the way that calls for it
    /// Inputs of a UsdPreviewSurface on a quad, or, when `is_prim`, whole prims; `@@` stands for
    /// the path of what holds them.
    std::string_view on, neutral;
    bool is_prim = false;
    bool stays_at_home = false;  ///< means something in the root alone, not in instances
};

std::span<const EffectFixture> effect_fixtures();

/// The prims of a fixture, as children of the prim with the path.
std::string fixture_prims(const EffectFixture& fixture,
                          std::string_view content,
                          std::string_view path);

/// A stage with a camera, a floor and a lamp of one quad each, and `content` (of a fixture) that
/// arrives as said.
std::string fixture_usda(const EffectFixture& fixture, std::string_view content, Arrival arrival);

}  // namespace velatura::test
