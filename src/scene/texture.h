// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "scene/color_decoding.h"
#include "scene/ids.h"

#include <array>
#include <cstdint>
#include <string>

namespace velatura::scene {

/// UsdUVTexture wrap modes; Black is transparent black, UseMetadata without metadata in the file is
/// Black.
enum class Wrap : uint8_t { UseMetadata, Black, Clamp, Repeat, Mirror };

/// How texels become scene-linear numbers. Auto: the file's metadata, else sRGB for 8-bit images of
/// 3 or 4 channels.
enum class SourceColorSpace : uint8_t { Auto, Raw, Srgb };

/// The color space of an image's texels: `curve` comes off before they are filtered, what
/// `decoding` holds after.
struct TexelColors {
    SourceColorSpace curve = SourceColorSpace::Auto;
    ColorDecoding decoding;  ///< of red, green and blue
};

/// A UsdUVTexture. st is looked up from the primvar `st`, mapped by st' = st · st_scale_rotation +
/// st_offset; (0,0) is the lower left corner. Result = texel (decoded) · scale + bias; where the
/// file cannot be read, the primvar `fallback_primvar` if the surface has it, else `fallback`.
struct Texture {
    std::string file;      ///< resolved path; "<UDIM>" stands for the tile number
    std::string authored;  ///< as written in the scene, for messages and headers
    Wrap wrap_s = Wrap::UseMetadata;
    Wrap wrap_t = Wrap::UseMetadata;
    TexelColors colors;
    std::array<float, 4> scale = {1, 1, 1, 1};
    std::array<float, 4> bias = {0, 0, 0, 0};
    std::array<float, 4> fallback = {0, 0, 0, 1};
    PrimvarId fallback_primvar = none;
    PrimvarId st = none;  ///< none: st is constant `st_constant`
    Vec2 st_constant = {0, 0};
    /// Row-vector 2×2 and offset: (s', t') = (s·m[0] + t·m[2], s·m[1] + t·m[3]) + offset.
    std::array<float, 4> st_matrix = {1, 0, 0, 1};
    Vec2 st_offset = {0, 0};
    ProvenanceId provenance = none;
};

}  // namespace velatura::scene
