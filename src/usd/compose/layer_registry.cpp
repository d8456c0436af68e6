// SPDX-License-Identifier: Apache-2.0
#include "usd/compose/layer_registry.h"

#include "usd/text/reader.h"

#include <fmt/format.h>

#include <array>
#include <filesystem>
#include <system_error>

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
    {"crate (.usdc)", "PXR-USDC", nullptr},
    {"package (.usdz)", "PK\x03\x04", nullptr},
    {"MaterialX (.mtlx)", "<?xml", nullptr},
}};

bool is_file(const fs::path& p) {
    std::error_code ignored;
    return fs::is_regular_file(p, ignored);
}

}  // namespace

std::span<const LayerFormat> layer_formats() {
    return formats;
}

LayerRegistry::LayerRegistry(std::vector<std::string> search_paths,
                             size_t max_layers,
                             Diagnostics& diagnostics)
    : search_paths_(std::move(search_paths)), max_layers_(max_layers), diagnostics_(diagnostics) {}

std::string LayerRegistry::resolve(std::string_view asset, const std::string& anchor_file) const {
    if (asset.empty()) return {};
    if (layers_.count(std::string(asset)) != 0) return std::string(asset);
    const fs::path path(asset);
    if (path.is_absolute()) return path.lexically_normal().string();
    const fs::path beside = (fs::path(anchor_file).parent_path() / path).lexically_normal();
    const bool is_relative = asset.starts_with("./") || asset.starts_with("../");
    if (is_relative || is_file(beside)) return beside.string();
    for (const std::string& folder : search_paths_) {
        const fs::path candidate = (fs::path(folder) / path).lexically_normal();
        if (is_file(candidate)) return candidate.string();
    }
    return beside.string();
}

void LayerRegistry::add(LayerPtr layer) {
    const std::string identifier = layer->identifier();
    order_.push_back(identifier);
    layers_.emplace(identifier, Result<LayerPtr>(std::move(layer)));
}

Result<LayerPtr> LayerRegistry::open(const std::string& file) {
    const auto known = layers_.find(file);
    if (known != layers_.end()) return known->second;
    const auto remember = [&](Result<LayerPtr> result) {
        if (result.has_value()) order_.push_back(file);
        layers_.emplace(file, result);
        return result;
    };
    if (order_.size() >= max_layers_) {
        return Error{"usd-too-many-layers",
                     fmt::format("more than {} layers, limit reached", max_layers_)};
    }
    const Result<AssetBytesPtr> asset = open_asset_bytes(file);
    if (!asset) return remember(asset.error());
    for (const LayerFormat& format : formats) {
        if (!(*asset)->bytes().starts_with(format.magic)) continue;
        if (!format.read) {
            return remember(Error{"usd-format-unsupported",
                                  fmt::format("{} is not supported: \"{}\"", format.name, file)});
        }
        return remember(format.read(*asset, file, diagnostics_));
    }
    return remember(Error{
        "usd-format-unknown",
        fmt::format("\"{}\" is not a USD layer: expected #usda, PXR-USDC or a zip archive", file)});
}

}  // namespace velatura::usd::compose
