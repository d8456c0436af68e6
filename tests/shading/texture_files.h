// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "temporary_folder.h"

#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include <map>
#include <string>
#include <vector>

namespace velatura::shading::testing {

/// Images in any format and with any header, written by OpenImageIO itself.
class ImageFolder : public TemporaryFolder {
  public:
    /// pixels[height][width][channels], row 0 = top; attributes are strings of the file's header.
    std::string write(const std::string& name,
                      int width,
                      int height,
                      int channels,
                      OIIO::TypeDesc format,
                      const std::vector<float>& pixels,
                      const std::map<std::string, std::string>& attributes = {}) const {
        const std::string path = file(name);
        const auto out = OIIO::ImageOutput::create(path);
        OIIO::ImageSpec spec(width, height, channels, format);
        spec.attribute("oiio:UnassociatedAlpha", 1);
        for (const auto& [key, value] : attributes) spec.attribute(key, value);
        // Values are codes: nothing is to be converted on the way to the file
        EXPECT_TRUE(out && out->open(path, spec)) << path;
        EXPECT_TRUE(out->write_image(OIIO::TypeFloat, pixels.data()));
        EXPECT_TRUE(out->close());
        return path;
    }
};

}  // namespace velatura::shading::testing
