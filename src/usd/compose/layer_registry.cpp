// SPDX-License-Identifier: Apache-2.0
#include "usd/compose/layer_registry.h"

#include "base/asset_roots.h"
#include "base/package_path.h"
#include "base/tasks.h"
#include "base/udim.h"
#include "usd/crate/reader.h"
#include "usd/materialx/reader.h"
#include "usd/package/package.h"
#include "usd/text/reader.h"

#include <fmt/format.h>

#include <array>
#include <filesystem>
#include <optional>
#include <unordered_set>

namespace velatura::usd::compose {

namespace fs = std::filesystem;

namespace {

Result<LayerPtr> read_text(const AssetBytesPtr& asset,
                           const std::string& identifier,
                           Diagnostics& diagnostics) {
    return text::read_text_layer(asset->bytes(), identifier, diagnostics);
}

constexpr std::array<LayerFormat, 5> formats = {{
    {"text (.usda)", "#usda", &read_text},
    {"text (.usda)", "#sdf", &read_text},
    {"crate (.usdc)", "PXR-USDC", &crate::read_crate_layer},
    {"MaterialX (.mtlx)", "<?xml", &materialx::read_materialx_layer},
    {"MaterialX (.mtlx)", "<materialx", &materialx::read_materialx_layer},
}};

constexpr std::string_view byte_order_mark = "\xef\xbb\xbf";

std::string normal(const fs::path& path) {
    return path.lexically_normal().string();
}

Result<LayerPtr> read_layer(const AssetBytesPtr& asset,
                            const std::string& file,
                            bool reads_materialx,
                            Diagnostics& diagnostics) {
    std::string_view start = asset->bytes();
    if (start.starts_with(byte_order_mark)) start.remove_prefix(byte_order_mark.size());
    // XML may come late
    const size_t text = start.find_first_not_of(" \t\r\n");
    if (text != std::string_view::npos && start[text] == '<') start.remove_prefix(text);
    for (const LayerFormat& format : formats) {
        if (!start.starts_with(format.magic)) continue;
        if (!reads_materialx && format.read == &materialx::read_materialx_layer)
            return Error{"usd-format-unknown",
                         fmt::format("\"{}\" is a MaterialX document, which is not read here; use "
                                     "--materialx with info and flatten",
                                     file)};
        return format.read(asset, file, diagnostics);
    }
    return Error{
        "usd-format-unknown",
        fmt::format("\"{}\" is not a USD layer: expected #usda, PXR-USDC, XML or a zip archive",
                    file)};
}

}  // namespace

std::span<const LayerFormat> layer_formats() {
    return formats;
}

std::vector<std::string> split_search_path(std::string_view text) {
    std::vector<std::string> folders;
    while (!text.empty()) {
        const size_t colon = text.find(':');
        if (colon != 0) folders.emplace_back(text.substr(0, colon));
        if (colon == std::string_view::npos) break;
        text.remove_prefix(colon + 1);
    }
    return folders;
}

LayerRegistry::LayerRegistry(std::vector<std::string> search_paths,
                             size_t max_layers,
                             Diagnostics& diagnostics)
    : search_paths_(std::move(search_paths)), max_layers_(max_layers), diagnostics_(diagnostics) {}

bool LayerRegistry::exists(const std::string& resolved) {
    if (!is_udim_name(resolved)) return asset_exists(resolved);
    for (int i = 0; i < udim_count; ++i)
        if (asset_exists(udim_tile_name(resolved, i))) return true;
    return false;
}

std::string LayerRegistry::resolve_file(std::string_view asset,
                                        const std::string& anchor_file) const {
    const fs::path path(asset);
    if (path.is_absolute()) return normal(path);
    std::string beside = normal(fs::path(anchor_file).parent_path() / path);
    const bool is_anchored = asset.starts_with("./") || asset.starts_with("../");
    if (is_anchored || exists(beside)) return beside;
    for (const std::string& folder : search_paths_) {
        std::string candidate = normal(fs::path(folder) / path);
        if (exists(candidate)) return candidate;
    }
    return beside;
}

std::string LayerRegistry::resolve_from(std::string_view asset,
                                        const std::string& anchor_file) const {
    std::string anchor = anchor_file;
    if (is_package_path(anchor)) {
        if (auto inside = package::anchor_in_package(asset, anchor, &LayerRegistry::exists)) {
            return *std::move(inside);
        }
        anchor = split_package_path(anchor).front();
    }
    std::vector<std::string> parts = split_package_path(asset);
    if (parts.size() > 1) {
        // A file may have brackets in its own name
        std::string plain = resolve_file(asset, anchor);
        std::error_code ignored;
        if (fs::is_regular_file(plain, ignored)) return plain;
        for (std::string& part : std::span(parts).subspan(1)) part = normal(part);
    }
    parts.front() = resolve_file(parts.front(), anchor);
    return join_package_path(parts);
}

std::string LayerRegistry::resolve(std::string_view asset, const std::string& anchor_file) const {
    if (asset.empty()) return {};
    {
        const std::lock_guard lock(mutex_);
        if (layers_.count(std::string(asset)) != 0) return std::string(asset);
    }
    if (!check_asset_name(asset)) return std::string(asset);
    return resolve_from(asset, anchor_file);
}

std::vector<std::string> LayerRegistry::opened() const {
    const std::lock_guard lock(mutex_);
    return order_;
}

const Result<LayerPtr>* LayerRegistry::find(const std::string& file) const {
    const auto known = layers_.find(file);
    return known == layers_.end() ? nullptr : &known->second;
}

LayerRegistry::Loaded LayerRegistry::load(const std::string& file) const {
    Loaded loaded{file, LayerPtr(), std::make_unique<Diagnostics>(diagnostics_)};
    if (file.empty()) {
        loaded.layer = Error{"file-not-found", "the asset path does not resolve to a file"};
        return loaded;
    }
    Result<AssetBytesPtr> asset = open_asset_bytes(file);
    if (!asset) {
        loaded.layer = asset.error();
        return loaded;
    }
    if (package::is_package((*asset)->bytes())) {
        const auto root = package::open_root_layer(*asset, file, *loaded.messages);
        if (!root) {
            loaded.layer = root.error();
            return loaded;
        }
        loaded.name = root->name;
        asset = root->bytes;
    }
    loaded.layer = read_layer(*asset, loaded.name, reads_materialx_, *loaded.messages);
    return loaded;
}

Result<LayerPtr> LayerRegistry::commit(const std::string& file, Loaded loaded) {
    const std::lock_guard lock(mutex_);
    // Another thread, or another name of the same layer, may have been first
    if (const auto* known = find(file)) return *known;
    if (const auto* known = find(loaded.name)) {
        const Result<LayerPtr> same = *known;
        layers_.emplace(file, same);
        return same;
    }
    if (loaded.layer.has_value()) order_.push_back(loaded.name);
    loaded.messages->forward();
    layers_.emplace(file, loaded.layer);
    if (loaded.name != file) layers_.emplace(loaded.name, loaded.layer);
    return loaded.layer;
}

Result<LayerPtr> LayerRegistry::open(const std::string& file) {
    std::optional<Loaded> loaded;
    {
        const std::lock_guard lock(mutex_);
        if (const auto* known = find(file)) return *known;
        if (order_.size() >= max_layers_) {
            return Error{
                "usd-too-many-layers",
                fmt::format("more than {} layers, limit reached (--limit layers)", max_layers_)};
        }
        if (auto ready = ready_.extract(file)) loaded = std::move(ready.mapped());
    }
    // Without the lock: reading may run tasks of other callers on this thread
    if (!loaded) loaded = load(file);
    return commit(file, *std::move(loaded));
}

void LayerRegistry::add(LayerPtr layer) {
    const std::string name = layer->identifier();
    const std::lock_guard lock(mutex_);
    order_.push_back(name);
    layers_.insert_or_assign(name, Result<LayerPtr>(std::move(layer)));
}

void LayerRegistry::prefetch(std::span<const std::string> files) {
    std::vector<std::string> wanted;
    {
        const std::lock_guard lock(mutex_);
        const size_t held = order_.size() + ready_.size();
        const size_t room = max_layers_ > held ? max_layers_ - held : 0;
        std::unordered_set<std::string_view> seen;
        for (const std::string& file : files) {
            if (wanted.size() >= room) break;
            if (file.empty() || find(file) || ready_.count(file) || !seen.insert(file).second) {
                continue;
            }
            wanted.push_back(file);
        }
    }
    if (wanted.size() < 2) return;
    // File ids in a fixed order, whichever file is read first
    for (const std::string& file : wanted) diagnostics_.file_id(file);
    parallel_for_isolated(wanted.size(), [&](size_t i) {
        Loaded loaded = load(wanted[i]);
        const std::lock_guard lock(mutex_);
        ready_.emplace(wanted[i], std::move(loaded));
    });
}

}  // namespace velatura::usd::compose
