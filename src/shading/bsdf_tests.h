// SPDX-License-Identifier: Apache-2.0
// What a Bsdf asks itself before it does more than a plain surface needs, to be inlined into its
// parts.
#pragma once

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
    return kind_ == Kind::Hair;
}

template <bool plain>
inline bool Bsdf::is_thin() const {
    return !plain && p_.is_thin;
}

template <bool plain>
inline bool Bsdf::transmits() const {
    return !plain && p_.opacity < 1.0f;
}

/// What is left to the base.
template <bool plain>
inline float Bsdf::opacity() const {
    return !plain ? p_.opacity : 1.0f;
}

template <bool plain>
inline bool Bsdf::is_dense_side() const {
    return !plain && is_dense_side_;
}

template <bool plain>
inline bool Bsdf::has_tint() const {
    return !plain && has_tint_;
}

template <bool plain>
inline bool Bsdf::is_rough_interface() const {
    return !plain && is_rough_interface_;
}

template <bool plain>
inline bool Bsdf::is_rough_sheet() const {
    return !plain && is_rough_sheet_;
}

template <bool plain>
inline bool Bsdf::transmits_diffusely() const {
    return !plain && transmits_diffusely_;
}

template <bool plain>
inline bool Bsdf::is_anisotropic() const {
    return !plain && anisotropic_curve_.has_value();
}

template <bool plain>
inline bool Bsdf::has_coat() const {
    return !plain && has_coat_;
}

template <bool plain>
inline bool Bsdf::has_sheen() const {
    return !plain && has_sheen_;
}

template <bool plain>
inline bool Bsdf::has_rough_base() const {
    return !plain && p_.diffuse_roughness > 0.0f;
}

template <bool plain>
inline bool Bsdf::has_extras() const {
    return !plain && has_extras_;
}

}  // namespace velatura::shading
