// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/diagnostics.h"
#include "base/math.h"
#include "scene/scene.h"
#include "translate/context/module_states.h"
#include "usd/stage/collection.h"
#include "usd/stage/stage.h"

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_set>
#include <vector>

namespace velatura::translate {
inline namespace context {

using usd::stage::Attribute;
using usd::stage::Prim;
using usd::stage::Relationship;
using usd::stage::TimeCode;

/// What a RenderPass renders of the stage.
struct RenderPass {
    usd::stage::CollectionQuery visible, pruned;
    /// What the camera sees; nothing: all of that.
    std::optional<usd::stage::CollectionQuery> camera_visible = {};
    std::optional<usd::stage::CollectionQuery> mattes = {};  ///< nothing: none
};

/// Which prims are rendered.
struct RenderedPrims {
    std::unordered_set<std::string> purposes;
    std::optional<RenderPass> pass;

    /// Whether prims of the computed purpose, of the render pass, are rendered.
    bool includes(Prim prim) const;
};

/// A prototype of a point instancer that is being walked.
struct PrototypeScope {
    usd::layer::Path root;
    std::unordered_set<std::string> inherited;  ///< primvars that its instances may bring along
};

/// When the shutter opens and closes, in times of the stage.
struct Shutter {
    double open = 0, close = 0;
};

/// What all modules share while one stage is translated: the stage, the moment, the scene that
/// comes of it, messages, and, by its type, what each module keeps for itself.
struct Context {
    Context(const usd::stage::Stage& of_stage, TimeCode at, Diagnostics& messages)
        : stage(of_stage), diagnostics(messages), time(at), frame(at) {}

    const usd::stage::Stage& stage;
    Diagnostics& diagnostics;
    TimeCode time;
    TimeCode frame;  ///< the frame's instant; `time` may be another while the shutter is open
    std::optional<Shutter> shutter;  ///< nothing: closed, the image is of one instant
    bool is_quiet = false;           ///< reads again, at another time, what was warned about
    Vec3d origin = Vec3d(0.0);       ///< world position of render space's origin
    RenderedPrims rendered;
    std::vector<PrototypeScope> point_prototypes;  ///< that are being walked, the innermost last
    scene::Scene scene;

    /// What a module keeps: see ModuleStates.
    template <class State>
    State& state() {
        return states_.of<State>();
    }

    template <class State>
    const State& state() const {
        return states_.of<State>();
    }

    void warn(std::string code, Prim prim, std::string message);
    void warn(std::string code, const Attribute& attribute, std::string message);
    void note(std::string code, Prim prim, std::string message);

    /// The prim authors the effect so that it does nothing.
    void note_zero(scene::Effect effect, Prim prim, std::string_view why);
    /// The prim calls for the effect, and the image does without; warn() says so to the user.
    void note_not_simulated(scene::Effect effect, Prim prim, std::string_view why);

    /// A new entry of Scene::provenance.
    scene::ProvenanceId provenance(Prim prim);

    /// Whether the prim stands outside the innermost point instancer's prototype that is walked:
    /// what is inherited from there yields to what instances hand down.
    bool is_outside_prototype(const Prim& prim) const;

  private:
    void note_effect(scene::Effect effect,
                     scene::EffectNote::Kind kind,
                     Prim prim,
                     std::string_view why);

    std::string own_asset(Prim prim) const;
    /// Of Scene::assets: the nearest of the prim and those above it that has a
    /// primvars:crypto_asset, or is of kind component.
    uint32_t asset_of(Prim prim);

    ModuleStates states_;
    std::map<usd::layer::Path, uint32_t> asset_of_parent_;
    std::map<std::string, uint32_t> asset_numbers_;
};

}  // namespace context
}  // namespace velatura::translate
