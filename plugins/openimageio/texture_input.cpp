// SPDX-License-Identifier: Apache-2.0
#include "plugins/openimageio/texture_input.h"

#include "plugins/openimageio/sandbox/messages.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace velatura::plugins::openimageio {

namespace {

const std::array<float, 256>& srgb_table() {
    static const std::array<float, 256> table = [] {
        std::array<float, 256> t{};
        for (int i = 0; i < 256; ++i) t[size_t(i)] = srgb_to_linear(float(i) / 255.0f);
        return t;
    }();
    return table;
}

bool has_sane_measures(const LevelSpec& level, bool is_tiled, int max_side) {
    constexpr int max_offset = 1 << 30;
    const auto is_side = [max_side](int side) { return side >= 1 && side <= max_side; };
    const auto is_offset = [](int offset) { return offset >= -max_offset && offset <= max_offset; };
    const auto is_tile_side = [&](int side) {
        return is_tiled ? side >= 1 && side <= 2 * max_side : side == 0;
    };
    return is_side(level.width) && is_side(level.height) && is_side(level.full_width) &&
           is_side(level.full_height) && is_offset(level.x) && is_offset(level.y) &&
           is_offset(level.full_x) && is_offset(level.full_y) && is_tile_side(level.tile_width) &&
           is_tile_side(level.tile_height) && level.channels >= 1 && level.is_flat == 1;
}

}  // namespace

float srgb_to_linear(float encoded) {
    const double x = std::abs(double(encoded));
    const double linear = x <= 0.04045 ? x / 12.92 : std::pow((x + 0.055) / 1.055, 2.4);
    return float(std::copysign(linear, double(encoded)));
}

Result<void> check_texture(const SourceSpec& spec, int max_side) {
    const LevelSpec& finest = spec.levels.at(0);
    const auto reject = [](const std::string& why) { return Error{"image-open", why}; };
    if (finest.width < 1 || finest.height < 1 || finest.channels < 1 || finest.is_flat != 1)
        return reject("not a flat image with at least one pixel");
    if (finest.width > max_side || finest.height > max_side)
        return reject(fmt::format(
            "found {} x {} pixels, expected at most {} along a side (--limit image-side)",
            finest.width, finest.height, max_side));
    if (!has_sane_tiles(finest))
        return reject(
            fmt::format("found tiles of {} x {} pixels, expected tiles no larger than the image",
                        finest.tile_width, finest.tile_height));
    const bool is_tiled = finest.tile_width > 0;
    for (const LevelSpec& level : spec.levels) {
        if (!has_sane_measures(level, is_tiled, max_side))
            return reject(
                fmt::format("one of its levels has no pixels, a window of more than {} along a "
                            "side, or other tiles than the first",
                            max_side));
    }
    return {};
}

OIIO::ImageSpec TextureInput::configuration(ImageSource& source,
                                            const std::string& file,
                                            bool is_srgb,
                                            int max_side) {
    ImageSource* const pointer = &source;
    OIIO::ImageSpec config;
    config.attribute("velatura:source", OIIO::TypeDesc::PTR, &pointer);
    config.attribute("velatura:file", file);
    config.attribute("velatura:srgb", is_srgb ? 1 : 0);
    config.attribute("velatura:max_side", max_side);
    return config;
}

OIIO::TypeDesc TextureInput::cached_format(StoredAs stored, bool is_srgb) {
    switch (stored) {
        // 11 bits of mantissa hold a decoded 8-bit code to 2.5e-4 of its value
        case StoredAs::UInt8:
            return is_srgb ? OIIO::TypeHalf : OIIO::TypeUInt8;
        case StoredAs::UInt16:
            return is_srgb ? OIIO::TypeFloat : OIIO::TypeUInt16;
        case StoredAs::Half:
            return is_srgb ? OIIO::TypeFloat : OIIO::TypeHalf;
        default:
            return OIIO::TypeFloat;
    }
}

bool TextureInput::open(const std::string& name, OIIO::ImageSpec&) {
    errorfmt("{}: opened without configuration", name);
    return false;
}

bool TextureInput::open(const std::string&, OIIO::ImageSpec& spec, const OIIO::ImageSpec& config) {
    const OIIO::ParamValue* const source =
        config.find_attribute("velatura:source", OIIO::TypeDesc::PTR);
    if (source == nullptr) return false;
    is_srgb_ = config.get_int_attribute("velatura:srgb") != 0;
    Result<std::unique_ptr<SourceImage>> opened =
        (*static_cast<ImageSource* const*>(source->data()))
            ->open(std::string(config.get_string_attribute("velatura:file")), ImageUse::Texture);
    if (!opened) return reject(opened.error());
    // What a file says now may not be what it said when it was examined
    const Result<void> checked =
        check_texture((*opened)->spec(), config.get_int_attribute("velatura:max_side"));
    if (!checked) return reject(checked.error());
    image_ = std::move(*opened);
    adopt_level(0);
    spec = m_spec;
    return true;
}

bool TextureInput::reject(const Error& error) {
    errorfmt("{}", error.message);
    return false;
}

bool TextureInput::close() {
    lock_guard lock(*this);
    image_.reset();
    return true;
}

int TextureInput::current_subimage() const {
    return image_ ? 0 : -1;
}

int TextureInput::current_miplevel() const {
    return image_ ? level_ : -1;
}

bool TextureInput::seek_subimage(int subimage, int miplevel) {
    lock_guard lock(*this);
    if (!image_ || subimage != 0 || miplevel < 0 ||
        size_t(miplevel) >= image_->spec().levels.size())
        return false;
    if (miplevel != level_) adopt_level(miplevel);
    return true;
}

void TextureInput::adopt_level(int index) {
    const SourceSpec& file = image_->spec();
    const LevelSpec& level = file.levels[size_t(index)];
    level_ = index;
    // More than those of RGBA are not looked at
    channels_ = std::min(level.channels, 4);
    is_8_bit_ = level.stored == StoredAs::UInt8;
    m_spec = OIIO::ImageSpec(level.width, level.height, 4, cached_format(level.stored, is_srgb_));
    m_spec.x = level.x;
    m_spec.y = level.y;
    m_spec.full_x = level.full_x;
    m_spec.full_y = level.full_y;
    m_spec.full_width = level.full_width;
    m_spec.full_height = level.full_height;
    m_spec.tile_width = level.tile_width;
    m_spec.tile_height = level.tile_height;
    // What the cache goes by, of all that the file says of itself
    if (!file.texture_format.empty()) m_spec.attribute("textureformat", file.texture_format);
    const int rows = std::min(file.rows_per_strip, level.height);
    if (rows > 0) m_spec.attribute("tiff:RowsPerStrip", rows);
}

bool TextureInput::read_native_scanline(int subimage, int miplevel, int y, int z, void* data) {
    return read_native_scanlines(subimage, miplevel, y, y + 1, z, data);
}

bool TextureInput::read_native_scanlines(
    int subimage, int miplevel, int ybegin, int yend, int, void* data) {
    lock_guard lock(*this);
    if (!seek_subimage(subimage, miplevel)) return false;
    const size_t width = size_t(m_spec.width), line = width * size_t(channels_);
    const int max = int(std::max<size_t>(1, piece_bytes / (line * sizeof(float))));
    std::vector<float> texels;
    char* to = static_cast<char*>(data);
    for (int y = ybegin; y < yend; y += max) {
        const int end = std::min(yend, y + max);
        texels.resize(size_t(end - y) * line);
        const Result<void> done = image_->read_lines(miplevel, y, end, channels_, texels);
        if (!done) return reject(done.error());
        convert(texels, size_t(end - y) * width, to);
        to += size_t(end - y) * m_spec.scanline_bytes(true);
    }
    return true;
}

bool TextureInput::read_native_tile(int subimage, int miplevel, int x, int y, int, void* data) {
    lock_guard lock(*this);
    if (!seek_subimage(subimage, miplevel)) return false;
    const size_t count = size_t(m_spec.tile_width) * size_t(m_spec.tile_height);
    std::vector<float> texels(count * size_t(channels_));
    const Result<void> done = image_->read_tile(miplevel, x, y, channels_, texels);
    if (!done) return reject(done.error());
    convert(texels, count, data);
    return true;
}

float TextureInput::decoded(float value) const {
    if (!std::isfinite(value)) return 0.0f;
    if (!is_srgb_) return value;
    if (is_8_bit_) return srgb_table()[size_t(std::lround(std::clamp(value, 0.0f, 1.0f) * 255.0f))];
    return srgb_to_linear(value);
}

void TextureInput::convert(std::span<const float> texels, size_t count, void* data) const {
    std::vector<float> rgba(count * 4);
    const size_t n = size_t(channels_);
    for (size_t i = 0; i < count; ++i) {
        const float* from = &texels[i * n];
        float* to = &rgba[i * 4];
        const bool is_gray = n < 3;
        for (size_t c = 0; c < 3; ++c) to[c] = decoded(from[is_gray ? 0 : c]);
        // Alpha is never encoded
        const size_t alpha = is_gray ? 1 : 3;
        to[3] = alpha < n ? (std::isfinite(from[alpha]) ? from[alpha] : 0.0f) : 1.0f;
    }
    OIIO::convert_types(OIIO::TypeFloat, rgba.data(), m_spec.format, data, int(count * 4));
}

}  // namespace velatura::plugins::openimageio
