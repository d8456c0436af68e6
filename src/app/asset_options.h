// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/scene_overrides.h"
#include "base/command_line.h"
#include "base/limits.h"

#include <string>
#include <vector>

namespace velatura::app {

/// Where the files of a scene are looked for, where they may lie, and what stands above them, as
/// typed.
struct AssetOptions {
    std::vector<std::string> search_paths;
    std::vector<std::string> roots;
    bool is_confined = false;   ///< to the scene's own folder, whatever the roots
    bool is_sandboxed = false;  ///< images are decoded in decoder processes; confined ones always
    Limits limits;
    std::string missing = "fail";  ///< fail or ignore
    SceneOverrides overrides;
};

/// Adds --search-path, which may come several times.
void add_search_path_option(Command& command, std::vector<std::string>& folders);

/// Adds what a scene is allowed: --asset-root, which may come several times, --confine, --sandbox,
/// --limit and --missing-assets.
void add_root_options(Command& command, AssetOptions& options);

/// Adds the groups "Scene" (search paths, overrides) and "Files and limits" of the commands that
/// read a scene and render nothing.
void add_scene_groups(Command& command, AssetOptions& options, std::string& memory_limit);

/// Sets the limits and what missing assets do to the exit code, and says where the files of `scene`
/// may lie, from here on: anywhere, unless --confine, --asset-root or $VELATURA_ASSET_ROOTS asks
/// otherwise: then beneath the folder of the scene, which may be a link, and beneath those. A scene
/// that is confined is sandboxed.
void apply_asset_roots(const std::string& scene, const AssetOptions& options);

}  // namespace velatura::app
