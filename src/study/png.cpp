// SPDX-License-Identifier: Apache-2.0
#include "study/png.h"

#include "base/check.h"
#include "image/formats.h"

#include <algorithm>
#include <cstdint>

// One header with its code in it
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wall"
#pragma GCC diagnostic ignored "-Wextra"
#pragma GCC diagnostic ignored "-Wpedantic"
#pragma GCC diagnostic ignored "-Wold-style-cast"
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"
#pragma GCC diagnostic ignored "-Wmissing-declarations"
#pragma GCC diagnostic ignored "-Wdouble-promotion"
#pragma GCC diagnostic ignored "-Wfloat-conversion"
#pragma GCC diagnostic ignored "-Wshadow"
#define STB_IMAGE_WRITE_STATIC
#define STB_IMAGE_WRITE_IMPLEMENTATION
#define STBI_WRITE_NO_STDIO
#include <stb/stb_image_write.h>
#pragma GCC diagnostic pop

namespace velatura::study {

std::string to_png(int width, int height, const std::vector<float>& rgb) {
    VELATURA_CHECK(rgb.size() == 3 * size_t(width) * size_t(height),
                   "an image has three values for each pixel");
    std::vector<uint8_t> bytes(rgb.size());
    std::transform(rgb.begin(), rgb.end(), bytes.begin(), image::display_byte);
    std::string out;
    const auto append = [](void* to, void* data, int size) {
        static_cast<std::string*>(to)->append(static_cast<const char*>(data), size_t(size));
    };
    const int is_written =
        stbi_write_png_to_func(append, &out, width, height, 3, bytes.data(), 3 * width);
    VELATURA_CHECK(is_written != 0, "an image in memory can be written");
    return out;
}

}  // namespace velatura::study
