// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/limits.h"
#include "base/result.h"

#include <cstdint>
#include <memory>
#include <span>
#include <string>

namespace velatura::image {

/// Under this name and version a plugin hands out a `const ImageLibrary*`. The version changes
/// whenever this header or a type that it mentions does.
inline constexpr const char* image_interface = "pictures";
inline constexpr uint32_t image_interface_version = 5;

/// What an image says of itself before its pixels are read.
struct ImageInfo {
    int width = 0, height = 0, channels = 0;
    bool is_floating_point = false;  ///< as stored
    std::string color_space;         ///< as stated, e.g. "sRGB", "linear"; may be empty
};

/// An open image.
class ImageFile {
  public:
    virtual ~ImageFile() = default;

    virtual const ImageInfo& facts() const = 0;

    /// Reads the first `channels` channels as they are stored, integers as 0 … 1: [height][width]
    /// [channels], row 0 = top. Errors: "image-read".
    virtual Result<void> read(int channels, std::span<float> values) = 0;
};

/// A display image, as a file is to hold it.
struct StoredImage {
    int width = 0, height = 0;
    int channels = 3;                  ///< RGB; 4: and alpha, which RGB is not multiplied by
    int bits = 8;                      ///< per channel, at most 16
    std::span<const uint16_t> values;  ///< [height][width][channels], 0 … 2^bits − 1
    float pixel_aspect = 1;            ///< width of a pixel in its heights
};

/// Image files of all formats. Nothing throws. Thread-safe.
class ImageLibrary {
  public:
    virtual ~ImageLibrary() = default;

    /// Opens an image by the name of its asset, a file or one in a package. Errors: those of
    /// open_asset_bytes, "image-open" (not an image, or in a package and of a format that cannot
    /// be read from memory).
    virtual Result<std::unique_ptr<ImageFile>> open(const std::string& asset) const = 0;

    /// Writes in the format that the name ends in. Errors: "io-write"; what was written until then
    /// stays.
    virtual Result<void> write(const std::string& file, const StoredImage& image) const = 0;

    /// For images that are opened from here on.
    virtual void limit(const DecodeLimits& limits) const = 0;
};

/// The plugin's; opens it when first called. Images are decoded as decode_limits() says at the last
/// call. Thread-safe. Errors: those
/// of plugin::open_needed, the same at every call.
Result<const ImageLibrary*> image_library();

}  // namespace velatura::image
