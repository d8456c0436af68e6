// SPDX-License-Identifier: Apache-2.0
#include "base/zip_archive.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

namespace velatura {

namespace {

constexpr std::string_view local_signature = "PK\x03\x04";
constexpr std::string_view central_signature = "PK\x01\x02";
constexpr std::string_view end_signature = "PK\x05\x06";
constexpr std::string_view zip64_locator_signature = "PK\x06\x07";
constexpr size_t local_size = 30;
constexpr size_t central_size = 46;
constexpr size_t end_size = 22;
constexpr size_t zip64_locator_size = 20;
constexpr size_t max_comment = 0xffff;

constexpr uint16_t encrypted_flags = 1u << 0 | 1u << 6 | 1u << 13;

uint16_t u16(std::string_view bytes, size_t at) {
    const auto byte = [&](size_t i) { return uint32_t(static_cast<unsigned char>(bytes[at + i])); };
    return uint16_t(byte(0) | byte(1) << 8);
}

uint32_t u32(std::string_view bytes, size_t at) {
    return uint32_t(u16(bytes, at)) | uint32_t(u16(bytes, at + 2)) << 16;
}

/// Offset of the record that ends the archive: the last one whose comment ends with the file.
std::optional<size_t> find_end(std::string_view bytes) {
    if (bytes.size() < end_size) return std::nullopt;
    const size_t last = bytes.size() - end_size;
    const size_t first = last > max_comment ? last - max_comment : 0;
    for (size_t at = last + 1; at-- > first;) {
        if (bytes.substr(at).starts_with(end_signature) &&
            at + end_size + u16(bytes, at + 20) == bytes.size()) {
            return at;
        }
    }
    return std::nullopt;
}

}  // namespace

Error ZipArchive::malformed(const std::string& what) const {
    return {"zip-malformed", fmt::format("package \"{}\": {}", name_, what)};
}

Error ZipArchive::unsupported(const std::string& what) const {
    return {"zip-unsupported", fmt::format("package \"{}\": {}", name_, what)};
}

Result<std::shared_ptr<const ZipArchive>> ZipArchive::open(AssetBytesPtr bytes,
                                                           const std::string& name) {
    const std::shared_ptr<ZipArchive> archive(new ZipArchive(std::move(bytes), name));
    const Result<void> read = archive->read_directory();
    if (!read) return read.error();
    return std::shared_ptr<const ZipArchive>(archive);
}

Result<void> ZipArchive::read_directory() {
    const std::string_view bytes = bytes_->bytes();
    const std::optional<size_t> end = find_end(bytes);
    if (!end) {
        return malformed("found no end of central directory, expected a whole zip archive");
    }
    if (*end >= zip64_locator_size &&
        bytes.substr(*end - zip64_locator_size).starts_with(zip64_locator_signature)) {
        return unsupported("found a 64-bit zip archive, expected a 32-bit one");
    }
    const size_t count = u16(bytes, *end + 10);
    const size_t size = u32(bytes, *end + 12);
    const size_t directory = u32(bytes, *end + 16);
    if (count == 0xffff || size == 0xffffffff || directory == 0xffffffff) {
        return unsupported("found a 64-bit zip archive, expected a 32-bit one");
    }
    if (u16(bytes, *end + 4) != 0 || u16(bytes, *end + 6) != 0 || u16(bytes, *end + 8) != count) {
        return unsupported("found one part of a split zip archive, expected a whole one");
    }
    if (directory > *end || size > *end - directory || count > size / central_size) {
        return malformed(fmt::format(
            "found a central directory of {} bytes for {} files at offset {}, expected it to fit "
            "before offset {}",
            size, count, directory, *end));
    }
    members_.reserve(count);
    size_t at = directory;
    const size_t directory_end = directory + size;
    for (size_t i = 0; i < count; ++i) {
        if (directory_end - at < central_size || !bytes.substr(at).starts_with(central_signature)) {
            return malformed(
                fmt::format("found no entry {} of {} in the central directory", i + 1, count));
        }
        const size_t name_size = u16(bytes, at + 28);
        const size_t tail = name_size + u16(bytes, at + 30) + u16(bytes, at + 32);
        if (tail > directory_end - at - central_size) {
            return malformed(fmt::format("entry {} of the central directory is truncated", i + 1));
        }
        ZipMember member;
        member.name = bytes.substr(at + central_size, name_size);
        member.flags = u16(bytes, at + 8);
        member.method = u16(bytes, at + 10);
        member.stored_size = u32(bytes, at + 20);
        member.size = u32(bytes, at + 24);
        member.header = u32(bytes, at + 42);
        if (member.stored_size == 0xffffffff || member.size == 0xffffffff ||
            member.header == 0xffffffff) {
            return unsupported(fmt::format(
                "found 64-bit sizes of \"{}\", expected a 32-bit zip archive", member.name));
        }
        members_.push_back(member);
        at += central_size + tail;
    }
    return order_members(directory);
}

Result<void> ZipArchive::order_members(size_t directory) {
    std::stable_sort(members_.begin(), members_.end(),
                     [](const ZipMember& a, const ZipMember& b) { return a.header < b.header; });
    for (size_t i = 0; i < members_.size(); ++i) {
        ZipMember& m = members_[i];
        m.limit = i + 1 < members_.size() ? members_[i + 1].header : directory;
        const size_t needed = local_size + m.name.size() + size_t(m.stored_size);
        if (m.header > m.limit || needed > m.limit - m.header) {
            return malformed(fmt::format(
                "\"{}\" takes {} bytes at offset {}, expected it to end before offset {}", m.name,
                needed, m.header, m.limit));
        }
    }
    std::erase_if(members_, [](const ZipMember& m) { return m.name.ends_with('/'); });
    for (size_t i = 0; i < members_.size(); ++i) {
        if (!by_name_.emplace(members_[i].name, i).second) {
            return malformed(fmt::format("found \"{}\" twice, expected it once", members_[i].name));
        }
    }
    return {};
}

const ZipMember* ZipArchive::find(std::string_view name) const {
    const auto it = by_name_.find(name);
    return it == by_name_.end() ? nullptr : &members_[it->second];
}

size_t ZipArchive::data_offset(const ZipMember& m) const {
    // The directory's checks leave room for the local header and the name
    const std::string_view bytes = bytes_->bytes();
    if (!bytes.substr(m.header).starts_with(local_signature)) return 0;
    const size_t name_size = u16(bytes, m.header + 26);
    const size_t data = m.header + local_size + name_size + u16(bytes, m.header + 28);
    if (data > m.limit || size_t(m.stored_size) > m.limit - data) return 0;
    return bytes.substr(m.header + local_size, name_size) == m.name ? data : 0;
}

Result<AssetBytesPtr> ZipArchive::read(const ZipMember& m) const {
    if ((m.flags & encrypted_flags) != 0) {
        return unsupported(fmt::format("\"{}\" is encrypted, expected plain data", m.name));
    }
    if (m.method != 0) {
        return unsupported(fmt::format(
            "\"{}\" is compressed (method {}), expected stored data as USD packages have", m.name,
            m.method));
    }
    const size_t data = data_offset(m);
    if (data == 0 || m.stored_size != m.size) {
        return malformed(fmt::format(
            "the local header of \"{}\" does not agree with the central directory", m.name));
    }
    return make_asset_view(bytes_, bytes_->bytes().substr(data, m.size));
}

}  // namespace velatura
