// SPDX-License-Identifier: Apache-2.0
#include "plugins/hydra/light_inputs.h"

#include <pxr/imaging/hd/tokens.h>
#include <pxr/usd/sdf/assetPath.h>

#include <array>
#include <string>

namespace velatura::hydra {

using namespace PXR_NS;

namespace {

/// Inputs of all lights, by the names that Hydra has for them.
constexpr std::array light_inputs = {"color",
                                     "intensity",
                                     "exposure",
                                     "diffuse",
                                     "specular",
                                     "normalize",
                                     "enableColorTemperature",
                                     "colorTemperature",
                                     "width",
                                     "height",
                                     "radius",
                                     "length",
                                     "angle",
                                     "texture:file",
                                     "texture:format"};

constexpr std::array shadow_inputs = {"shadow:enable", "shadow:color", "shadow:distance",
                                      "shadow:falloff", "shadow:falloffGamma"};

constexpr std::array shaping_inputs = {
    "shaping:focus",    "shaping:focusTint",      "shaping:cone:angle",   "shaping:cone:softness",
    "shaping:ies:file", "shaping:ies:angleScale", "shaping:ies:normalize"};

/// What names a light group (docs/reference/usd_support.md).
constexpr std::array group_attributes = {"velatura:light:group", "karma:light:lpetag",
                                         "primvars:arnold:aov"};

/// Hydra provides the fallback of a cone that is not authored; 90 degrees would halve a light.
bool is_fallback_cone(const std::string& name, const VtValue& value) {
    return name == "shaping:cone:angle" && value.IsHolding<float>() &&
           value.UncheckedGet<float>() == 90.0f;
}

bool is_empty_asset(const VtValue& value) {
    return value.IsHolding<SdfAssetPath>() &&
           value.UncheckedGet<SdfAssetPath>().GetAssetPath().empty();
}

/// Returns: whether some input has a value.
template <class Names>
bool author_inputs(HdSceneDelegate& delegate,
                   const SdfPath& id,
                   const Names& names,
                   AuthoredPrim& prim) {
    bool is_any = false;
    for (const char* const name : names) {
        const VtValue value = delegate.GetLightParamValue(id, TfToken(name));
        if (value.IsEmpty() || is_fallback_cone(name, value) || is_empty_asset(value)) continue;
        const bool is_color = value.IsHolding<GfVec3f>();
        prim.set(std::string("inputs:") + name, value,
                 is_color ? HdPrimvarRoleTokens->color : TfToken());
        is_any = true;
    }
    return is_any;
}

TfToken link(HdSceneDelegate& delegate, const SdfPath& id, const TfToken& name) {
    const VtValue value = delegate.GetLightParamValue(id, name);
    return value.IsHolding<TfToken>() ? value.UncheckedGet<TfToken>() : TfToken();
}

}  // namespace

void author_light(HdSceneDelegate& delegate, const SdfPath& id, AuthoredPrim& prim) {
    author_inputs(delegate, id, light_inputs, prim);
    if (author_inputs(delegate, id, shadow_inputs, prim)) prim.apply_schema("ShadowAPI");
    if (author_inputs(delegate, id, shaping_inputs, prim)) prim.apply_schema("ShapingAPI");
    for (const char* const name : group_attributes)
        prim.set(name, delegate.GetLightParamValue(id, TfToken(name)));
}

LightLinkNames read_links(HdSceneDelegate& delegate, const SdfPath& id) {
    return {link(delegate, id, HdTokens->lightLink), link(delegate, id, HdTokens->shadowLink)};
}

}  // namespace velatura::hydra
