// SPDX-License-Identifier: Apache-2.0
#include "translate/context/context.h"

#include "translate/context/values.h"
#include "usd/stage/imageable.h"

#include <utility>

namespace velatura::translate {
inline namespace context {

bool RenderedPrims::includes(Prim prim) const {
    const std::string purpose = usd::stage::computed_purpose(prim);
    return purposes.contains(purpose) && usd::stage::is_purpose_visible(prim, purpose) &&
           (!pass || pass->visible.includes(prim.path()));
}

void Context::warn(std::string code, Prim prim, std::string message) {
    if (is_quiet) return;
    diagnostics.warn(std::move(code), prim.loc(), prim.path_string(), std::move(message));
}

void Context::warn(std::string code, const Attribute& attribute, std::string message) {
    if (is_quiet) return;
    diagnostics.warn(std::move(code), attribute.loc(), attribute.prim().path_string(),
                     std::move(message));
}

void Context::note(std::string code, Prim prim, std::string message) {
    diagnostics.note(std::move(code), prim.loc(), prim.path_string(), std::move(message));
}

void Context::note_zero(scene::Effect effect, Prim prim, std::string_view why) {
    note_effect(effect, scene::EffectNote::Kind::ProvenZero, prim, why);
}

void Context::note_not_simulated(scene::Effect effect, Prim prim, std::string_view why) {
    note_effect(effect, scene::EffectNote::Kind::NotSimulated, prim, why);
}

scene::ProvenanceId Context::provenance(Prim prim) {
    scene.provenance.push_back({prim.path_string(), prim.loc(), asset_of(prim)});
    return scene::ProvenanceId(scene.provenance.size() - 1);
}

/// Of what the prim itself is called, or begins as a whole.
std::string Context::own_asset(Prim prim) const {
    const Attribute attribute = prim.attribute("primvars:crypto_asset");
    const std::string name =
        attribute.has_authored_value() ? read_text(attribute, "", time) : std::string();
    return name.empty() && prim.kind() == "component" ? prim.path_string() : name;
}

uint32_t Context::asset_of(Prim prim) {
    if (const std::string name = own_asset(prim); !name.empty()) {
        const auto next = uint32_t(scene.assets.size());
        const auto [at, is_new] = asset_numbers_.try_emplace(name, next);
        if (is_new) scene.assets.push_back(name);
        return at->second;
    }
    const Prim parent = prim.parent();
    if (!parent || parent.is_pseudo_root()) return scene::none;
    if (const auto at = asset_of_parent_.find(parent.path()); at != asset_of_parent_.end())
        return at->second;
    const uint32_t asset = asset_of(parent);
    asset_of_parent_.emplace(parent.path(), asset);
    return asset;
}

bool Context::is_outside_prototype(const Prim& prim) const {
    return !point_prototypes.empty() && !prim.path().has_prefix(point_prototypes.back().root);
}

void Context::note_effect(scene::Effect effect,
                          scene::EffectNote::Kind kind,
                          Prim prim,
                          std::string_view why) {
    if (!is_quiet) scene::note_effect(scene.effect_notes, effect, kind, prim.path_string(), why);
}

}  // namespace context
}  // namespace velatura::translate
