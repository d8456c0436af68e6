// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "plugins/openimageio/sandbox/image_source.h"

#include <OpenImageIO/imageio.h>

#include <memory>
#include <span>
#include <string>

namespace velatura::plugins::openimageio {

/// Refuses what OpenImageIO's cache cannot count with, in tiles or all levels without: it ends the
/// process then. No image is more than `max_side` pixels wide or high. Errors: "image-open".
Result<void> check_texture(const SourceSpec& spec, int max_side);

/// An image file as the texture cache wants it: RGBA whatever the file has, sRGB decoded texel by
/// texel before any filtering, NaN and infinity replaced by 0. Tiles and mip levels of the file's
/// first image are kept. It decodes nothing itself: values come from a ImageSource.
class TextureInput final : public OIIO::ImageInput {
  public:
    /// For OIIO::ImageCache::add_file.
    static OIIO::ImageInput* create() { return new TextureInput; }

    /// What open() is to be given; the source must outlive the input.
    static OIIO::ImageSpec configuration(ImageSource& source,
                                         const std::string& file,
                                         bool is_srgb,
                                         int max_side);
    /// What texels of a file are kept as.
    static OIIO::TypeDesc cached_format(StoredAs stored, bool is_srgb);

    const char* format_name() const override { return "velatura-texture"; }

    bool open(const std::string& name, OIIO::ImageSpec& spec) override;
    bool open(const std::string& name,
              OIIO::ImageSpec& spec,
              const OIIO::ImageSpec& config) override;
    bool close() override;
    int current_subimage() const override;
    int current_miplevel() const override;
    bool seek_subimage(int subimage, int miplevel) override;
    bool read_native_scanline(int subimage, int miplevel, int y, int z, void* data) override;
    using OIIO::ImageInput::read_native_scanlines;
    bool read_native_scanlines(
        int subimage, int miplevel, int ybegin, int yend, int z, void* data) override;
    bool read_native_tile(int subimage, int miplevel, int x, int y, int z, void* data) override;

  private:
    /// Says why; returns false.
    bool reject(const Error& error);
    void adopt_level(int index);
    /// Widens `count` texels of `channels_` floats and stores them in the format of m_spec.
    void convert(std::span<const float> texels, size_t count, void* data) const;
    float decoded(float value) const;

    std::unique_ptr<SourceImage> image_;
    int level_ = 0;
    bool is_srgb_ = false;
    bool is_8_bit_ = false;
    int channels_ = 0;  ///< that are read
};

/// The sRGB transfer curve of IEC 61966-2-1, encoded → linear; odd symmetric below 0, extended
/// above 1.
float srgb_to_linear(float encoded);

}  // namespace velatura::plugins::openimageio
