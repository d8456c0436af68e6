// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "shading/texture_source.h"

#include <memory>

namespace velatura::plugins::openimageio {

/// OpenImageIO's TextureSystem, one of its own for each source.
class TextureSystemFactory final : public shading::TextureSourceFactory {
  public:
    Result<std::unique_ptr<shading::TextureSource>> make(
        size_t memory_bytes, const DecodeLimits& decoding) const override;
};

}  // namespace velatura::plugins::openimageio
