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

    /// Of a file that is mapped, pages that came in go again until they are next used: for those
    /// who read all of a large file once.
    virtual void forget() const {}
};

using AssetBytesPtr = std::shared_ptr<const AssetBytes>;

/// Bytes that live in memory.
AssetBytesPtr make_asset_bytes(std::string bytes);

/// A part of the bytes of `owner`, which it keeps alive.
AssetBytesPtr make_asset_view(AssetBytesPtr owner, std::string_view part);

/// The one way from the name of an asset to its bytes, without a copy. Thread-safe. A name is that
/// of a file, which is mapped read-only (pages come in on first use), or of a file in packages:
/// "pkg.usdz[tex/a.png]", "a.usdz[b.usdz[c.usda]]". The packages used last stay mapped.
/// Files lie where asset_roots() allows. Errors: those of AssetRoots::open and ZipArchive,
/// "package-depth", "asset-leaves-package" (a member called "../x" or "/x").
Result<AssetBytesPtr> open_asset_bytes(const std::string& name);

/// True for regular files, wherever they lie, and for names of members that the directories of
/// packages have, which are opened only where asset_roots() allows.
bool asset_exists(const std::string& name);

}  // namespace velatura
