// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"

namespace velatura::shading {

/// What a thin sheet with two equal interfaces makes of light, once all its reflections to and fro
/// inside have left it.
struct SheetShares {
    Rgb reflected = Rgb(1.0f);
    Rgb transmitted = Rgb(0.0f);
};

/// Interfaces that reflect R and pass T = 1 − R; t of the light survives one passage between them:
/// R' = R + T²Rt² / (1 − R²t²), T' = T²t / (1 − R²t²). For t = 1 that is 2R / (1 + R) and
/// (1 − R) / (1 + R).
inline SheetShares sheet_shares(const Rgb& reflectance, const Rgb& passage) {
    SheetShares s;
    for (int c = 0; c < 3; ++c) {
        const float R = reflectance[c], t = passage[c], T = 1.0f - R;
        const float rest = (1.0f - R * t) * (1.0f + R * t);
        if (!(T > 0.0f) || !(rest > 0.0f)) continue;
        s.transmitted[c] = T * T * t / rest;
        s.reflected[c] = R + s.transmitted[c] * R * t;
    }
    return s;
}

}  // namespace velatura::shading
