// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/asset_bytes.h"
#include "base/result.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <memory>
#include <string>

namespace velatura::plugins::openimageio {

/// An open image, in a file or in a package ("pkg.usdz[tex/a.png]", read from the package's own
/// bytes).
class AssetImage {
  public:
    OIIO::ImageInput* operator->() const { return input_.get(); }

    OIIO::ImageInput& operator*() const { return *input_; }

    /// Read from memory. Formats that go back to an earlier line by opening their file again cannot
    /// do so then: whoever goes back opens the asset again.
    bool is_packaged() const { return proxy_ != nullptr; }

  private:
    friend Result<AssetImage> open_asset_image(const std::string&, const OIIO::ImageSpec*);

    // Destroyed from the last to the first: the image reads from the proxy, the proxy from the
    // bytes
    AssetBytesPtr bytes_;
    std::unique_ptr<OIIO::Filesystem::IOMemReader> proxy_;
    std::unique_ptr<OIIO::ImageInput> input_;
};

/// Opens an image by the name of its asset. Errors: those of open_asset_bytes, "image-open" (not a
/// regular file or no image, or in a package and of a format that OpenImageIO cannot read from
/// memory).
Result<AssetImage> open_asset_image(const std::string& name,
                                    const OIIO::ImageSpec* configuration = nullptr);

}  // namespace velatura::plugins::openimageio
