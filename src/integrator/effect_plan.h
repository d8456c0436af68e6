// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "film/layer_set.h"
#include "integrator/caustics.h"
#include "integrator/estimator.h"
#include "integrator/guide_training.h"
#include "scene/effect_calls.h"
#include "scene/scene.h"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace velatura::integrator {

/// In order of precedence: what one prim calls for is on, whatever others say.
enum class EffectState : uint8_t {
    Absent,      ///< nothing in the scene names it
    ProvenZero,  ///< something does, and it changes nothing: constant, unconnected, the same at all
                 ///< times
    NotSimulated,  ///< something calls for it, and Velatura does without; a warning said so
    On,
    Omitted,  ///< it would be on, and the command line took it away
};

const char* name_of(EffectState state);

/// One effect in a plan.
struct EffectEntry {
    EffectState state = EffectState::Absent;
    std::string prim;  ///< path of the first that says so; empty: an option does
    std::string why;
    uint64_t prims = 0;  ///< that say so
    uint64_t not_simulated_prims =
        0;                   ///< of a state above NotSimulated: those that are left as they are
    bool is_forced = false;  ///< runs though it is off, for a proof that it could be left out

    bool can_run() const { return state == EffectState::On || is_forced; }
};

/// What beside the scene decides.
struct PlanOptions {
    film::LayerSet layers;
    EstimatorOptions estimator = {};
    Guiding guiding = Guiding::Auto;
    Caustics caustics = Caustics::Path;
    bool splits = true;
    bool is_adaptive = true;
    bool is_deep = false;
    scene::EffectSet omitted = {};  ///< that omit() will take out of the scene
    bool force_all = false;
};

/// What a render simulates and why. An effect that is neither on nor forced does not run:
/// broken_promises() checks it.
struct EffectPlan {
    std::array<EffectEntry, scene::effect_count> entries;

    const EffectEntry& of(scene::Effect e) const { return entries[size_t(e)]; }

    size_t count(EffectState state) const;
    /// Those that run though they are off.
    scene::EffectSet forced() const;
};

/// One pass over the scene.
EffectPlan make_plan(const scene::Scene& scene, const PlanOptions& options);

/// Whether the effect can run in a scene that does not call for it, at a cost in time and with the
/// same image.
bool is_forceable(scene::Effect effect);

/// Whether omit() knows the effect.
bool can_omit(scene::Effect effect);

/// Takes the effect out of the scene, as if no prim called for it.
void omit(scene::Scene& scene, scene::Effect effect);

/// Effects that ran though the plan has them off.
std::vector<scene::Effect> broken_promises(const EffectPlan& plan, const scene::EffectCalls& calls);

}  // namespace velatura::integrator
