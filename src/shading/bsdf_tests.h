// SPDX-License-Identifier: Apache-2.0
// What a Bsdf asks itself before it does more than a plain surface needs, to be inlined into its
// parts.
#pragma once

#include "scene/effect_build.h"
#include "shading/bsdf.h"

#include <array>

namespace velatura::shading {

/// Those that may have a share, in their order.
template <bool plain>
constexpr auto Bsdf::lobes() {
    if constexpr (plain) {
        return std::array<Lobe, 3>{Cosine, Specular, MirrorSpecular};
    } else {
        return std::array{Cosine,     Specular,       Coat,       Interface,   Sheet,
                          CosineBack, MirrorSpecular, MirrorCoat, Transmission};
    }
}

inline bool Bsdf::is_fibre() const {
    return scene::is_built(scene::Effect::Hair) && kind_ == Kind::Hair;
}

template <bool plain>
inline bool Bsdf::is_thin() const {
    return !plain && scene::is_built(scene::Effect::ThinWalls) && p_.is_thin;
}

template <bool plain>
inline bool Bsdf::transmits() const {
    return !plain && scene::is_built(scene::Effect::Transmission) && p_.opacity < 1.0f;
}

/// What is left to the base.
template <bool plain>
inline float Bsdf::opacity() const {
    return !plain && scene::is_built(scene::Effect::Transmission) ? p_.opacity : 1.0f;
}

template <bool plain>
inline bool Bsdf::is_dense_side() const {
    return !plain && scene::is_built(scene::Effect::Transmission) && is_dense_side_;
}

template <bool plain>
inline bool Bsdf::has_tint() const {
    return !plain && scene::is_built(scene::Effect::Transmission) && has_tint_;
}

template <bool plain>
inline bool Bsdf::is_rough_interface() const {
    return !plain && scene::is_built(scene::Effect::RoughTransmission) && is_rough_interface_;
}

template <bool plain>
inline bool Bsdf::is_rough_sheet() const {
    return !plain && scene::is_built(scene::Effect::RoughTransmission) &&
           scene::is_built(scene::Effect::ThinWalls) && is_rough_sheet_;
}

template <bool plain>
inline bool Bsdf::transmits_diffusely() const {
    return !plain && scene::is_built(scene::Effect::DiffuseTransmission) && transmits_diffusely_;
}

template <bool plain>
inline bool Bsdf::is_anisotropic() const {
    return !plain && scene::is_built(scene::Effect::Anisotropy) && anisotropic_curve_.has_value();
}

template <bool plain>
inline bool Bsdf::has_coat() const {
    return !plain && scene::is_built(scene::Effect::Clearcoat) && has_coat_;
}

template <bool plain>
inline bool Bsdf::has_sheen() const {
    return !plain && scene::is_built(scene::Effect::Sheen) && has_sheen_;
}

template <bool plain>
inline bool Bsdf::has_rough_base() const {
    return !plain && scene::is_built(scene::Effect::RoughDiffuse) && p_.diffuse_roughness > 0.0f;
}

template <bool plain>
inline bool Bsdf::has_extras() const {
    using scene::Effect, scene::is_built;
    return !plain &&
           (is_built(Effect::Clearcoat) || is_built(Effect::Sheen) ||
            is_built(Effect::RoughDiffuse)) &&
           has_extras_;
}

}  // namespace velatura::shading
