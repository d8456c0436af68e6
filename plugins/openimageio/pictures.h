// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "image/picture_library.h"

#include <memory>
#include <string>

namespace velatura::plugins::openimageio {

/// All formats of OpenImageIO.
class Pictures final : public image::PictureLibrary {
  public:
    Result<std::unique_ptr<image::Picture>> open(const std::string& asset) const override;
    Result<void> write(const std::string& file, const image::StoredPicture& picture) const override;
    void limit(const DecodeLimits& limits) const override;
};

}  // namespace velatura::plugins::openimageio
