// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace velatura::plugins::openimageio {

/// How a file keeps its values.
enum class StoredAs : int32_t { UInt8, UInt16, Half, OtherFloat, OtherInteger };

/// Measures of one level of detail, in OpenImageIO's words; untiled where tile_width is 0.
struct LevelSpec {
    int32_t x = 0, y = 0, width = 0, height = 0;
    int32_t full_x = 0, full_y = 0, full_width = 0, full_height = 0;
    int32_t tile_width = 0, tile_height = 0;
    int32_t channels = 0;
    StoredAs stored = StoredAs::OtherFloat;
    int32_t is_flat = 0;  ///< 1: neither deep nor of several slices

    bool operator==(const LevelSpec&) const = default;
};

/// Whether decoding one tile takes about what the image has, or little: a file of bytes may say
/// that its tiles have gigabytes.
inline bool has_sane_tiles(const LevelSpec& finest) {
    constexpr int64_t little = int64_t(1) << 20;  // pixels
    const int64_t pixels = int64_t(finest.width) * finest.height;
    return int64_t(finest.tile_width) * finest.tile_height <=
           (pixels > little / 4 ? 4 * pixels : little);
}

/// What a file says of its first image.
struct SourceSpec {
    static constexpr size_t max_levels = 64;

    std::vector<LevelSpec> levels;           ///< the finest first; at least one
    std::string color_space;                 ///< as stated, e.g. "sRGB", "linear"; may be empty
    std::string wrap_modes, wrap_s, wrap_t;  ///< "wrapmodes", "wrapS", "wrapT" of the file
    std::string texture_format;              ///< "textureformat" of the file
    int32_t rows_per_strip = 0;  ///< lines that are compressed together, of TIFF; 0: not said

    bool operator==(const SourceSpec&) const = default;
};

/// What a file is opened for.
enum class ImageUse : int32_t {
    Image,    ///< the finest level, alpha associated as OpenImageIO does
    Texture,  ///< all levels, alpha left as it is
};

/// An open image. Not thread-safe.
class SourceImage {
  public:
    virtual ~SourceImage() = default;

    virtual const SourceSpec& spec() const = 0;

    /// Lines y … y_end-1 of a level, as stored, integers as 0 … 1: [y_end - y][width][channels],
    /// the first `channels` of the file. Of tiled levels whole rows of tiles. Errors: "image-read".
    virtual Result<void> read_lines(
        int level, int y, int y_end, int channels, std::span<float> values) = 0;

    /// The tile that begins at (x, y): [tile_height][tile_width][channels]; 0 outside of the
    /// image. Errors: "image-read".
    virtual Result<void> read_tile(
        int level, int x, int y, int channels, std::span<float> values) = 0;
};

/// Opens images by the names of their assets. Thread-safe. Of exceptions only those for want of
/// memory come out.
class ImageSource {
  public:
    virtual ~ImageSource() = default;

    /// Errors: "image-open", and those of open_asset_bytes.
    virtual Result<std::unique_ptr<SourceImage>> open(const std::string& asset, ImageUse use) = 0;
};

}  // namespace velatura::plugins::openimageio
