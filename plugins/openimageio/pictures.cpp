// SPDX-License-Identifier: Apache-2.0
#include "plugins/openimageio/pictures.h"

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

class OpenPicture final : public image::Picture {
  public:
    explicit OpenPicture(std::unique_ptr<SourcePicture> picture) : picture_(std::move(picture)) {
        const PictureSpec& spec = picture_->spec();
        const LevelSpec& level = spec.levels.at(0);
        facts_.width = level.width;
        facts_.height = level.height;
        facts_.channels = level.channels;
        facts_.is_floating_point =
            level.stored == StoredAs::Half || level.stored == StoredAs::OtherFloat;
        facts_.color_space = spec.color_space;
    }

    const image::PictureFacts& facts() const override { return facts_; }

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
        const LevelSpec& level = picture_->spec().levels[0];
        const size_t line = size_t(level.width) * size_t(channels);
        const int step = lines_at_once(level, line);
        for (int y = 0; y < level.height; y += step) {
            const int end = std::min(level.height, y + step);
            const Result<void> done =
                picture_->read_lines(0, level.y + y, level.y + end, channels,
                                     values.subspan(size_t(y) * line, size_t(end - y) * line));
            if (!done) return done;
        }
        return {};
    }

    /// Whole rows of tiles; enough lines for all threads of a reader, where a format has blocks.
    static int lines_at_once(const LevelSpec& level, size_t values_of_line) {
        constexpr size_t most_bytes = 8 * piece_bytes;
        const size_t lines = std::max<size_t>(1, most_bytes / (values_of_line * sizeof(float)));
        const int most = int(std::min(lines, size_t(level.height)));
        if (level.tile_width <= 0) return most;
        return std::max(1, most / level.tile_height) * level.tile_height;
    }

    std::unique_ptr<SourcePicture> picture_;
    image::PictureFacts facts_;
};

/// Whether its lines can be counted and asked for; how large it may be, the caller decides.
bool has_lines(const LevelSpec& level) {
    constexpr int most_side = 1 << 29;
    const auto is_side = [](int side) { return side >= 1 && side <= most_side; };
    const bool is_tiled = level.tile_width > 0;
    return level.is_flat == 1 && is_side(level.width) && is_side(level.height) &&
           level.channels >= 1 && level.y >= -most_side && level.y <= most_side &&
           (!is_tiled || (is_side(level.tile_height) && has_sane_tiles(level)));
}

/// As OpenImageIO takes fewer than 16 bits: the first bits are the value's, the others repeat them,
/// so that the largest is 65535.
std::vector<uint16_t> full_range(const image::StoredPicture& picture) {
    const int missing = 16 - picture.bits;
    std::vector<uint16_t> words(picture.values.size());
    std::transform(picture.values.begin(), picture.values.end(), words.begin(), [&](uint16_t v) {
        return uint16_t((v << missing) | (v >> (picture.bits - missing)));
    });
    return words;
}

}  // namespace

Result<std::unique_ptr<image::Picture>> Pictures::open(const std::string& asset) const {
    try {
        Result<std::unique_ptr<SourcePicture>> opened =
            picture_source().open(asset, PictureUse::Picture);
        if (!opened) return opened.error();
        if (!has_lines((*opened)->spec().levels.at(0)))
            return Error{
                "image-open",
                "not a flat image with at least one pixel and tiles no larger than the image"};
        return std::unique_ptr<image::Picture>(new OpenPicture(std::move(*opened)));
    } catch (const std::bad_alloc&) {
        throw;
    } catch (const std::exception& e) {
        return Error{"image-open", e.what()};
    }
}

void Pictures::limit(const DecodeLimits& limits) const {
    select_picture_source(limits);
}

Result<void> Pictures::write(const std::string& file, const image::StoredPicture& picture) const {
    const auto error = [](const std::string& why) { return Error{"io-write", one_line(why)}; };
    try {
        const auto output = OIIO::ImageOutput::create(file);
        if (!output) return error(OIIO::geterror());
        const bool is_wide = picture.bits > 8;
        OIIO::ImageSpec spec(picture.width, picture.height, picture.channels,
                             is_wide ? OIIO::TypeDesc::UINT16 : OIIO::TypeDesc::UINT8);
        spec.attribute("oiio:ColorSpace", "sRGB");
        spec.attribute("oiio:BitsPerSample", picture.bits);
        spec.attribute("oiio:UnassociatedAlpha", 1);
        if (output->format_name() == std::string_view("jpeg"))
            spec.attribute("Compression", "jpeg:95");
        if (picture.pixel_aspect != 1.0f) spec.attribute("PixelAspectRatio", picture.pixel_aspect);
        if (!output->open(file, spec)) return error(output->geterror());
        std::vector<uint16_t> words;
        std::vector<uint8_t> bytes;
        if (is_wide) {
            words = full_range(picture);
        } else {
            bytes.assign(picture.values.begin(), picture.values.end());
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
