// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"

#include <cstdint>

namespace velatura::shading {

/// What a layered surface draws directions from.
enum LobeId : uint8_t {
    Cosine,
    Specular,
    Coat,
    Interface,   // rough: reflects or refracts at one microfacet, for Specular and
                 // Transmission
    Sheet,       // thin and rough: reflects at one microfacet, or the same mirrored
    CosineBack,  // to the other side of a sheet
    MirrorSpecular,
    MirrorCoat,
    Transmission,
    LobeCount
};

/// What depends on wo alone.
struct LayerView {
    Vec3 wo;                         // local
    float mu = 0;                    // wo.z
    Rgb specular = Rgb(0.0f);        // directional albedo R(μ) of the interface to the base
    Rgb reflected = Rgb(0.0f);       // that of all specular reflection; of a sheet more
    Rgb through = Rgb(0.0f);         // what transmits where nothing is opaque
    Rgb single_scatter = Rgb(0.0f);  // its share without compensation
    float loss = 0;                  // 1 − A(μ, α), what single scattering loses
    Rgb lost = Rgb(0.0f);            // of a rough interface: what returns by compensation
    float coat = 0;                  // directional albedo of the coat, weight included
    float coat_single = 0;
    float coat_loss = 0;
    float sheen = 0;                    // albedo of white sheen
    float probability[LobeCount] = {};  // of each LobeId; sums to 1 or all 0
};

}  // namespace velatura::shading
