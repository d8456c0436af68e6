// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "image/picture_library.h"

#include <cstdint>
#include <memory>
#include <span>
#include <string>

namespace velatura::plugins::openimageio {

/// All formats of OpenImageIO.
class Pictures final : public image::PictureLibrary {
  public:
    Result<std::unique_ptr<image::Picture>> open(const std::string& asset) const override;
    Result<void> write(const std::string& file,
                       int width,
                       int height,
                       std::span<const uint8_t> rgb,
                       float pixel_aspect) const override;
    void limit(const DecodeLimits& limits) const override;
};

}  // namespace velatura::plugins::openimageio
