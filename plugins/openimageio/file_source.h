// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "plugins/openimageio/sandbox/image_source.h"

#include <memory>
#include <string>

namespace velatura::plugins::openimageio {

/// Decodes in this process, by OpenImageIO: what a decoder does to memory, and how long it takes,
/// it does to this process.
class FileSource final : public ImageSource {
  public:
    Result<std::unique_ptr<SourceImage>> open(const std::string& asset, ImageUse use) override;
};

}  // namespace velatura::plugins::openimageio
