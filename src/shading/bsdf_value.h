// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "shading/anisotropic_albedo.h"
#include "shading/rough_interface.h"
#include "shading/sheen.h"
#include "shading/thin_film.h"

#include <cstdint>

namespace velatura::shading {

/// Scattering event of a pair of directions, for light path expressions; independent of the lobe
/// that was sampled.
enum class ScatterKind : uint8_t { Reflect, Transmit };

/// A direction sampled from a Bsdf.
struct BsdfSample {
    Vec3 wi;  ///< render space, unit, away from the surface
    Rgb f;  ///< [1/sr], without cosine; for a delta lobe f·cosine / pdf is the weight, with pdf a
            ///< probability
    float pdf = 0;  ///< [1/sr] over all non-delta lobes; probability for a delta lobe
    float eta = 1;  ///< η_t/η_i along the path for transmission, else 1
    bool is_delta = false;
    ScatterKind kind = ScatterKind::Reflect;
    bool is_coat = false;  ///< of a delta lobe: the coat's
};

/// Sum of the delta lobes of one kind, which share one direction.
struct DeltaScattering {
    Vec3 wi;               ///< render space, unit, away from the surface
    Rgb weight;            ///< radiance towards wo over radiance from wi
    Rgb coat = Rgb(0.0f);  ///< part of `weight` that the coat reflects
    float eta = 1;         ///< as in BsdfSample
};

/// BSDF value, split for UsdLux's diffuse and specular multipliers; without delta lobes.
struct BsdfValue {
    Rgb diffuse = Rgb(0.0f);   ///< [1/sr], without cosine
    Rgb specular = Rgb(0.0f);  ///< [1/sr], without cosine
    float coat = 0;            ///< fraction of `specular` that the coat reflects
    float pdf = 0;             ///< [1/sr], of sample_f() over all non-delta lobes
    ScatterKind kind = ScatterKind::Reflect;
    float eta = 1;  ///< as in BsdfSample

    Rgb f() const { return diffuse + specular; }
};

/// Inputs of a layered Bsdf at one point, textures evaluated. All finite and within their range.
struct SurfaceParameters {
    Rgb diffuse = Rgb(0.18f);  ///< albedo of the diffuse base; metallic already taken off
    Rgb f0 = Rgb(0.04f);       ///< specular reflectance at normal incidence
    Rgb f90 = Rgb(1.0f);       ///< and at grazing incidence
    float alpha = 0.25f;       ///< GGX width, roughness²
    float clearcoat = 0;       ///< weight of the coat, [0, 1]
    float clearcoat_alpha = 0;
    float opacity = 1;  ///< what is not opaque transmits (opacityMode "transparent")
    float ior = 1.5f;   ///< inside over outside
    /// Made for this ior: the roughness blurs what is transmitted, too. Null: it is refracted
    /// without blur, as the specification has it. Must outlive the Bsdf.
    const RoughInterface* interface = nullptr;

    /// Facets of two widths: `alpha` along the tangent, alpha_y across it, of the range that this
    /// was made for. Null: one width. Must outlive the Bsdf.
    const AnisotropicAlbedo* anisotropic = nullptr;
    float alpha_y = 0;
    Vec3 tangent = Vec3(0.0f);  ///< render space; zero = whatever the normal suggests

    /// A sheet without thickness, air on both sides: light passes straight, after what the two
    /// interfaces reflect to and fro.
    bool is_thin = false;
    bool is_thin_rough = false;  ///< the roughness of a sheet blurs what passes, too
    /// Of a sheet: what passes perpendicularly once; of a solid: factor of each crossing.
    Rgb transmission_tint = Rgb(1.0f);
    /// Of a sheet: albedo of the base towards the other side; diffuse + this is at most 1.
    Rgb diffuse_transmitted = Rgb(0.0f);

    /// A film on the base, below the coat. Null: none. Need not outlive the constructor of a Bsdf.
    const FilmParameters* film = nullptr;

    float diffuse_roughness = 0;  ///< of the diffuse base, [0, 1]; 0 = Lambert
    float coat_ior = 0;           ///< of the coat over what is around it; 0 = ior
    /// Fibers on top of everything, on the outside of a solid. Null: none. Must outlive the Bsdf.
    const SheenAlbedo* sheen = nullptr;
    Rgb sheen_color = Rgb(0.0f);  ///< weight included
    float sheen_roughness = 1;    ///< in [SheenAlbedo::min_roughness, 1]
};

/// Up to this GGX width a lobe counts as narrow: its reflections of small lights are caustics that
/// light tracing finds.
inline constexpr float narrow_lobe_alpha = 0.1f;

/// Below this GGX width a lobe is a perfect mirror, flagged as delta.
inline constexpr float specular_switch_alpha = 1e-3f;

}  // namespace velatura::shading
