// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "image/image_library.h"

#include <memory>
#include <string>

namespace velatura::plugins::openimageio {

/// All formats of OpenImageIO.
class Images final : public image::ImageLibrary {
  public:
    Result<std::unique_ptr<image::ImageFile>> open(const std::string& asset) const override;
    Result<void> write(const std::string& file, const image::StoredImage& image) const override;
    void limit(const DecodeLimits& limits) const override;
};

}  // namespace velatura::plugins::openimageio
