// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace velatura::scene {

/// What costs time or memory only because a scene, or an option, calls for it
/// (docs/reference/effects.md). A new one: a name here, a line in effect.cpp, a rule in
/// integrator/effect_rules.h.
enum class Effect : uint8_t {
    // Camera and time
    DepthOfField,
    CameraBlur,
    TransformBlur,
    DeformationBlur,
    // Geometry
    Instancing,
    Quadrics,
    Subdivision,
    Displacement,
    Curves,
    Points,
    LevelSets,
    Volumes,
    // Surfaces
    VaryingColors,
    Textures,
    NormalMaps,
    Cutouts,
    Transmission,
    RoughTransmission,
    ThinWalls,
    DiffuseTransmission,
    Absorption,
    InteriorMedia,
    NestedDielectrics,
    Dispersion,
    Clearcoat,
    ThinFilm,
    Anisotropy,
    RoughDiffuse,
    Sheen,
    Patterns,
    Hair,
    Subsurface,
    // Lights
    SurfaceEmission,
    MeshLights,
    Environment,
    EnvironmentMaps,
    Portals,
    LightTextures,
    LightShaping,
    LightProfiles,
    LobeMultipliers,
    LightSelection,
    LightLinking,
    ShadowControls,
    LightFilters,
    // Rays
    RayVisibility,
    Mattes,
    Catchers,
    // Estimators
    Roulette,
    Guiding,
    Splitting,
    CausticSearch,
    AdaptiveSampling,
    // What is written
    BounceLayers,
    LightLayers,
    MatrixLayers,
    ShadowLayers,
    CasterLayers,
    ClampLayers,
    PathLayers,
    DataLayers,
    HalfImages,
    IdMattes,
    DeepSamples,
};

inline constexpr size_t effect_count = size_t(Effect::DeepSamples) + 1;

/// Who decides whether an effect runs.
enum class EffectKind : uint8_t { Scene, Estimator, Output };

struct EffectInfo {
    Effect effect;
    EffectKind kind;
    std::string_view name;   ///< as on the command line and in files
    std::string_view calls;  ///< what one call of its counter is; empty where nothing is counted
};

const EffectInfo& info(Effect effect);
/// By name; nothing when there is none of that name.
std::optional<Effect> find_effect(std::string_view name);

class EffectSet {
  public:
    bool has(Effect e) const { return (bits_ >> size_t(e) & 1) != 0; }

    void add(Effect e) { bits_ |= uint64_t(1) << size_t(e); }

    void remove(Effect e) { bits_ &= ~(uint64_t(1) << size_t(e)); }

    bool is_empty() const { return bits_ == 0; }

    bool operator==(const EffectSet&) const = default;

  private:
    static_assert(effect_count <= 64);
    uint64_t bits_ = 0;
};

/// What a reader of the scene knows about an effect that the scene itself does not show: a prim
/// authors it so that it does nothing, or calls for it and it is not simulated.
struct EffectNote {
    enum class Kind : uint8_t { ProvenZero, NotSimulated };
    Effect effect;
    Kind kind;
    std::string prim_path;  ///< the first that says so
    std::string why;
    uint64_t prims = 1;  ///< that say so
};

/// Adds to the notes, one for each effect and kind.
void note_effect(std::vector<EffectNote>& notes,
                 Effect effect,
                 EffectNote::Kind kind,
                 std::string_view prim_path,
                 std::string_view why);

}  // namespace velatura::scene
