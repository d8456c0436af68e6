// SPDX-License-Identifier: Apache-2.0
#include "base/exr_headers.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <optional>
#include <streambuf>
#include <string>
#include <utility>

namespace velatura {

namespace {

/// Bytes of the types that have as many always. Ref: OpenEXR, "File Layout", "Predefined Attribute
/// Types".
constexpr std::pair<std::string_view, uint32_t> sizes[] = {{"box2f", 16},
                                                           {"box2i", 16},
                                                           {"chromaticities", 32},
                                                           {"compression", 1},
                                                           {"deepImageState", 1},
                                                           {"double", 8},
                                                           {"envmap", 1},
                                                           {"float", 4},
                                                           {"int", 4},
                                                           {"keycode", 28},
                                                           {"lineOrder", 1},
                                                           {"m33d", 72},
                                                           {"m33f", 36},
                                                           {"m44d", 128},
                                                           {"m44f", 64},
                                                           {"rational", 8},
                                                           {"tiledesc", 9},
                                                           {"timecode", 8},
                                                           {"v2d", 16},
                                                           {"v2f", 8},
                                                           {"v2i", 8},
                                                           {"v3d", 24},
                                                           {"v3f", 12},
                                                           {"v3i", 12}};

/// Whether OpenEXR reads as many bytes of a value of this type, or refuses others.
bool is_size_of(std::string_view type, uint32_t bytes) {
    for (const auto& [name, size] : sizes)
        if (type == name) return bytes == size;
    return type != "floatvector" || bytes % 4 == 0;
}

/// What a header says of the pixels of its part.
struct Pixels {
    uint64_t bytes_of_one = 0;
    uint64_t width = 0, height = 0;            ///< of the data window
    uint64_t tile_width = 0, tile_height = 0;  ///< each below 2^32
    uint64_t lines = 1;                        ///< compressed together
    bool has_tiles = false;

    /// Bytes of the lines, or of the tile, that OpenEXR holds decompressed. At most 2^60, which is
    /// too much as well.
    uint64_t bytes_of_chunk() const {
        const uint64_t pixels = has_tiles ? tile_width * tile_height : width * lines;
        return std::min(bytes_of_one, uint64_t(1) << 20) * std::min(pixels, uint64_t(1) << 40);
    }
};

class HeaderWalk {
  public:
    HeaderWalk(std::istream& file, uint64_t file_bytes, int version)
        : file_(file), size_(file_bytes), excess_of_ids_(version < 302 ? 4 : 0) {}

    /// Whether it begins as OpenEXR files do: magic number, version, then headers of a part each.
    bool start() {
        constexpr char multipart = 0x10, tiled = 0x02;
        std::array<char, 8> head = {};
        if (!file_.read(head.data(), head.size())) return false;
        has_parts_ = (head[5] & multipart) != 0;
        has_tiles_ = (head[5] & tiled) != 0;
        return std::string_view(head.data(), 4) == "\x76\x2f\x31\x01";
    }

    /// Passes over the headers of all parts, where an empty one ends those of several. What is
    /// wrong with them, or nothing.
    std::string fault() {
        for (int part = 1;; ++part) {
            const std::optional<int> attributes = pass_header();
            if (!attributes)
                return "its headers are damaged: an attribute is longer than the file, or than its "
                       "type";
            if (is_too_much(pixels_.bytes_of_chunk())) return too_much(part);
            if (*attributes == 0 || !has_parts_) return {};
        }
    }

  private:
    bool is_too_much(uint64_t bytes) const {
        return bytes > uint64_t(64) << 20 && bytes / 16384 > size_;
    }

    std::string too_much(int part) const {
        const bool is_tile = pixels_.has_tiles;
        return fmt::format("{} bytes cannot hold {}{}×{} pixels of part {}", size_,
                           is_tile ? "a tile of " : "",
                           is_tile ? pixels_.tile_width : pixels_.width,
                           is_tile ? pixels_.tile_height : pixels_.height, part);
    }

    /// The number of its attributes: name, type, size and value, ended by an empty name.
    std::optional<int> pass_header() {
        pixels_ = {};
        pixels_.has_tiles = has_tiles_;
        for (int count = 0;; ++count) {
            if (!pass_name()) return std::nullopt;
            if (name().empty()) return count;
            const std::string attribute(name());
            if (!pass_name() || !pass_value(attribute, name())) return std::nullopt;
        }
    }

    bool pass_name() {
        return bool(file_.getline(name_.data(), std::streamsize(name_.size()), '\0'));
    }

    std::string_view name() const { return name_.data(); }

    bool pass_value(std::string_view attribute, std::string_view type) {
        std::array<char, 4> bytes = {};
        if (!file_.read(bytes.data(), bytes.size())) return false;
        uint32_t size = 0;
        std::memcpy(&size, bytes.data(), sizeof size);
        if (size > max_bytes || size > size_ - uint64_t(file_.tellg())) return false;
        if (type == "chlist") return pass_channels(size);
        if (!is_size_of(type, size)) return false;
        if (type == "box2i" && attribute == "dataWindow") return pass_window();
        if (type == "compression") return pass_compression();
        if (type == "tiledesc" && attribute == "tiles") return pass_tile();
        if (type == "string" && attribute == "type") return pass_type(size);
        return pass(type == "idmanifest" ? size + excess_of_ids_ : size);
    }

    bool pass_window() {
        std::array<int32_t, 4> corners = {};
        if (!read(corners)) return false;
        const auto side = [](int32_t low, int32_t high) {
            return uint64_t(std::max<int64_t>(int64_t(high) - low + 1, 0));
        };
        pixels_.width = side(corners[0], corners[2]);
        pixels_.height = side(corners[1], corners[3]);
        return true;
    }

    bool pass_compression() {
        std::array<uint8_t, 1> kind = {};
        if (!read(kind)) return false;
        pixels_.lines = uint64_t(exr_lines_per_chunk(kind[0]));
        return true;
    }

    bool pass_tile() {
        std::array<uint32_t, 2> sides = {};
        if (!read(sides)) return false;
        pixels_.tile_width = sides[0];
        pixels_.tile_height = sides[1];
        return pass(1);
    }

    /// Of a part, beside which the flag of a file with one part counts for nothing.
    bool pass_type(uint32_t size) {
        std::array<char, 16> type = {};
        const auto taken = std::min<uint32_t>(size, type.size());
        if (!file_.read(type.data(), std::streamsize(taken))) return false;
        const std::string_view said(type.data(), taken);
        pixels_.has_tiles = said == "tiledimage" || said == "deeptile";
        return pass(size - taken);
    }

    template <class Values>
    bool read(Values& values) {
        return bool(
            file_.read(reinterpret_cast<char*>(values.data()), std::streamsize(sizeof values)));
    }

    /// Names, each with 16 bytes, ended by an empty one, where the value has to end, too.
    bool pass_channels(uint32_t size) {
        const auto end = file_.tellg() + std::streamoff(size);
        while (pass_name()) {
            if (name().empty()) return file_.tellg() == end;
            std::array<uint32_t, 4> channel = {};  // type, pLinear, xSampling, ySampling
            if (!read(channel)) return false;
            constexpr uint32_t half = 1;
            pixels_.bytes_of_one += channel[0] == half ? 2 : 4;
        }
        return false;
    }

    bool pass(uint32_t bytes) { return bool(file_.seekg(std::streamoff(bytes), std::ios::cur)); }

    /// OpenEXR counts by int.
    static constexpr uint32_t max_bytes = 0x7fffffff;

    std::istream& file_;
    uint64_t size_;
    uint32_t
        excess_of_ids_;  ///< bytes of a list of names for ids that OpenEXR reads beyond its size
    bool has_parts_ = false, has_tiles_ = false;
    Pixels pixels_;
    std::array<char, 255> name_ = {};  ///< OpenEXR is at odds with itself about longer ones
};

/// Bytes of others as a stream.
class ViewBuffer final : public std::streambuf {
  public:
    explicit ViewBuffer(std::string_view bytes) {
        // Nothing is ever written: there is no put area
        char* const begin = const_cast<char*>(bytes.data());
        setg(begin, begin, begin + bytes.size());
    }

  protected:
    pos_type seekoff(off_type offset,
                     std::ios_base::seekdir from,
                     std::ios_base::openmode) override {
        const off_type base = from == std::ios_base::cur   ? gptr() - eback()
                              : from == std::ios_base::end ? egptr() - eback()
                                                           : 0;
        return seekpos(base + offset, std::ios_base::in);
    }

    pos_type seekpos(pos_type position, std::ios_base::openmode) override {
        const off_type at = position;
        if (at < 0 || at > egptr() - eback()) return pos_type(off_type(-1));
        setg(eback(), eback() + at, egptr());
        return position;
    }
};

}  // namespace

int exr_lines_per_chunk(uint32_t compression) {
    constexpr std::array<int, 10> lines = {1, 1, 1, 16, 32, 16, 32, 32, 32, 256};
    return lines[std::min<size_t>(compression, lines.size() - 1)];
}

std::string exr_header_error(std::istream& file, uint64_t file_bytes, int version) {
    HeaderWalk walk(file, file_bytes, version);
    return walk.start() ? walk.fault() : std::string();
}

std::string exr_header_error(std::string_view file, int version) {
    ViewBuffer buffer(file);
    std::istream stream(&buffer);
    return exr_header_error(stream, file.size(), version);
}

}  // namespace velatura
