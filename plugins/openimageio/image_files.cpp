// SPDX-License-Identifier: Apache-2.0
#include "plugins/openimageio/image_files.h"

#include "plugins/openimageio/decoding.h"
#include "plugins/openimageio/one_line.h"
#include "plugins/openimageio/sandbox/messages.h"

#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cstdint>
#include <exception>
#include <new>
#include <string_view>
#include <utility>
#include <vector>

namespace velatura::plugins::openimageio {

namespace {

class OpenImage final : public image::ImageFile {
  public:
    explicit OpenImage(std::unique_ptr<SourceImage> image) : image_(std::move(image)) {
        const SourceSpec& spec = image_->spec();
        const LevelSpec& level = spec.levels.at(0);
        facts_.width = level.width;
        facts_.height = level.height;
        facts_.channels = level.channels;
        facts_.is_floating_point =
            level.stored == StoredAs::Half || level.stored == StoredAs::OtherFloat;
        facts_.color_space = spec.color_space;
    }

    const image::ImageInfo& facts() const override { return facts_; }

    Result<void> read(int channels, std::span<float> values) override {
        try {
            return read_in_pieces(channels, values);
        } catch (const std::bad_alloc&) {
            throw;
        } catch (const std::exception& e) {
            return Error{"image-read", e.what()};
        }
    }

  private:
    Result<void> read_in_pieces(int channels, std::span<float> values) {
        const LevelSpec& level = image_->spec().levels[0];
        const size_t line = size_t(level.width) * size_t(channels);
        const int step = lines_at_once(level, line);
        for (int y = 0; y < level.height; y += step) {
            const int end = std::min(level.height, y + step);
            const Result<void> done =
                image_->read_lines(0, level.y + y, level.y + end, channels,
                                   values.subspan(size_t(y) * line, size_t(end - y) * line));
            if (!done) return done;
        }
        return {};
    }

    /// Whole rows of tiles; enough lines for all threads of a reader, where a format has blocks.
    static int lines_at_once(const LevelSpec& level, size_t values_of_line) {
        constexpr size_t max_bytes = 8 * piece_bytes;
        const size_t lines = std::max<size_t>(1, max_bytes / (values_of_line * sizeof(float)));
        const int max = int(std::min(lines, size_t(level.height)));
        if (level.tile_width <= 0) return max;
        return std::max(1, max / level.tile_height) * level.tile_height;
    }

    std::unique_ptr<SourceImage> image_;
    image::ImageInfo facts_;
};

/// Whether its lines can be counted and asked for; how large it may be, the caller decides.
bool has_lines(const LevelSpec& level) {
    constexpr int max_side = 1 << 29;
    const auto is_side = [](int side) { return side >= 1 && side <= max_side; };
    const bool is_tiled = level.tile_width > 0;
    return level.is_flat == 1 && is_side(level.width) && is_side(level.height) &&
           level.channels >= 1 && level.y >= -max_side && level.y <= max_side &&
           (!is_tiled || (is_side(level.tile_height) && has_sane_tiles(level)));
}

/// As OpenImageIO takes fewer than 16 bits: the first bits are the value's, the others repeat them,
/// so that the largest is 65535.
std::vector<uint16_t> full_range(const image::StoredImage& image) {
    const int missing = 16 - image.bits;
    std::vector<uint16_t> words(image.values.size());
    std::transform(image.values.begin(), image.values.end(), words.begin(), [&](uint16_t v) {
        return uint16_t((v << missing) | (v >> (image.bits - missing)));
    });
    return words;
}

}  // namespace

Result<std::unique_ptr<image::ImageFile>> Images::open(const std::string& asset) const {
    try {
        Result<std::unique_ptr<SourceImage>> opened = image_source().open(asset, ImageUse::Image);
        if (!opened) return opened.error();
        if (!has_lines((*opened)->spec().levels.at(0)))
            return Error{
                "image-open",
                "not a flat image with at least one pixel and tiles no larger than the image"};
        return std::unique_ptr<image::ImageFile>(new OpenImage(std::move(*opened)));
    } catch (const std::bad_alloc&) {
        throw;
    } catch (const std::exception& e) {
        return Error{"image-open", e.what()};
    }
}

void Images::limit(const DecodeLimits& limits) const {
    select_image_source(limits);
}

Result<void> Images::write(const std::string& file, const image::StoredImage& image) const {
    const auto error = [](const std::string& why) { return Error{"io-write", one_line(why)}; };
    try {
        const auto output = OIIO::ImageOutput::create(file);
        if (!output) return error(OIIO::geterror());
        const bool is_wide = image.bits > 8;
        OIIO::ImageSpec spec(image.width, image.height, image.channels,
                             is_wide ? OIIO::TypeDesc::UINT16 : OIIO::TypeDesc::UINT8);
        spec.attribute("oiio:ColorSpace", "sRGB");
        spec.attribute("oiio:BitsPerSample", image.bits);
        spec.attribute("oiio:UnassociatedAlpha", 1);
        if (output->format_name() == std::string_view("jpeg"))
            spec.attribute("Compression", "jpeg:95");
        if (image.pixel_aspect != 1.0f) spec.attribute("PixelAspectRatio", image.pixel_aspect);
        if (!output->open(file, spec)) return error(output->geterror());
        std::vector<uint16_t> words;
        std::vector<uint8_t> bytes;
        if (is_wide) {
            words = full_range(image);
        } else {
            bytes.assign(image.values.begin(), image.values.end());
        }
        const void* const values = is_wide ? static_cast<const void*>(words.data()) : bytes.data();
        if (!output->write_image(spec.format, values)) return error(output->geterror());
        if (!output->close()) return error(output->geterror());
        return {};
    } catch (const std::exception& e) {
        return error(e.what());
    }
}

}  // namespace velatura::plugins::openimageio
