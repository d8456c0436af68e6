// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "base/math.h"
#include "scene/ids.h"

namespace velatura::scene {

/// Which part of a texture's RGBA an input reads.
enum class TextureOutput : uint8_t { R, G, B, A, Rgb };

/// A shader input: a constant, a texture or a primvar. Float inputs use value.x.
struct Input {
    enum class Source : uint8_t { Constant, Texture, Primvar };
    Source source = Source::Constant;
    Rgb value = Rgb(0.0f);                     ///< the constant; also the fallback of a missing primvar
    TextureId texture = none;                  ///< Source::Texture
    TextureOutput output = TextureOutput::Rgb; ///< Source::Texture
    PrimvarId primvar = none;                  ///< Source::Primvar

    Input() = default;
    explicit Input(float v) : value(v) {}
    explicit Input(const Rgb& v) : value(v) {}
};

/// A UsdPreviewSurface (specification 2.6) with its fallbacks, and what velatura: inputs add to it.
struct Material {
    std::string name;  ///< prim path
    Input diffuse_color = Input(Rgb(0.18f));
    Input emissive_color = Input(Rgb(0.0f));
    bool use_specular_workflow = false;
    Input specular_color = Input(Rgb(0.0f));
    Input metallic = Input(0.0f);
    Input roughness = Input(0.5f);
    Input clearcoat = Input(0.0f);
    Input clearcoat_roughness = Input(0.01f);
    Input opacity = Input(1.0f);
    float opacity_threshold = 0.0f;
    bool presence = false;  ///< opacityMode = "presence": opacity fades the whole surface instead of transmitting
    Input ior = Input(1.5f);
    /// velatura:roughTransmission: roughness also blurs what is transmitted. UsdPreviewSurface itself never does.
    bool rough_transmission = false;
    /// How much narrower the specular lobe is across the tangent than along it; [0, 1], 0 = not. The tangent is ∂p/∂s,
    /// turned by anisotropy_rotation (1 = once around, from ∂p/∂s towards ∂p/∂t).
    Input anisotropy = Input(0.0f);
    Input anisotropy_rotation = Input(0.0f);
    /// A sheet without thickness instead of the boundary of a body: light passes straight, both sides are alike.
    bool thin_walled = false;
    /// Thin-walled only: share of the diffuse light that goes to the other side, and its albedo; none = diffuse_color.
    Input diffuse_transmission = Input(0.0f);
    std::optional<Input> diffuse_transmission_color;
    /// With transmission_depth > 0 the body absorbs: after this distance (scene units) transmission_color, a constant, is left
    /// of white light. Else it multiplies what crosses the surface; of a thin wall it is what passes perpendicularly once.
    Input transmission_color = Input(Rgb(1.0f));
    float transmission_depth = 0.0f;
    /// false: no specular at all, pure Lambert; what shapes without a material get with their displayColor.
    bool has_specular = true;
    Input normal = Input(Rgb(0.0f, 0.0f, 1.0f));  ///< tangent space, already scaled and biased into [-1, 1]
    ProvenanceId provenance = none;
};

/// Whether surfaces of the material emit somewhere: they are lights then.
inline bool is_emissive(const Material& material) {
    const Input& color = material.emissive_color;
    return color.source != Input::Source::Constant || !is_black(color.value);
}

}  // namespace velatura::scene
