// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/asset_bytes.h"
#include "base/diagnostics.h"
#include "base/result.h"
#include "usd/layer/layer.h"

#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

namespace velatura::usd::compose {

using LayerPtr = std::shared_ptr<layer::Layer>;

/// One file format: how to know it by its first bytes, and how to read it. A format without a
/// reader is named in the error that opening such a file gives.
struct LayerFormat {
    std::string_view name;
    std::string_view magic;  ///< first bytes of the file
    Result<LayerPtr> (*read)(const AssetBytesPtr& bytes,
                             const std::string& identifier,
                             Diagnostics&);
};

/// Every format that is recognised by content; the extension plays no part.
std::span<const LayerFormat> layer_formats();

/// Opens layers and keeps them: one Layer per file.
class LayerRegistry {
  public:
    LayerRegistry(std::vector<std::string> search_paths,
                  size_t max_layers,
                  Diagnostics& diagnostics);

    /// File name that an authored asset path means, seen from the layer file that holds it:
    /// absolute paths stay;
    /// "./" and "../" are relative to that layer; others are tried next to it, then in the search
    /// paths. The path next to the layer comes back when no such file exists. Empty in, empty out.
    std::string resolve(std::string_view asset, const std::string& anchor_file) const;

    /// The layer of a resolved file name. An Error each time for a file that cannot be read; what
    /// the parser found goes to the diagnostics once.
    Result<LayerPtr> open(const std::string& file);

    /// Adds a layer that no file holds ("anonymous:…"), so that open() finds it by its identifier.
    void add(LayerPtr layer);

    /// Identifiers in the order of opening.
    std::vector<std::string> opened() const { return order_; }

  private:
    std::vector<std::string> search_paths_;
    size_t max_layers_;
    Diagnostics& diagnostics_;
    std::unordered_map<std::string, Result<LayerPtr>> layers_;
    std::vector<std::string> order_;
};

}  // namespace velatura::usd::compose
