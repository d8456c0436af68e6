// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace velatura::testing {

/// One file for stored_zip(), with what a broken archive may say of it.
struct ZipEntry {
    std::string name;
    std::string data;
    uint16_t method = 0;
    uint16_t flags = 0;
};

inline void append_u16(std::string& out, size_t v) {
    out += char(v & 0xff);
    out += char(v >> 8 & 0xff);
}

inline void append_u32(std::string& out, size_t v) {
    append_u16(out, v & 0xffff);
    append_u16(out, v >> 16);
}

/// A zip archive of stored files, written by hand from PKWARE's APPNOTE 6.3.9, 4.3: headers and
/// data, central directory, end record with a comment. `alignment`: of the data, by extra fields.
inline std::string stored_zip(const std::vector<ZipEntry>& entries,
                              size_t alignment = 64,
                              const std::string& comment = {}) {
    std::string out;
    std::string directory;
    const auto common = [](std::string& to, const ZipEntry& e) {
        append_u16(to, 20);
        append_u16(to, e.flags);
        append_u16(to, e.method);
        append_u32(to, 0);  // time and date
        append_u32(to, 0);  // checksum
        append_u32(to, e.data.size());
        append_u32(to, e.data.size());
        append_u16(to, e.name.size());
    };
    for (const ZipEntry& e : entries) {
        const size_t header = out.size();
        const size_t unpadded = header + 30 + e.name.size();
        size_t padding = (alignment - unpadded % alignment) % alignment;
        // An extra field has four bytes at least
        if (padding != 0 && padding < 4) padding += alignment;
        out += "PK\x03\x04";
        common(out, e);
        append_u16(out, padding);
        out += e.name;
        if (padding != 0) {
            append_u16(out, 0x1986);
            append_u16(out, padding - 4);
            out.append(padding - 4, '\0');
        }
        out += e.data;
        directory += "PK\x01\x02";
        append_u16(directory, 20);
        common(directory, e);
        append_u16(directory, 0);
        append_u16(directory, 0);
        append_u32(directory, 0);  // disk, internal attributes
        append_u32(directory, 0);  // external attributes
        append_u32(directory, header);
        directory += e.name;
    }
    const size_t start = out.size();
    out += directory + "PK\x05\x06";
    append_u32(out, 0);
    append_u16(out, entries.size());
    append_u16(out, entries.size());
    append_u32(out, directory.size());
    append_u32(out, start);
    append_u16(out, comment.size());
    return out + comment;
}

}  // namespace velatura::testing
