// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "integrator/effect_plan.h"

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace velatura::integrator {

/// Notes who calls for an effect.
class EffectFindings {
  public:
    explicit EffectFindings(const scene::Scene& s) : scene(s) {}

    void on(std::string_view prim, std::string_view why) { add(EffectState::On, prim, why); }

    void zero(std::string_view prim, std::string_view why) {
        add(EffectState::ProvenZero, prim, why);
    }

    void add(EffectState state, std::string_view prim, std::string_view why, uint64_t prims = 1);

    /// The path that a thing of the scene came from; empty when nobody knows.
    std::string_view prim_of(scene::ProvenanceId id) const;

    const scene::Scene& scene;
    EffectEntry entry;
};

/// How an effect is told from the scene, and how it is taken out of it. A rule that finds nothing
/// in a scene promises that its effect never runs there; one that finds something though it changes
/// nothing costs time only.
struct EffectRule {
    scene::Effect effect;
    void (*find)(EffectFindings& found);  ///< null: only EffectNotes tell
    void (*omit)(scene::Scene& scene);    ///< null: the scene is built of it
    bool is_forceable = false;
};

/// Rules of one subject each.
std::span<const EffectRule> camera_rules();
std::span<const EffectRule> geometry_rules();
std::span<const EffectRule> surface_rules();
std::span<const EffectRule> light_rules();

}  // namespace velatura::integrator
