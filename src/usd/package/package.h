// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/asset_bytes.h"
#include "base/diagnostics.h"
#include "base/result.h"

#include <optional>
#include <string>
#include <string_view>

namespace velatura::usd::package {

/// The bytes start like a zip archive.
bool is_package(std::string_view bytes);

/// The layer that a package stands for.
struct RootLayer {
    std::string name;     ///< "pkg.usdz[root.usdc]"
    AssetBytesPtr bytes;  ///< of no package; its format is for others to find out
};

/// The first file of the package `name` with these bytes; when that is a package too, its first
/// file. Data that is not aligned as the standard asks is noted once. Errors: "usd-empty-package",
/// "package-depth", those of ZipArchive.
/// Ref: AOUSD Core Specification 1.0.1, 16.4.1.2.
Result<RootLayer> open_root_layer(const AssetBytesPtr& package,
                                  const std::string& name,
                                  Diagnostics& diagnostics);

/// Tells whether an asset path, or for a pattern any of its files, exists.
using Exists = bool (*)(const std::string& name);

/// What an asset path means that the layer `anchor` ("pkg.usdz[sub/root.usda]") holds, as a name in
/// the same package: "./a", "../a" and "/a" always, which no one can open where they leave the
/// package; others where such a file is beside the layer or else beside the root layer of the
/// package. nullopt when it is to be looked for outside: the file that holds the package then
/// stands for the layer. `asset` may name a package itself ("b.usdz[c.usda]").
std::optional<std::string> anchor_in_package(std::string_view asset,
                                             const std::string& anchor,
                                             Exists exists = &asset_exists);

}  // namespace velatura::usd::package
