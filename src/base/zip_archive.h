// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/asset_bytes.h"
#include "base/result.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

namespace velatura {

/// One file of an archive, as its central directory has it.
struct ZipMember {
    std::string_view name;
    size_t header = 0;  ///< offset of its local header
    size_t limit = 0;   ///< offset that its data must not pass: the next header or the directory
    size_t size = 0;    ///< bytes of data, stored
    uint32_t stored_size = 0;
    uint16_t method = 0;  ///< 0 = stored
    uint16_t flags = 0;   ///< bit 0: encrypted
};

/// Reads zip archives whose members are stored, as USD packages are: what is compressed or
/// encrypted is refused when it is asked for. Everything is checked against the size of the file;
/// checksums are not verified. Thread-safe. Ref: PKWARE APPNOTE 6.3.9; AOUSD Core
/// Specification 1.0.1, 16.4.
class ZipArchive {
  public:
    /// Reads the directory. `name` is for messages. Errors: "zip-malformed" (no archive, truncated,
    /// overlapping or doubled members), "zip-unsupported" (64-bit or in several files).
    static Result<std::shared_ptr<const ZipArchive>> open(AssetBytesPtr bytes,
                                                          const std::string& name);

    /// Files in the order of their bytes in the archive; folders are left out.
    std::span<const ZipMember> members() const { return members_; }

    /// The file of a name, else nullptr.
    const ZipMember* find(std::string_view name) const;

    /// The bytes of one of members(), without a copy. Errors: "zip-malformed", "zip-unsupported"
    /// (compressed or encrypted).
    Result<AssetBytesPtr> read(const ZipMember& member) const;

    /// Offset of the member's data in the archive; 0 when its local header is broken.
    size_t data_offset(const ZipMember& member) const;

  private:
    ZipArchive(AssetBytesPtr bytes, std::string name)
        : bytes_(std::move(bytes)), name_(std::move(name)) {}

    Result<void> read_directory();
    Result<void> order_members(size_t directory);
    Error malformed(const std::string& what) const;
    Error unsupported(const std::string& what) const;

    AssetBytesPtr bytes_;
    std::string name_;
    std::vector<ZipMember> members_;
    std::unordered_map<std::string_view, size_t> by_name_;
};

}  // namespace velatura
