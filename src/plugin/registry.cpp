// SPDX-License-Identifier: Apache-2.0
#include "plugin/registry.h"

#include "base/atomic_file.h"
#include "base/process/memory_limit.h"
#include "plugin/plugin_api.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <mutex>
#include <new>
#include <system_error>

namespace velatura::plugin {

namespace {

namespace fs = std::filesystem;

constexpr const char* manifest_name = "plugin.txt";

// Subfolders with a manifest, sorted, so that the order is that of no file system.
std::vector<fs::path> manifests_below(const fs::path& folder) {
    std::vector<fs::path> files;
    std::error_code error;
    fs::directory_iterator it(folder, error);
    while (!error && it != fs::directory_iterator()) {
        std::error_code ignored;
        const fs::path file = it->path() / manifest_name;
        if (fs::exists(file, ignored)) files.push_back(file);
        it.increment(error);
    }
    std::sort(files.begin(), files.end());
    return files;
}

// Its pages come from files, which no limit on memory refuses, and its own threads must have
// theirs.
void* open_library(const std::string& path, size_t bytes) {
    if (void* const opened = ::dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL | RTLD_NOLOAD))
        return opened;
    if (MemoryLimit::is_set() && bytes > MemoryLimit::left()) throw std::bad_alloc();
    const MemoryLimit::Suspension lifted;
    return ::dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
}

std::string& program_root() {
    static std::string folder;
    return folder;
}

struct UnavailablePlugins {
    std::mutex mutex;
    std::map<std::string, Error> by_name;
};

UnavailablePlugins& unavailable() {
    static UnavailablePlugins plugins;
    return plugins;
}

/// Keeps the first reason per plugin, and passes it on.
Error note_unavailable(const Need& need, Error why) {
    const std::lock_guard lock(unavailable().mutex);
    unavailable().by_name.emplace(need.usual_plugin, why);
    return why;
}

// Loads the shared object and returns what its entry point says; nullptr once reported.
const PluginInfo* load(const Manifest& manifest, Diagnostics& diagnostics) {
    const std::string file = (fs::path(manifest.folder) / manifest.library).string();
    const auto fail = [&](std::string message) -> const PluginInfo* {
        diagnostics.error("plugin-load", manifest.loc, {}, std::move(message));
        return nullptr;
    };
    std::error_code ignored;
    if (!fs::is_regular_file(file, ignored))
        return fail(fmt::format("plugin {}: shared object {} not found", manifest.name, file));
    // A name with a folder, so that the linker's own search path has no say
    const std::string path = fs::absolute(file).string();
    void* const handle = open_library(path, manifest.memory_bytes);
    if (!handle) {
        const char* why = ::dlerror();
        return fail(fmt::format("plugin {}: cannot be loaded: {}", manifest.name, why ? why : "?"));
    }
    void* symbol = ::dlsym(handle, entry_point_name);
    if (!symbol)
        return fail(fmt::format("plugin {}: {} has no entry point {}", manifest.name, file,
                                entry_point_name));
    const PluginInfo* info = reinterpret_cast<EntryPoint>(symbol)();
    if (!info)
        return fail(fmt::format("plugin {}: its entry point returns nothing", manifest.name));
    if (info->abi != abi_version) {
        diagnostics.error("plugin-abi", manifest.abi_loc, {},
                          fmt::format("plugin {}: expected ABI {}, found {} in {}", manifest.name,
                                      abi_version, info->abi, file));
        return nullptr;
    }
    if (!info->name || info->name != manifest.name)
        return fail(fmt::format("plugin {}: {} names itself \"{}\"", manifest.name, file,
                                info->name ? info->name : ""));
    return info;
}

}  // namespace

std::vector<PluginFolder> plugin_folders() {
    std::vector<PluginFolder> folders;
    const char* environment = std::getenv("VELATURA_PLUGIN_PATH");
    std::string_view rest = environment ? environment : "";
    while (!rest.empty()) {
        const size_t colon = std::min(rest.find(':'), rest.size());
        if (colon > 0) folders.push_back({std::string(rest.substr(0, colon)), true});
        rest.remove_prefix(std::min(colon + 1, rest.size()));
    }
    std::error_code error;
    fs::path root = program_root();
    if (root.empty()) root = fs::read_symlink("/proc/self/exe", error).parent_path().parent_path();
    if (!error) {
        folders.push_back({(root / "plugins").string()});
        folders.push_back({(root / VELATURA_PLUGIN_DIR).string()});
    }
    // Of an installed program it is the folder before
    if (folders.empty() || folders.back().path != VELATURA_INSTALLED_PLUGINS)
        folders.push_back({VELATURA_INSTALLED_PLUGINS});
    return folders;
}

void set_program_root(const std::string& folder) {
    program_root() = folder;
}

Registry::Registry(const std::vector<PluginFolder>& folders, Diagnostics& diagnostics) {
    for (const PluginFolder& folder : folders) {
        searched_ += (searched_.empty() ? "" : ", ") + folder.path;
        read_folder(folder, diagnostics);
    }
}

void Registry::read_folder(const PluginFolder& folder, Diagnostics& diagnostics) {
    std::error_code ignored;
    if (!fs::is_directory(folder.path, ignored)) {
        if (folder.is_required) {
            diagnostics.warn("plugin-path", {}, {},
                             fmt::format("VELATURA_PLUGIN_PATH: {} is not a folder", folder.path));
        }
        return;
    }
    for (const fs::path& file : manifests_below(folder.path)) {
        const Result<std::string> text = read_file(file.string(), manifest_size_limit_bytes);
        if (!text) {
            diagnostics.error("plugin-manifest", {diagnostics.file_id(file.string()), 0, 0}, {},
                              text.error().message);
            continue;
        }
        std::optional<Manifest> manifest = parse_manifest(*text, file.string(), diagnostics);
        if (!manifest) continue;
        const auto same = std::find_if(manifests_.begin(), manifests_.end(),
                                       [&](const Manifest& m) { return m.name == manifest->name; });
        if (same == manifests_.end()) {
            manifests_.push_back(std::move(*manifest));
        } else {
            diagnostics.note("plugin-path", manifest->loc, {},
                             fmt::format("plugin {} is loaded from {}", same->name, same->folder));
        }
    }
}

const Manifest* Registry::find(std::string_view interface_name, const Trigger& trigger) const {
    const auto it = std::find_if(manifests_.begin(), manifests_.end(), [&](const Manifest& m) {
        return m.has_interface(interface_name) && m.has_trigger(trigger);
    });
    return it == manifests_.end() ? nullptr : &*it;
}

const void* open_interface(const Manifest& manifest,
                           std::string_view interface_name,
                           uint32_t version,
                           Diagnostics& diagnostics) {
    const auto reject = [&](std::string message) -> const void* {
        diagnostics.error("plugin-abi", manifest.abi_loc, {}, std::move(message));
        return nullptr;
    };
    // Before anything of it is run
    if (manifest.abi != abi_version)
        return reject(fmt::format("plugin {}: expected ABI {}, found {}", manifest.name,
                                  abi_version, manifest.abi));
    const PluginInfo* info = load(manifest, diagnostics);
    if (!info) return nullptr;
    for (size_t i = 0; i < info->interface_count; ++i) {
        const InterfaceEntry& entry = info->interfaces[i];
        if (entry.name != interface_name) continue;
        if (entry.version == version && entry.object) return entry.object;
        return reject(fmt::format("plugin {}: expected version {} of {}, found {}", manifest.name,
                                  version, interface_name, entry.version));
    }
    return reject(fmt::format("plugin {}: does not provide {}, which its manifest lists",
                              manifest.name, interface_name));
}

Result<const void*> open_needed(const Need& need) {
    Diagnostics diagnostics;
    const Registry registry(plugin_folders(), diagnostics);
    if (const Manifest* manifest = registry.find(need.interface_name, need.trigger)) {
        const void* object =
            open_interface(*manifest, need.interface_name, need.version, diagnostics);
        if (object) return object;
        const Diagnostic why = diagnostics.all().back();
        return note_unavailable(need, {why.code, why.message});
    }
    std::string message = fmt::format("plugin {} is missing: no plugin provides {} in {}",
                                      need.usual_plugin, need.interface_name, registry.searched());
    // A folder that is not there or a manifest that is broken may be the reason
    for (const Diagnostic& d : diagnostics.all()) {
        if (d.severity != Severity::Note) message += "; " + diagnostics.format(d);
    }
    return note_unavailable(need, {"plugin-missing", message});
}

std::vector<Error> unavailable_plugins() {
    const std::lock_guard lock(unavailable().mutex);
    std::vector<Error> reasons;
    for (const auto& [name, why] : unavailable().by_name) reasons.push_back(why);
    return reasons;
}

std::vector<std::string> unavailable_plugin_names() {
    const std::lock_guard lock(unavailable().mutex);
    std::vector<std::string> names;
    for (const auto& [name, why] : unavailable().by_name) names.push_back(name);
    return names;
}

}  // namespace velatura::plugin
