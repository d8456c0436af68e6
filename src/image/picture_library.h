// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/limits.h"
#include "base/result.h"

#include <cstdint>
#include <memory>
#include <span>
#include <string>

namespace velatura::image {

/// Under this name and version a plugin hands out a `const PictureLibrary*`. The version changes
/// whenever this header or a type that it mentions does.
inline constexpr const char* picture_interface = "pictures";
inline constexpr uint32_t picture_interface_version = 5;

/// What a picture says of itself before its pixels are read.
struct PictureFacts {
    int width = 0, height = 0, channels = 0;
    bool is_floating_point = false;  ///< as stored
    std::string color_space;         ///< as stated, e.g. "sRGB", "linear"; may be empty
};

/// An open picture.
class Picture {
  public:
    virtual ~Picture() = default;

    virtual const PictureFacts& facts() const = 0;

    /// Reads the first `channels` channels as they are stored, integers as 0 … 1: [height][width]
    /// [channels], row 0 = top. Errors: "image-read".
    virtual Result<void> read(int channels, std::span<float> values) = 0;
};

/// A display picture, as a file is to hold it.
struct StoredPicture {
    int width = 0, height = 0;
    int channels = 3;                  ///< RGB; 4: and alpha, which RGB is not multiplied by
    int bits = 8;                      ///< per channel, at most 16
    std::span<const uint16_t> values;  ///< [height][width][channels], 0 … 2^bits − 1
    float pixel_aspect = 1;            ///< width of a pixel in its heights
};

/// Picture files of all formats. Nothing throws. Thread-safe.
class PictureLibrary {
  public:
    virtual ~PictureLibrary() = default;

    /// Opens a picture by the name of its asset, a file or one in a package. Errors: those of
    /// open_asset_bytes, "image-open" (not a picture, or in a package and of a format that cannot
    /// be read from memory).
    virtual Result<std::unique_ptr<Picture>> open(const std::string& asset) const = 0;

    /// Writes in the format that the name ends in. Errors: "io-write"; what was written until then
    /// stays.
    virtual Result<void> write(const std::string& file, const StoredPicture& picture) const = 0;

    /// For pictures that are opened from here on.
    virtual void limit(const DecodeLimits& limits) const = 0;
};

/// The plugin's; opens it when first called. Images are decoded as decode_limits() says at the last
/// call. Thread-safe. Errors: those
/// of plugin::open_needed, the same at every call.
Result<const PictureLibrary*> picture_library();

}  // namespace velatura::image
