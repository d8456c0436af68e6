// SPDX-License-Identifier: Apache-2.0
#include "scene/effect.h"

#include <algorithm>
#include <array>

namespace velatura::scene {

namespace {

using enum EffectKind;

constexpr std::array<EffectInfo, effect_count> table = {{
    {Effect::DepthOfField, Scene, "depth-of-field", "points of the lens"},
    {Effect::CameraBlur, Scene, "camera-blur", "places of the camera"},
    {Effect::TransformBlur, Scene, "transform-blur", "points on instances that move"},
    {Effect::DeformationBlur, Scene, "deformation-blur", "points on meshes that move"},
    {Effect::Instancing, Scene, "instancing", "points on instances"},
    {Effect::Quadrics, Scene, "quadrics", "points on exact quadrics"},
    {Effect::Subdivision, Scene, "subdivision", "meshes refined"},
    {Effect::Displacement, Scene, "displacement", "meshes displaced"},
    {Effect::Curves, Scene, "curves", "points on curves"},
    {Effect::Points, Scene, "points", "points on particles"},
    {Effect::LevelSets, Scene, "level-sets", "points on level sets"},
    {Effect::Volumes, Scene, "volumes", "lookups"},
    {Effect::VaryingColors, Scene, "varying-inputs", "primvars read for a material"},
    {Effect::Textures, Scene, "textures", "texture lookups"},
    {Effect::NormalMaps, Scene, "normal-maps", "normals turned"},
    {Effect::Cutouts, Scene, "cutouts", "tests whether a surface is there"},
    {Effect::Transmission, Scene, "transmission", "surfaces evaluated that let light through"},
    {Effect::RoughTransmission, Scene, "rough-transmission", "surfaces evaluated that blur it"},
    {Effect::ThinWalls, Scene, "thin-walls", "thin walls evaluated"},
    {Effect::DiffuseTransmission, Scene, "diffuse-transmission",
     "thin walls evaluated that shine through"},
    {Effect::Absorption, Scene, "absorption", "segments inside bodies that absorb"},
    {Effect::InteriorMedia, Scene, "interior-media", "segments inside bodies that scatter"},
    {Effect::NestedBodies, Scene, "nested-bodies", "surfaces of bodies with priorities met"},
    {Effect::Clearcoat, Scene, "clearcoat", "coated surfaces evaluated"},
    {Effect::Anisotropy, Scene, "anisotropy", "brushed surfaces evaluated"},
    {Effect::RoughDiffuse, Scene, "rough-diffuse", "rough diffuse surfaces evaluated"},
    {Effect::Sheen, Scene, "sheen", "surfaces with fibres evaluated"},
    {Effect::Patterns, Scene, "patterns", "node graphs evaluated"},
    {Effect::Hair, Scene, "hair", "fibres evaluated"},
    {Effect::Subsurface, Scene, "subsurface", "walks below surfaces"},
    {Effect::SurfaceEmission, Scene, "surface-emission", "emissions of surfaces evaluated"},
    {Effect::MeshLights, Scene, "mesh-lights", "emissions of lights that are geometry evaluated"},
    {Effect::Environment, Scene, "environment", "domes sampled or met"},
    {Effect::EnvironmentMaps, Scene, "environment-maps", "lookups in maps of domes"},
    {Effect::Portals, Scene, "portals", "directions chosen through portals"},
    {Effect::LightTextures, Scene, "light-textures", "lookups in pictures of rect lights"},
    {Effect::LightShaping, Scene, "light-shaping", "cones and focus evaluated"},
    {Effect::LightProfiles, Scene, "light-profiles", "intensities of profiles looked up"},
    {Effect::LobeMultipliers, Scene, "lobe-multipliers", "lobes weighed for a light"},
    {Effect::LightSelection, Scene, "light-selection", "choices among lights"},
    {Effect::LightLinking, Scene, "light-linking", "links asked for"},
    {Effect::ShadowControls, Scene, "shadow-controls", "shadow rays with a rule of their own"},
    {Effect::LightFilters, Scene, "light-filters", "filters evaluated"},
    {Effect::Roulette, Estimator, "roulette", "chances to end a path"},
    {Effect::Guiding, Estimator, "guiding", "vertices with learned directions"},
    {Effect::Splitting, Estimator, "splitting", "paths divided"},
    {Effect::CausticSearch, Estimator, "caustic-search", "chains looked for"},
    {Effect::AdaptiveSampling, Estimator, "adaptive-sampling", "pilot samples"},
    {Effect::BounceLayers, Output, "bounce-layers", ""},
    {Effect::LightLayers, Output, "light-layers", ""},
    {Effect::MatrixLayers, Output, "matrix-layers", ""},
    {Effect::ShadowLayers, Output, "shadow-layers", "values of light without occlusion"},
    {Effect::CasterLayers, Output, "caster-layers", "shadow rays that ask what blocks them"},
    {Effect::ClampLayers, Output, "clamp-layers", "contributions cut"},
    {Effect::PathLayers, Output, "path-layers", "light told apart by what its path did"},
    {Effect::DataLayers, Output, "data-layers", ""},
    {Effect::HalfImages, Output, "half-images", ""},
    {Effect::IdMattes, Output, "id-mattes", "first surfaces named"},
    {Effect::DeepSamples, Output, "deep-samples", "samples of known depth"},
}};

constexpr bool is_in_order() {
    for (size_t i = 0; i < table.size(); ++i)
        if (size_t(table[i].effect) != i) return false;
    return true;
}

static_assert(is_in_order());

}  // namespace

const EffectInfo& info(Effect effect) {
    return table[size_t(effect)];
}

std::optional<Effect> find_effect(std::string_view name) {
    const auto it = std::find_if(table.begin(), table.end(),
                                 [&](const EffectInfo& i) { return i.name == name; });
    if (it == table.end()) return std::nullopt;
    return it->effect;
}

void note_effect(std::vector<EffectNote>& notes,
                 Effect effect,
                 EffectNote::Kind kind,
                 std::string_view prim_path,
                 std::string_view why) {
    const auto it = std::find_if(notes.begin(), notes.end(), [&](const EffectNote& n) {
        return n.effect == effect && n.kind == kind;
    });
    if (it != notes.end())
        ++it->prims;
    else
        notes.push_back({effect, kind, std::string(prim_path), std::string(why)});
}

}  // namespace velatura::scene
