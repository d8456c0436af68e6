// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "plugins/openimageio/asset_image.h"

#include <OpenImageIO/imageio.h>

#include <optional>
#include <string>
#include <vector>

namespace velatura::plugins::openimageio {

/// An image file as the texture cache wants it: RGBA whatever the file has, sRGB decoded texel by
/// texel before any filtering, NaN and infinity replaced by 0. Tiles and mip levels of the file are
/// kept. Configuration for open(): "velatura:file" (string, the file), "velatura:srgb" (int, decode
/// colours).
class TextureInput final : public OIIO::ImageInput {
  public:
    /// For OIIO::ImageCache::add_file.
    static OIIO::ImageInput* create() { return new TextureInput; }

    /// What open() is to be given.
    static OIIO::ImageSpec configuration(const std::string& file, bool is_srgb);
    /// How to open the file itself: alpha left unassociated, as UsdUVTexture reads it.
    static OIIO::ImageSpec file_configuration();
    /// What texels of a file are kept as.
    static OIIO::TypeDesc stored_format(OIIO::TypeDesc file_format, bool is_srgb);

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
    bool read_native_tile(int subimage, int miplevel, int x, int y, int z, void* data) override;

  private:
    bool open_file();
    /// Makes line y the next that can be read.
    bool reach_line(int subimage, int miplevel, int y);
    void adopt_spec();
    /// Widens `count` texels of `channels_` floats and stores them in the format of m_spec.
    void convert(const std::vector<float>& texels, size_t count, void* data) const;
    float decoded(float value) const;

    std::string path_;
    std::optional<AssetImage> file_;
    int next_line_ = 0;  ///< first one that no line before was read after, in a packaged file
    bool is_srgb_ = false;
    bool is_8_bit_ = false;
    int channels_ = 0;
};

/// The sRGB transfer curve of IEC 61966-2-1, encoded → linear; odd symmetric below 0, extended
/// above 1.
float srgb_to_linear(float encoded);

}  // namespace velatura::plugins::openimageio
