// SPDX-License-Identifier: Apache-2.0
#include "image/exr_size.h"

#include "image/exr_header.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfTileDescription.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string_view>

namespace velatura::image {

namespace {

/// Deflate makes at most 1032 bytes of one (zlib technical details).
constexpr uint64_t deflate = 1032;
/// OpenEXR's run lengths take two bytes for up to 128.
constexpr uint64_t run_lengths = 64;

int scanlines_per_chunk(Imf::Compression compression) {
    switch (compression) {
        case Imf::NO_COMPRESSION:
        case Imf::RLE_COMPRESSION:
        case Imf::ZIPS_COMPRESSION:
            return 1;
        case Imf::ZIP_COMPRESSION:
        case Imf::PXR24_COMPRESSION:
            return 16;
        case Imf::DWAB_COMPRESSION:
            return 256;
        default:
            return 32;
    }
}

uint64_t pixel_bytes_of(const Imf::Header& header) {
    if (Imf::isDeepData(header.type())) return sizeof(uint32_t);
    uint64_t bytes = 0;
    for (auto c = header.channels().begin(); c != header.channels().end(); ++c)
        bytes += c.channel().type == Imf::HALF ? 2 : 4;
    return bytes;
}

uint64_t rounded_up_quotient(uint64_t a, uint64_t b) {
    return (a + b - 1) / b;
}

/// As far as its headers.
class HeaderWalk {
  public:
    explicit HeaderWalk(const std::string& path) : file_(path, std::ios::binary) {
        std::error_code none;
        size_ = std::filesystem::file_size(path, none);
    }

    /// Whether it begins as OpenEXR files do. Ref: OpenEXR, "File Layout": magic number, version, headers of a part each.
    bool start() {
        constexpr char multipart = 0x10;
        std::array<char, 8> head = {};
        if (!file_.read(head.data(), head.size())) return false;
        has_parts_ = (head[5] & multipart) != 0;
        return std::string_view(head.data(), 4) == "\x76\x2f\x31\x01";
    }

    /// Passes over the headers of all parts, where an empty one ends those of several. False where something ends behind the file.
    bool pass_headers() {
        for (;;) {
            const auto count = pass_header();
            if (!count || *count == 0 || !has_parts_) return count.has_value();
        }
    }

  private:
    /// The number of its attributes: name, type, size and value, ended by an empty name.
    std::optional<int> pass_header() {
        for (int count = 0;; ++count) {
            if (!pass_name()) return std::nullopt;
            if (name_[0] == '\0') return count;
            if (!pass_name() || !pass_value()) return std::nullopt;
        }
    }

    bool pass_name() { return bool(file_.getline(name_.data(), std::streamsize(name_.size()), '\0')); }

    bool pass_value() {
        std::array<char, 4> bytes = {};
        if (!file_.read(bytes.data(), bytes.size())) return false;
        uint32_t value_bytes = 0;
        std::memcpy(&value_bytes, bytes.data(), sizeof value_bytes);
        if (value_bytes > size_ - uint64_t(file_.tellg())) return false;
        return bool(file_.seekg(value_bytes, std::ios::cur));
    }

    std::ifstream file_;
    uint64_t size_ = 0;
    bool has_parts_ = false;
    std::array<char, 257> name_ = {};  ///< OpenEXR reads no longer ones than of 255 letters
};

}  // namespace

int rows_per_chunk_of(const Imf::Header& header) {
    const int height = window_of(header.dataWindow()).height();
    // A part of scanlines may have any attribute `tiles`: nothing checks what it says
    if (Imf::isTiled(header.type())) return int(std::min(header.tileDescription().ySize, uint32_t(height)));
    return scanlines_per_chunk(header.compression());
}

uint64_t most_expansion(const Imf::Header& header) {
    switch (header.compression()) {
        case Imf::NO_COMPRESSION:
            return 1;
        case Imf::RLE_COMPRESSION:
            return run_lengths;
        case Imf::ZIP_COMPRESSION:
        case Imf::ZIPS_COMPRESSION:
            return deflate;
        case Imf::PXR24_COMPRESSION:
            // Three bytes of four, deflated
            return deflate * 4 / 3;
        case Imf::PIZ_COMPRESSION:
            // Huffman codes of at least one bit, and eight for how often 16 bits come again, up to 255 times: 4080 bits of nine
            return 4080 / 9 + 1;
        case Imf::B44_COMPRESSION:
        case Imf::B44A_COMPRESSION:
            // Three bytes for 16 halves that are all the same
            return 32 / 3 + 1;
        default:
            // DWA: an alpha's runs, deflated; blocks of 64 floats in two halves, deflated, come to the same
            return run_lengths * deflate;
    }
}

uint64_t least_bytes_of(const Imf::Header& header) {
    const Window w = window_of(header.dataWindow());
    uint64_t chunks = rounded_up_quotient(uint64_t(w.height()), uint64_t(rows_per_chunk_of(header)));
    if (Imf::isTiled(header.type())) chunks *= rounded_up_quotient(uint64_t(w.width()), header.tileDescription().xSize);
    // Eight bytes for a chunk's place, eight before its data
    return 16 * chunks + uint64_t(w.pixel_count()) * pixel_bytes_of(header) / most_expansion(header);
}

Result<void> check_attributes(const std::string& path) {
    HeaderWalk walk(path);
    if (walk.start() && !walk.pass_headers()) return Error{"io-open", fmt::format("cannot open {}: its headers are longer than the file", path)};
    return {};
}

}  // namespace velatura::image
