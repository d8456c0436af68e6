// SPDX-License-Identifier: Apache-2.0
#include "app/light_images.h"

#include "image/formats.h"

namespace velatura::app {

lights::ImageLoader make_light_image_loader() {
    return [](const scene::Light& light) -> Result<lights::EnvironmentImage> {
        Result<image::RgbImage> read = image::read_rgb_image(light.texture_file);
        if (!read) return read.error();
        lights::EnvironmentImage out;
        out.width = read->width;
        out.height = read->height;
        out.texels.resize(size_t(read->width) * size_t(read->height));
        for (size_t i = 0; i < out.texels.size(); ++i)
            out.texels[i] =
                Rgb(read->pixels[3 * i], read->pixels[3 * i + 1], read->pixels[3 * i + 2]);
        return out;
    };
}

}  // namespace velatura::app
