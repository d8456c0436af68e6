// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

namespace velatura::plugin {

/// Changes when PluginInfo or InterfaceEntry do. What an interface itself looks like has a version
/// of its own.
inline constexpr uint32_t abi_version = 1;

/// One interface that a plugin fills. `object` lives as long as the process; which type it has is
/// between the plugin and the tier that declares the interface.
struct InterfaceEntry {
    const char* name;  ///< as after `provides:` in the manifest
    uint32_t version;  ///< of the header that the plugin was compiled with
    const void* object;
};

/// What a plugin says of itself. The members up to `name` keep their place in every ABI.
struct PluginInfo {
    uint32_t abi;
    const char* name;  ///< the same as in the manifest
    const InterfaceEntry* interfaces;
    size_t interface_count;
};

/// A plugin exports one function, extern "C" and visible, called entry_point_name. It must not
/// throw and always returns the same, constant PluginInfo.
using EntryPoint = const PluginInfo* (*)();
inline constexpr const char* entry_point_name = "velatura_plugin_v1";

}  // namespace velatura::plugin
