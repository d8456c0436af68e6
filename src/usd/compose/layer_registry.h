// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/asset_bytes.h"
#include "base/diagnostics.h"
#include "base/result.h"
#include "usd/layer/layer.h"

#include <cstddef>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

namespace velatura::usd::compose {

using LayerPtr = std::shared_ptr<layer::Layer>;

/// One file format: how to know it by its first bytes, and how to read it. The
/// Diagnostics are gone after the reading; what is found on first use goes to their late().
struct LayerFormat {
    std::string_view name;
    std::string_view magic;  ///< first bytes of the file
    Result<LayerPtr> (*read)(const AssetBytesPtr& bytes,
                             const std::string& identifier,
                             Diagnostics&);
};

/// Every format that is recognized by content; the extension plays no part. Packages (.usdz) are
/// opened before a format is looked for.
std::span<const LayerFormat> layer_formats();

/// Folders of a search path as $PXR_AR_DEFAULT_SEARCH_PATH has it: apart by ':'; empty ones are
/// left out.
std::vector<std::string> split_search_path(std::string_view text);

/// Opens layers and keeps them: one Layer per file. Thread-safe.
class LayerRegistry {
  public:
    LayerRegistry(std::vector<std::string> search_paths,
                  size_t max_layers,
                  Diagnostics& diagnostics);

    /// File name that an authored asset path means, seen from the layer file that holds it:
    /// absolute paths stay; "./" and "../" are relative to that layer; others are tried next to it,
    /// then in the search paths. The path next to the layer comes back when no such file exists.
    /// A layer in a package finds what the package holds first, then what is next to the package.
    /// "<UDIM>" stands for any tile that exists. Empty in, empty out. What can be the name of no
    /// file (check_asset_name) stays as it is. Whether a file may be opened is said when it is.
    std::string resolve(std::string_view asset, const std::string& anchor_file) const;

    /// Whether a resolved name is that of a file: on disk, in a package, or any tile of "<UDIM>".
    static bool exists(const std::string& resolved);

    /// The layer of a resolved file name. An Error each time for a file that cannot be read; what
    /// the parser found goes to the diagnostics once. A package stands for its root layer, whose
    /// identifier is "pkg.usdz[root.usdc]"; both names give the same Layer.
    Result<LayerPtr> open(const std::string& file);

    /// From here on the layer's identifier is the name of this layer, which no file holds.
    void add(LayerPtr layer);

    /// Reads files in parallel that open() will be asked for. Changes nothing but the speed: order
    /// of opening, diagnostics and errors come about as the calls of open() follow one another.
    void prefetch(std::span<const std::string> files);

    /// Before any layer is opened; see ComposeOptions.
    void set_reads_materialx(bool reads) { reads_materialx_ = reads; }

    /// Identifiers in the order of opening.
    std::vector<std::string> opened() const;

  private:
    /// A layer that is read but not yet asked for.
    struct Loaded {
        std::string name;  ///< of the layer itself: differs from the file's for packages
        Result<LayerPtr> layer;
        std::unique_ptr<Diagnostics> messages;
    };

    std::string resolve_from(std::string_view asset, const std::string& anchor_file) const;
    std::string resolve_file(std::string_view asset, const std::string& anchor_file) const;
    Loaded load(const std::string& file) const;
    const Result<LayerPtr>* find(const std::string& file) const;
    Result<LayerPtr> commit(const std::string& file, Loaded loaded);

    std::vector<std::string> search_paths_;
    size_t max_layers_;
    Diagnostics& diagnostics_;
    bool reads_materialx_ = true;

    mutable std::mutex mutex_;  ///< of all below
    std::unordered_map<std::string, Result<LayerPtr>> layers_;
    std::unordered_map<std::string, Loaded> ready_;
    std::vector<std::string> order_;
};

}  // namespace velatura::usd::compose
