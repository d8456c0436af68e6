// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/diagnostics.h"
#include "base/result.h"
#include "plugin/manifest.h"

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace velatura::plugin {

/// A folder whose subfolders each may hold a plugin: a `plugin.txt` and its shared object.
struct PluginFolder {
    std::string path;
    bool is_required = false;  ///< warn when it is not there
};

/// Search path, first match wins: the folders of $VELATURA_PLUGIN_PATH (separated by `:`), then,
/// below the folder above the program's own, plugins (build tree) and lib/velatura/plugins
/// (installed tree, wherever it was moved to), then that of the configured install prefix.
std::vector<PluginFolder> plugin_folders();

/// For a library in the process of another program: the folder that stands for the one above the
/// program's own. Before the first plugin is searched.
void set_program_root(const std::string& folder);

/// The plugins that are known. Knowing one loads none.
class Registry {
  public:
    /// Reads the manifests. Of plugins with the same name the first folder's counts; broken
    /// manifests are reported and left out.
    Registry(const std::vector<PluginFolder>& folders, Diagnostics& diagnostics);

    const std::vector<Manifest>& manifests() const { return manifests_; }

    /// The folders, for messages.
    const std::string& searched() const { return searched_; }

    /// The first plugin that fills the interface and is called for by the trigger; or nullptr.
    const Manifest* find(std::string_view interface_name, const Trigger& trigger) const;

  private:
    void read_folder(const PluginFolder& folder, Diagnostics& diagnostics);

    std::vector<Manifest> manifests_;
    std::string searched_;
};

/// Opens the plugin, on first use, and returns its object for the interface. nullptr when that
/// cannot be had: reported at the manifest under "plugin-abi" (another ABI or version of the
/// interface) or "plugin-load" (no shared object, not loadable, no entry point, another plugin).
/// Thread-safe.
const void* open_interface(const Manifest& manifest,
                           std::string_view interface_name,
                           uint32_t version,
                           Diagnostics& diagnostics);

/// What a tier needs of whatever plugin brings it.
struct Need {
    const char* interface_name;
    uint32_t version;  ///< of the interface
    Trigger trigger;
    const char* usual_plugin;  ///< that of this house, to be named where none is found
};

/// Finds and opens the plugin for code that nobody hands a registry to, and that keeps the answer.
/// Errors: "plugin-missing", else those of open_interface; the message names the plugin.
/// Thread-safe.
Result<const void*> open_needed(const Need& need);

/// Why open_needed failed in this process, once per plugin: an image that needed one of them is
/// incomplete. Thread-safe.
std::vector<Error> unavailable_plugins();

/// Their names, in the same order. Thread-safe.
std::vector<std::string> unavailable_plugin_names();

}  // namespace velatura::plugin
