// SPDX-License-Identifier: Apache-2.0
#include "image/exr_size.h"

#include "base/exr_headers.h"
#include "image/exr_header.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfTileDescription.h>
#include <OpenEXR/OpenEXRConfig.h>
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

namespace velatura::image {

namespace {

/// Deflate makes at most 1032 bytes of one (zlib technical details).
constexpr uint64_t deflate = 1032;
/// OpenEXR's run lengths take two bytes for up to 128.
constexpr uint64_t run_lengths = 64;

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

}  // namespace

int rows_per_chunk_of(const Imf::Header& header) {
    const int height = window_of(header.dataWindow()).height();
    // A part of scanlines may have any attribute `tiles`: nothing checks what it says
    if (Imf::isTiled(header.type()))
        return int(std::min(header.tileDescription().ySize, uint32_t(height)));
    return exr_lines_per_chunk(uint32_t(header.compression()));
}

uint64_t max_expansion(const Imf::Header& header) {
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
            // Huffman codes of at least one bit, and eight for how often 16 bits come again, up to
            // 255 times: 4080 bits of nine
            return 4080 / 9 + 1;
        case Imf::B44_COMPRESSION:
        case Imf::B44A_COMPRESSION:
            // Three bytes for 16 halves that are all the same
            return 32 / 3 + 1;
        default:
            // DWA: an alpha's runs, deflated; blocks of 64 floats in two halves, deflated, come to
            // the same
            return run_lengths * deflate;
    }
}

uint64_t min_bytes_of(const Imf::Header& header) {
    const Window w = window_of(header.dataWindow());
    uint64_t chunks =
        rounded_up_quotient(uint64_t(w.height()), uint64_t(rows_per_chunk_of(header)));
    if (Imf::isTiled(header.type()))
        chunks *= rounded_up_quotient(uint64_t(w.width()), header.tileDescription().xSize);
    // Eight bytes for a chunk's place, eight before its data
    return 16 * chunks + uint64_t(w.pixel_count()) * pixel_bytes_of(header) / max_expansion(header);
}

Result<void> check_headers(const std::string& path) {
    constexpr int version = 100 * OPENEXR_VERSION_MAJOR + OPENEXR_VERSION_MINOR;
    std::ifstream file(path, std::ios::binary);
    std::error_code none;
    const std::string fault =
        exr_header_error(file, std::filesystem::file_size(path, none), version);
    if (fault.empty()) return {};
    return Error{"io-open", fmt::format("cannot open {}: {}", path, fault)};
}

}  // namespace velatura::image
