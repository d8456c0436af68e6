// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/diagnostics.h"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace velatura::plugin {

/// What calls for a plugin, e.g. {"prim_type", "OpenVDBAsset"} or {"option", "accel=embree"}.
struct Trigger {
    std::string kind;
    std::string value;

    bool operator==(const Trigger&) const = default;
};

/// A plugin as its text file describes it.
struct Manifest {
    std::string name;
    uint32_t abi = 0;
    std::string library;                ///< file name of the shared object, beside the manifest
    std::vector<std::string> provides;  ///< names of interfaces
    std::vector<Trigger> triggers;
    std::string summary;  ///< one line for people
    size_t memory_bytes =
        0;               ///< that opening it takes, resident, with the libraries that it brings
    std::string folder;  ///< where the manifest lies
    SourceLoc loc;       ///< of the name
    SourceLoc abi_loc;

    bool has_trigger(const Trigger& trigger) const;
    bool has_interface(std::string_view interface_name) const;
};

/// Largest manifest that is read.
inline constexpr size_t manifest_size_limit_bytes = 64 * 1024;

/// Reads `key: value` lines; `#` begins a comment line. Keys: name, abi, provides (may repeat) and
/// trigger (kind and value, may repeat) and, optionally, library (velatura_<name>.so), memory
/// (megabytes that opening it takes) and summary. Returns: nothing when anything is wrong, which is
/// reported with line and column under the code "plugin-manifest".
std::optional<Manifest> parse_manifest(std::string_view text,
                                       const std::string& file_name,
                                       Diagnostics& diagnostics);

}  // namespace velatura::plugin
