// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <vector>

namespace velatura::shading::testing {

/// A folder of its own that goes away with the object.
class TemporaryFolder {
  public:
    TemporaryFolder()
        : path_(std::filesystem::temp_directory_path() /
                ("velatura_shading_" + std::to_string(::getpid()) + "_" +
                 std::to_string(++counter()))) {
        std::filesystem::create_directories(path_);
    }

    ~TemporaryFolder() {
        std::error_code ignored;
        std::filesystem::remove_all(path_, ignored);
    }

    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;

    std::string file(const std::string& name) const { return (path_ / name).string(); }

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

    std::string write_text(const std::string& name, const std::string& text) const {
        std::ofstream(file(name)) << text;
        return file(name);
    }

  private:
    static int& counter() {
        static int n = 0;
        return n;
    }

    std::filesystem::path path_;
};

}  // namespace velatura::shading::testing
