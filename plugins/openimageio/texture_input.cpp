// SPDX-License-Identifier: Apache-2.0
#include "plugins/openimageio/texture_input.h"

#include <array>
#include <cmath>

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

}  // namespace

float srgb_to_linear(float encoded) {
    const double x = std::abs(double(encoded));
    const double linear = x <= 0.04045 ? x / 12.92 : std::pow((x + 0.055) / 1.055, 2.4);
    return float(std::copysign(linear, double(encoded)));
}

OIIO::ImageSpec TextureInput::configuration(const std::string& file, bool is_srgb) {
    OIIO::ImageSpec config;
    config.attribute("velatura:file", file);
    config.attribute("velatura:srgb", is_srgb ? 1 : 0);
    return config;
}

OIIO::ImageSpec TextureInput::file_configuration() {
    OIIO::ImageSpec config;
    config.attribute("oiio:UnassociatedAlpha", 1);
    return config;
}

OIIO::TypeDesc TextureInput::stored_format(OIIO::TypeDesc file_format, bool is_srgb) {
    switch (file_format.basetype) {
        // 11 bits of mantissa hold a decoded 8-bit code to 2.5e-4 of its value
        case OIIO::TypeDesc::UINT8:
            return is_srgb ? OIIO::TypeHalf : OIIO::TypeUInt8;
        case OIIO::TypeDesc::UINT16:
            return is_srgb ? OIIO::TypeFloat : OIIO::TypeUInt16;
        case OIIO::TypeDesc::HALF:
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
    path_ = std::string(config.get_string_attribute("velatura:file"));
    is_srgb_ = config.get_int_attribute("velatura:srgb") != 0;
    if (!open_file()) return false;
    adopt_spec();
    spec = m_spec;
    return true;
}

bool TextureInput::open_file() {
    const OIIO::ImageSpec file_config = file_configuration();
    Result<AssetImage> opened = open_asset_image(path_, &file_config);
    if (!opened) {
        errorfmt("{}", opened.error().message);
        return false;
    }
    file_.reset();
    file_ = std::move(*opened);
    next_line_ = 0;
    return true;
}

bool TextureInput::reach_line(int subimage, int miplevel, int y) {
    const bool is_forward = seek_subimage(subimage, miplevel) && y >= next_line_;
    if (!is_forward && file_ && file_->is_packaged()) {
        if (!open_file()) return false;
    }
    if (!seek_subimage(subimage, miplevel)) return false;
    next_line_ = y + 1;
    return true;
}

bool TextureInput::close() {
    if (!file_) return true;
    const bool ok = (*file_)->close();
    file_.reset();
    return ok;
}

int TextureInput::current_subimage() const {
    return file_ ? (*file_)->current_subimage() : -1;
}

int TextureInput::current_miplevel() const {
    return file_ ? (*file_)->current_miplevel() : -1;
}

bool TextureInput::seek_subimage(int subimage, int miplevel) {
    lock_guard lock(*this);
    if (!file_) return false;
    if (!(*file_)->seek_subimage(subimage, miplevel)) return false;
    adopt_spec();
    return true;
}

void TextureInput::adopt_spec() {
    m_spec = (*file_)->spec();
    channels_ = m_spec.nchannels;
    is_8_bit_ = m_spec.format == OIIO::TypeUInt8;
    m_spec.nchannels = 4;
    m_spec.channelformats.clear();
    m_spec.channelnames = {"R", "G", "B", "A"};
    m_spec.alpha_channel = 3;
    m_spec.z_channel = -1;
    m_spec.set_format(stored_format(m_spec.format, is_srgb_));
    // Two decodings of one file share its fingerprint; it must not make the cache take them for
    // duplicates
    m_spec.erase_attribute("oiio:SHA-1");
}

bool TextureInput::read_native_scanline(int subimage, int miplevel, int y, int z, void* data) {
    lock_guard lock(*this);
    if (!reach_line(subimage, miplevel, y)) return false;
    const size_t count = size_t(m_spec.width);
    std::vector<float> texels(count * size_t(channels_));
    if (!(*file_)->read_scanlines(subimage, miplevel, y, y + 1, z, 0, channels_, OIIO::TypeFloat,
                                  texels.data())) {
        errorfmt("{}", (*file_)->geterror());
        return false;
    }
    convert(texels, count, data);
    return true;
}

bool TextureInput::read_native_tile(int subimage, int miplevel, int x, int y, int z, void* data) {
    lock_guard lock(*this);
    if (!seek_subimage(subimage, miplevel)) return false;
    const size_t count = size_t(m_spec.tile_pixels());
    std::vector<float> texels(count * size_t(channels_));
    // read_tiles clips at the border of the image; the rows it leaves out keep the stride of a
    // whole tile
    const int x_end = std::min(x + m_spec.tile_width, m_spec.x + m_spec.width);
    const int y_end = std::min(y + m_spec.tile_height, m_spec.y + m_spec.height);
    const OIIO::stride_t pixel = OIIO::stride_t(sizeof(float)) * channels_;
    if (!(*file_)->read_tiles(subimage, miplevel, x, x_end, y, y_end, z, z + 1, 0, channels_,
                              OIIO::TypeFloat, texels.data(), pixel, pixel * m_spec.tile_width)) {
        errorfmt("{}", (*file_)->geterror());
        return false;
    }
    convert(texels, count, data);
    return true;
}

float TextureInput::decoded(float value) const {
    if (!std::isfinite(value)) return 0.0f;
    if (!is_srgb_) return value;
    if (is_8_bit_) return srgb_table()[size_t(std::lround(std::clamp(value, 0.0f, 1.0f) * 255.0f))];
    return srgb_to_linear(value);
}

void TextureInput::convert(const std::vector<float>& texels, size_t count, void* data) const {
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
