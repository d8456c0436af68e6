// SPDX-License-Identifier: Apache-2.0
#include "usd/package/package.h"

#include "base/package_path.h"
#include "base/zip_archive.h"

#include <fmt/format.h>

#include <filesystem>
#include <span>
#include <vector>

namespace velatura::usd::package {

namespace fs = std::filesystem;

namespace {

constexpr size_t alignment = 64;

using Parts = std::vector<std::string>;

std::string beside(const std::string& file, const std::string& path) {
    return (fs::path(file).parent_path() / path).lexically_normal().generic_string();
}

void note_alignment(const ZipArchive& archive, const std::string& name, Diagnostics& diagnostics) {
    for (const ZipMember& member : archive.members()) {
        const size_t offset = archive.data_offset(member);
        if (offset % alignment == 0) continue;
        diagnostics.note(
            "usd-package-alignment", {diagnostics.file_id(name), 0, 0}, "",
            fmt::format("found \"{}\" at offset {} of the package, expected a multiple "
                        "of {}; it is read all the same",
                        member.name, offset, alignment));
        return;
    }
}

/// The name of the first file in a package that is no package.
std::optional<Parts> root_layer_of(Parts package) {
    for (size_t depth = 0; depth <= max_package_depth; ++depth) {
        const std::string name = join_package_path(package);
        const Result<AssetBytesPtr> bytes = open_asset_bytes(name);
        if (!bytes) return std::nullopt;
        if (!is_package((*bytes)->bytes())) return package;
        const auto archive = ZipArchive::open(*bytes, name);
        if (!archive || (*archive)->members().empty()) return std::nullopt;
        package.emplace_back((*archive)->members().front().name);
    }
    return std::nullopt;
}

/// A path that means a file of the package at `package`, beside the layer `layer` in it.
std::string within(Parts package, const std::string& layer, const Parts& asset) {
    package.push_back(beside(layer, asset.front()));
    package.insert(package.end(), asset.begin() + 1, asset.end());
    return join_package_path(package);
}

}  // namespace

bool is_package(std::string_view bytes) {
    return bytes.starts_with("PK\x03\x04");
}

Result<RootLayer> open_root_layer(const AssetBytesPtr& package,
                                  const std::string& name,
                                  Diagnostics& diagnostics) {
    Parts parts = split_package_path(name);
    if (asset_exists(name) && !is_package_path(name)) parts = {name};
    AssetBytesPtr bytes = package;
    while (is_package(bytes->bytes())) {
        const std::string outer = join_package_path(parts);
        if (parts.size() > max_package_depth) {
            return Error{"package-depth",
                         fmt::format("found more than {0} packages within packages in \"{1}\", "
                                     "expected at most {0}",
                                     max_package_depth, parts.front())};
        }
        const auto archive = ZipArchive::open(bytes, outer);
        if (!archive) return archive.error();
        if ((*archive)->members().empty()) {
            return Error{"usd-empty-package",
                         fmt::format("package \"{}\" has no file, expected a layer", outer)};
        }
        note_alignment(**archive, outer, diagnostics);
        const ZipMember& first = (*archive)->members().front();
        const Result<AssetBytesPtr> inner = (*archive)->read(first);
        if (!inner) return inner.error();
        bytes = *inner;
        parts.emplace_back(first.name);
    }
    return RootLayer{join_package_path(parts), bytes};
}

std::optional<std::string> anchor_in_package(std::string_view asset,
                                             const std::string& anchor,
                                             Exists exists) {
    Parts package = split_package_path(anchor);
    const Parts wanted = split_package_path(asset);
    if (package.size() < 2 || wanted.front().empty()) return std::nullopt;
    const std::string layer = package.back();
    package.pop_back();
    const std::string here = within(package, layer, wanted);
    const bool is_anchored =
        asset.starts_with("./") || asset.starts_with("../") || asset.starts_with("/");
    // "a/../../b" leaves the package as "../b" does, and is refused like it
    const bool leaves = beside(layer, wanted.front()).starts_with("../");
    if (is_anchored || leaves || exists(here)) return here;
    if (const auto root = root_layer_of(package)) {
        const std::string top = within({root->begin(), root->end() - 1}, root->back(), wanted);
        if (exists(top)) return top;
    }
    return std::nullopt;
}

}  // namespace velatura::usd::package
