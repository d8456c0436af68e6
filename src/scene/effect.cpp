// SPDX-License-Identifier: Apache-2.0
#include "scene/effect.h"

#include <algorithm>
#include <array>

namespace velatura::scene {

namespace {

using enum EffectKind;

constexpr std::array<EffectInfo, effect_count> table = {{
    {Effect::DepthOfField, Scene, "depth-of-field", "lens samples"},
    {Effect::CameraBlur, Scene, "camera-blur", "camera transforms"},
    {Effect::TransformBlur, Scene, "transform-blur",
     "hits on moving instances, samples of moving lights, rays by moving volumes"},
    {Effect::DeformationBlur, Scene, "deformation-blur", "hits on deforming meshes"},
    {Effect::Instancing, Scene, "instancing", "hits on instances"},
    {Effect::Quadrics, Scene, "quadrics", "hits on analytic quadrics"},
    {Effect::Subdivision, Scene, "subdivision", "meshes refined"},
    {Effect::Displacement, Scene, "displacement", "meshes displaced"},
    {Effect::Curves, Scene, "curves", "hits on curves"},
    {Effect::Points, Scene, "points", "hits on particles"},
    {Effect::LevelSets, Scene, "level-sets", "hits on level sets"},
    {Effect::Volumes, Scene, "volumes", "lookups"},
    {Effect::VaryingColors, Scene, "varying-inputs", "primvars read by materials"},
    {Effect::Textures, Scene, "textures", "texture lookups"},
    {Effect::NormalMaps, Scene, "normal-maps", "normals turned"},
    {Effect::Cutouts, Scene, "cutouts", "opacity tests"},
    {Effect::Transmission, Scene, "transmission", "transmissive surfaces evaluated"},
    {Effect::RoughTransmission, Scene, "rough-transmission",
     "rough transmissive surfaces evaluated"},
    {Effect::ThinWalls, Scene, "thin-walls", "thin walls evaluated"},
    {Effect::DiffuseTransmission, Scene, "diffuse-transmission",
     "diffusely transmitting thin walls evaluated"},
    {Effect::Absorption, Scene, "absorption", "segments inside absorbing solids"},
    {Effect::InteriorMedia, Scene, "interior-media", "segments inside scattering solids"},
    {Effect::NestedDielectrics, Scene, "nested-bodies", "surface hits with dielectric priority"},
    {Effect::Dispersion, Scene, "dispersion", "paths given a wavelength"},
    {Effect::Clearcoat, Scene, "clearcoat", "coated surfaces evaluated"},
    {Effect::ThinFilm, Scene, "thin-film", "thin films evaluated"},
    {Effect::Anisotropy, Scene, "anisotropy", "brushed surfaces evaluated"},
    {Effect::RoughDiffuse, Scene, "rough-diffuse", "rough diffuse surfaces evaluated"},
    {Effect::Sheen, Scene, "sheen", "sheen surfaces evaluated"},
    {Effect::Patterns, Scene, "patterns", "node graphs evaluated"},
    {Effect::Hair, Scene, "hair", "fibers evaluated"},
    {Effect::Subsurface, Scene, "subsurface", "subsurface walks"},
    {Effect::SurfaceEmission, Scene, "surface-emission", "surface emissions evaluated"},
    {Effect::MeshLights, Scene, "mesh-lights", "mesh-light emissions evaluated"},
    {Effect::Environment, Scene, "environment", "domes sampled or hit"},
    {Effect::EnvironmentMaps, Scene, "environment-maps", "dome texture lookups"},
    {Effect::Portals, Scene, "portals", "portal directions sampled"},
    {Effect::LightTextures, Scene, "light-textures", "texture lookups of rect lights"},
    {Effect::LightShaping, Scene, "light-shaping", "cones and focus evaluated"},
    {Effect::LightProfiles, Scene, "light-profiles", "IES profile lookups"},
    {Effect::LobeMultipliers, Scene, "lobe-multipliers", "lobes weighted for a light"},
    {Effect::LightSelection, Scene, "light-selection", "light selections"},
    {Effect::LightLinking, Scene, "light-linking", "light links tested"},
    {Effect::ShadowControls, Scene, "shadow-controls", "shadow rays with ShadowAPI controls"},
    {Effect::LightFilters, Scene, "light-filters", "filters evaluated"},
    {Effect::RayVisibility, Scene, "ray-visibility", "rays that skip geometry"},
    {Effect::Mattes, Scene, "mattes", "camera paths ended by matte objects"},
    {Effect::Catchers, Scene, "catchers", "camera samples that meet a catcher"},
    {Effect::Roulette, Estimator, "roulette", "Russian roulette tests"},
    {Effect::Guiding, Estimator, "guiding", "vertices with path guiding"},
    {Effect::Splitting, Estimator, "splitting", "paths divided"},
    {Effect::CausticSearch, Estimator, "caustic-search", "photons, or specular chains searched"},
    {Effect::AdaptiveSampling, Estimator, "adaptive-sampling", "pilot samples"},
    {Effect::BounceLayers, Output, "bounce-layers", ""},
    {Effect::LightLayers, Output, "light-layers", ""},
    {Effect::MatrixLayers, Output, "matrix-layers", ""},
    {Effect::ShadowLayers, Output, "shadow-layers", "unoccluded light values"},
    {Effect::CasterLayers, Output, "caster-layers", "shadow rays that identify their occluder"},
    {Effect::ClampLayers, Output, "clamp-layers", "contributions clamped"},
    {Effect::PathLayers, Output, "path-layers", "light sorted by lobe of the path"},
    {Effect::DataLayers, Output, "data-layers", ""},
    {Effect::HalfImages, Output, "half-images", ""},
    {Effect::IdMattes, Output, "id-mattes", "first hits with Cryptomatte IDs"},
    {Effect::DeepSamples, Output, "deep-samples", "deep samples"},
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
