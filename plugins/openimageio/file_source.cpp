// SPDX-License-Identifier: Apache-2.0
#include "plugins/openimageio/file_source.h"

#include "plugins/openimageio/asset_image.h"
#include "plugins/openimageio/one_line.h"

#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <exception>
#include <limits>
#include <new>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

namespace velatura::plugins::openimageio {

namespace {

StoredAs stored_as(OIIO::TypeDesc format) {
    switch (format.basetype) {
        case OIIO::TypeDesc::UINT8:
            return StoredAs::UInt8;
        case OIIO::TypeDesc::UINT16:
            return StoredAs::UInt16;
        case OIIO::TypeDesc::HALF:
            return StoredAs::Half;
        default:
            return format.is_floating_point() ? StoredAs::OtherFloat : StoredAs::OtherInteger;
    }
}

LevelSpec level_of(const OIIO::ImageSpec& spec) {
    LevelSpec level;
    level.x = spec.x;
    level.y = spec.y;
    level.width = spec.width;
    level.height = spec.height;
    level.full_x = spec.full_x;
    level.full_y = spec.full_y;
    level.full_width = spec.full_width;
    level.full_height = spec.full_height;
    level.tile_width = spec.tile_width;
    level.tile_height = spec.tile_height;
    level.channels = spec.nchannels;
    level.stored = stored_as(spec.format);
    const bool is_flat =
        spec.depth <= 1 && spec.full_depth <= 1 && spec.tile_depth <= 1 && !spec.deep;
    level.is_flat = is_flat ? 1 : 0;
    return level;
}

SourceSpec said_by(const OIIO::ImageSpec& spec) {
    SourceSpec said;
    said.color_space = spec.get_string_attribute("oiio:ColorSpace");
    said.wrap_modes = spec.get_string_attribute("wrapmodes");
    said.wrap_s = spec.get_string_attribute("wrapS");
    said.wrap_t = spec.get_string_attribute("wrapT");
    said.texture_format = spec.get_string_attribute("textureformat");
    said.rows_per_strip = spec.get_int_attribute("tiff:RowsPerStrip");
    return said;
}

/// With alpha left unassociated, as UsdUVTexture reads it.
OIIO::ImageSpec texture_configuration() {
    OIIO::ImageSpec config;
    config.attribute("oiio:UnassociatedAlpha", 1);
    return config;
}

Result<AssetImage> open_image(const std::string& asset, ImageUse use) {
    const OIIO::ImageSpec config = texture_configuration();
    return open_asset_image(asset, use == ImageUse::Texture ? &config : nullptr);
}

Error unread(const std::string& why) {
    return {"image-read", one_line(why)};
}

class FileImage final : public SourceImage {
  public:
    FileImage(std::string asset, ImageUse use, AssetImage image)
        : asset_(std::move(asset)), use_(use), image_(std::move(image)) {
        spec_ = said_by((*image_)->spec());
        spec_.levels.push_back(level_of((*image_)->spec()));
        if (use_ == ImageUse::Texture) add_coarser_levels();
    }

    const SourceSpec& spec() const override { return spec_; }

    Result<void> read_lines(
        int level, int y, int y_end, int channels, std::span<float> values) override {
        try {
            if (const Result<void> reached = reach_line(level, y); !reached) return reached;
            next_line_ = y_end;
            OIIO::ImageInput& input = **image_;
            const LevelSpec& in = spec_.levels.at(size_t(level));
            // OpenImageIO says nothing of damage in a TIFF file that it decodes several lines of at
            // once
            const bool is_tiff = std::string_view(input.format_name()) == "tiff";
            if (is_tiff && in.tile_width == 0)
                return read_one_by_one(level, y, y_end, channels, values);
            const bool is_read =
                in.tile_width > 0 ? input.read_tiles(0, level, in.x, in.x + in.width, y, y_end, 0,
                                                     1, 0, channels, OIIO::TypeFloat, values.data())
                                  : input.read_scanlines(0, level, y, y_end, 0, 0, channels,
                                                         OIIO::TypeFloat, values.data());
            if (!is_read) return unread(input.geterror());
            return {};
        } catch (const std::bad_alloc&) {
            throw;
        } catch (const std::exception& e) {
            return unread(e.what());
        }
    }

    Result<void> read_tile(
        int level, int x, int y, int channels, std::span<float> values) override {
        try {
            OIIO::ImageInput& input = **image_;
            const LevelSpec& in = spec_.levels.at(size_t(level));
            // Tiles reach beyond the border: the rows that are left out keep the stride of a whole
            // one
            const int x_end = std::min(x + in.tile_width, in.x + in.width);
            const int y_end = std::min(y + in.tile_height, in.y + in.height);
            const OIIO::stride_t pixel = OIIO::stride_t(sizeof(float)) * channels;
            std::fill(values.begin(), values.end(), 0.0f);
            if (input.read_tiles(0, level, x, x_end, y, y_end, 0, 1, 0, channels, OIIO::TypeFloat,
                                 values.data(), pixel, pixel * in.tile_width))
                return {};
            return unread(input.geterror());
        } catch (const std::bad_alloc&) {
            throw;
        } catch (const std::exception& e) {
            return unread(e.what());
        }
    }

  private:
    void add_coarser_levels() {
        OIIO::ImageInput& input = **image_;
        while (spec_.levels.size() < SourceSpec::max_levels &&
               input.seek_subimage(0, int(spec_.levels.size())))
            spec_.levels.push_back(level_of(input.spec()));
        // Of the one that is not there
        input.geterror();
        input.seek_subimage(0, 0);
    }

    Result<void> read_one_by_one(
        int level, int y, int y_end, int channels, std::span<float> values) {
        OIIO::ImageInput& input = **image_;
        const LevelSpec& in = spec_.levels.at(size_t(level));
        if (!input.seek_subimage(0, level)) return unread(input.geterror());
        // The call for some of the channels takes memory for as many lines as the file says to
        // be compressed together, and 64 MB at least
        const size_t taken = size_t(channels), there = size_t(in.channels),
                     width = size_t(in.width);
        std::vector<float> line(width * there);
        for (int at = y; at < y_end; ++at) {
            if (!input.read_scanline(at, 0, OIIO::TypeFloat, line.data()))
                return unread(input.geterror());
            float* const to = values.data() + size_t(at - y) * width * taken;
            for (size_t x = 0; x < width; ++x)
                std::copy_n(line.data() + x * there, taken, to + x * taken);
        }
        return {};
    }

    /// Makes line y one that can be read. Formats that go back to an earlier line by opening their
    /// file again cannot do so in a package.
    Result<void> reach_line(int level, int y) {
        const bool is_forward = level == level_ && y >= next_line_;
        level_ = level;
        if (is_forward || !image_->is_packaged()) return {};
        Result<AssetImage> again = open_image(asset_, use_);
        if (!again) return again.error();
        if (level_of((*again)->spec()) != spec_.levels[0])
            return unread("the file has changed since it was opened");
        // The one that was open reads from what it owns: it goes first
        image_.reset();
        image_ = std::move(*again);
        return {};
    }

    std::string asset_;
    ImageUse use_;
    std::optional<AssetImage> image_;
    SourceSpec spec_;
    int level_ = 0;
    int next_line_ = std::numeric_limits<int>::min();  ///< no line before was read after it
};

}  // namespace

Result<std::unique_ptr<SourceImage>> FileSource::open(const std::string& asset, ImageUse use) {
    try {
        Result<AssetImage> image = open_image(asset, use);
        if (!image) return image.error();
        return std::unique_ptr<SourceImage>(new FileImage(asset, use, std::move(*image)));
    } catch (const std::bad_alloc&) {
        throw;
    } catch (const std::exception& e) {
        return Error{"image-open", one_line(e.what())};
    }
}

}  // namespace velatura::plugins::openimageio
