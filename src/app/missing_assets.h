// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/diagnostics.h"

#include <cstddef>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace velatura::app {

/// Diagnostics that mean that the stage names something that could not be had, and that the result
/// lacks.
struct MissingAssetCode {
    std::string_view code;
    std::string_view kind;
};

inline constexpr MissingAssetCode missing_asset_codes[] = {
    {"usd-unresolved-asset", "layer"},    {"usd-unresolved-sublayer", "layer"},
    {"usd-unresolved-prim-path", "prim"}, {"usd-unresolved-default-prim", "prim"},
    {"usd-missing-layer", "value clip"},  {"mtlx-include", "MaterialX document"},
    {"texture-unreadable", "texture"},    {"light-texture", "light texture"},
    {"ies-unreadable", "IES profile"},    {"volume-file", "volume file"},
    {"volume-grid", "volume grid"},
};

enum class MissingAssets : unsigned char { Fail, Ignore };

/// What missing assets do to the exit code of this process; Fail until it is called.
void set_missing_assets(MissingAssets policy);

/// Counts the diagnostic if it is an error of missing_asset_codes. Thread-safe.
void note_missing_asset(const Diagnostic& diagnostic);

/// While a scene is read again, what it missed does not count. If it is not accepted, the
/// destructor restores that.
class MissingAssetsOfReload {
  public:
    MissingAssetsOfReload();
    ~MissingAssetsOfReload();

    MissingAssetsOfReload(const MissingAssetsOfReload&) = delete;
    MissingAssetsOfReload& operator=(const MissingAssetsOfReload&) = delete;

    /// The scene as it was read now is the one that is rendered.
    void accept() { is_accepted_ = true; }

  private:
    std::vector<size_t> counts_;
    std::set<std::string> names_;
    bool is_accepted_ = false;
};

/// "2 textures, 1 layer": what note_missing_asset counted; empty: nothing.
std::string missing_assets_text();

/// "plugin subdivision", "texture wood.png": what note_missing_asset counted and the plugins that
/// could not be opened, each once, without folders. Thread-safe.
std::vector<std::string> missing_asset_names();

/// Prints, as an error, which assets and plugins the command missed. Returns: the exit code of a
/// command that ended with `code`.
int exit_code_with_missing_assets(int code);

}  // namespace velatura::app
