// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace velatura::shading {

/// What a surface has beyond an opaque base with one isotropic reflection. plain: known beforehand
/// to have nothing, so that a plain surface asks for nothing.
struct SurfaceFeatures {
    float base_opacity = 1;
    bool thin = false, dense_side = false, tint = false, rough_interface = false;
    bool rough_sheet = false, diffuse_transmission = false, coat = false, sheen = false;
    bool rough_base = false;
    bool extras = false;  ///< coat, sheen or a rough base

    template <bool plain = false>
    bool is_thin() const {
        return !plain && thin;
    }

    template <bool plain = false>
    bool transmits() const {
        return !plain && base_opacity < 1.0f;
    }

    /// What is left to the base.
    template <bool plain = false>
    float opacity() const {
        return !plain ? base_opacity : 1.0f;
    }

    /// Transmitting, and wo is on the side of the larger index.
    template <bool plain = false>
    bool is_dense_side() const {
        return !plain && dense_side;
    }

    template <bool plain = false>
    bool has_tint() const {
        return !plain && tint;
    }

    template <bool plain = false>
    bool is_rough_interface() const {
        return !plain && rough_interface;
    }

    template <bool plain = false>
    bool is_rough_sheet() const {
        return !plain && rough_sheet;
    }

    template <bool plain = false>
    bool transmits_diffusely() const {
        return !plain && diffuse_transmission;
    }

    template <bool plain = false>
    bool has_coat() const {
        return !plain && coat;
    }

    template <bool plain = false>
    bool has_sheen() const {
        return !plain && sheen;
    }

    template <bool plain = false>
    bool has_rough_base() const {
        return !plain && rough_base;
    }

    template <bool plain = false>
    bool has_extras() const {
        return !plain && extras;
    }
};

}  // namespace velatura::shading
