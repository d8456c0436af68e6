// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"

#include <memory>
#include <string>
#include <string_view>

namespace velatura {

/// The bytes of one file, mapped or owned. Never changes; whoever keeps a pointer into bytes()
/// keeps the AssetBytes too.
class AssetBytes {
  public:
    virtual ~AssetBytes() = default;
    virtual std::string_view bytes() const = 0;
};

using AssetBytesPtr = std::shared_ptr<const AssetBytes>;

/// Bytes that live in memory.
AssetBytesPtr make_asset_bytes(std::string bytes);

/// Maps a file read-only; pages come in on first use. Errors: "file-not-found", "file-unreadable"
/// (a folder, a device, no permission).
Result<AssetBytesPtr> open_asset_bytes(const std::string& file);

}  // namespace velatura
