// SPDX-License-Identifier: Apache-2.0
// A plugin that is wrong in the one way that a macro names.
#include "plugin/plugin_api.h"

namespace {

using namespace velatura;

const int object = 0;

#if defined(WRONG_INTERFACE)
const plugin::InterfaceEntry interfaces[] = {{"another", 1, &object}};
#elif defined(WRONG_VERSION)
const plugin::InterfaceEntry interfaces[] = {{"accelerator", 4711, &object}};
#else
const plugin::InterfaceEntry interfaces[] = {{"accelerator", 1, &object}};
#endif

#if defined(WRONG_ABI)
const plugin::PluginInfo info = {plugin::abi_version + 1, "wrong_abi", interfaces, 1};
#elif defined(WRONG_VERSION)
const plugin::PluginInfo info = {plugin::abi_version, "wrong_version", interfaces, 1};
#elif defined(WRONG_INTERFACE)
const plugin::PluginInfo info = {plugin::abi_version, "wrong_interface", interfaces, 1};
#else
const plugin::PluginInfo info = {plugin::abi_version, "somebody_else", interfaces, 1};
#endif

}  // namespace

#if defined(WRONG_ENTRY)
#define ENTRY_POINT velatura_plugin_v0
#else
#define ENTRY_POINT velatura_plugin_v1
#endif

extern "C" [[gnu::visibility("default")]] const plugin::PluginInfo* ENTRY_POINT();

const plugin::PluginInfo* ENTRY_POINT() {
#if defined(WRONG_NULL)
    return info.name ? nullptr : &info;
#else
    return &info;
#endif
}
