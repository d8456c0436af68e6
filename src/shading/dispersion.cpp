// SPDX-License-Identifier: Apache-2.0
#include "shading/dispersion.h"

#include "image/primaries.h"

namespace velatura::shading {

namespace {

/// Dominant wavelengths [micrometers] of the primaries, seen from the white of their space: where
/// the ray from white through the primary meets the spectral locus (CIE 015:2018, section 6.2;
/// CIE 1931 standard observer).
struct DominantWavelengths {
    std::string_view space;
    float red, green, blue;
};

// Visible light ends before the dominant wavelength of the red of ACES2065-1, 698.9 nm
constexpr float shortest = 0.4200f, longest = 0.6800f;
constexpr DominantWavelengths dominant[] = {{"lin_rec709_scene", 0.6114f, 0.5491f, 0.4642f},
                                            {"lin_ap1_scene", 0.6287f, 0.5329f, 0.4674f},
                                            {"lin_ap0_scene", longest, 0.5208f, 0.4729f},
                                            {"lin_rec2020_scene", 0.6300f, 0.5320f, 0.4670f},
                                            {"lin_p3d65_scene", 0.6149f, 0.5442f, 0.4642f},
                                            {"lin_adobergb_scene", 0.6114f, 0.5347f, 0.4642f}};

}  // namespace

WavelengthBands wavelength_bands(std::string_view working_space) {
    const image::StandardSpace* wanted = image::standard_space(working_space);
    const DominantWavelengths* of = &dominant[0];
    for (const DominantWavelengths& d : dominant)
        if (image::standard_space(d.space) == wanted) of = &d;
    return {{{of->green, of->red, longest},
             {of->blue, of->green, of->red},
             {shortest, of->blue, of->green}}};
}

}  // namespace velatura::shading
