// SPDX-License-Identifier: Apache-2.0
#include "render/light_images.h"

#include "image/formats.h"

#include <algorithm>

namespace velatura::render {

namespace {

image::SourceColorSpace curve_of(scene::SourceColorSpace space) {
    switch (space) {
        case scene::SourceColorSpace::Raw:
            return image::SourceColorSpace::Raw;
        case scene::SourceColorSpace::Srgb:
            return image::SourceColorSpace::Srgb;
        case scene::SourceColorSpace::Auto:
            break;
    }
    return image::SourceColorSpace::Auto;
}

}  // namespace

lights::ImageLoader make_light_image_loader() {
    return [](const scene::Light& light) -> Result<lights::EnvironmentImage> {
        Result<image::RgbImage> read =
            image::read_rgb_image(light.texture_file, curve_of(light.texture_colors.curve));
        if (!read) return read.error();
        lights::EnvironmentImage out;
        out.width = read->width;
        out.height = read->height;
        out.texels.resize(size_t(read->width) * size_t(read->height));
        for (size_t i = 0; i < out.texels.size(); ++i)
            out.texels[i] =
                Rgb(read->pixels[3 * i], read->pixels[3 * i + 1], read->pixels[3 * i + 2]);
        const scene::ColorDecoding& decoding = light.texture_colors.decoding;
        if (decoding.is_identity()) return out;
        // No light takes light away: what lies outside Rec.709 is clipped
        for (Rgb& texel : out.texels) {
            const Vec3d color = decoding({texel.x, texel.y, texel.z});
            texel = Rgb(std::max(float(color.x), 0.0f), std::max(float(color.y), 0.0f),
                        std::max(float(color.z), 0.0f));
        }
        return out;
    };
}

}  // namespace velatura::render
