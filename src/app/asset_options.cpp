// SPDX-License-Identifier: Apache-2.0
#include "app/asset_options.h"

#include "app/limit_options.h"
#include "app/memory_options.h"
#include "app/missing_assets.h"
#include "base/asset_roots.h"
#include "base/package_path.h"
#include "usd/compose/layer_registry.h"

#include <cstdlib>
#include <filesystem>
#include <system_error>

namespace velatura::app {

namespace fs = std::filesystem;

void add_search_path_option(Command& command, std::vector<std::string>& folders) {
    command
        .add_option("--search-path", folders,
                    "Search folder for asset paths without ./ or ../, before those of "
                    "$PXR_AR_DEFAULT_SEARCH_PATH")
        .type_name("DIR")
        .existing_directory()
        .take_all()
        .allow_extra_args(false);
}

void add_root_options(Command& command, AssetOptions& options) {
    command
        .add_option("--asset-root", options.roots,
                    "Allowed folder: read files only below it and the scene's own folder, after "
                    "links are followed; report others as errors and render the rest. "
                    "$VELATURA_ASSET_ROOTS adds more, separated by ':'")
        .type_name("DIR")
        .existing_directory()
        .take_all()
        .allow_extra_args(false)
        .default_text("any folder");
    command.add_flag("--confine", options.is_confined,
                     "Untrusted scene: read files only below the scene's own folder and each "
                     "--asset-root");
    command.add_flag("--sandbox", options.is_sandboxed,
                     "Decode images in decoder processes: a crash or hang of a decoder costs one "
                     "image, not the render (0.2 s and 41 MB); on with --confine, --asset-root "
                     "and $VELATURA_ASSET_ROOTS");
    command
        .add_option("--missing-assets", options.missing,
                    "Missing or unreadable layers, textures, IES profiles, volume files and "
                    "plugins: fail (write the rest, then exit code 1) or ignore (exit code 0, same "
                    "messages)")
        .one_of({"fail", "ignore"});
    add_limit_option(command, options.limits);
}

void add_scene_groups(Command& command, AssetOptions& options, std::string& memory_limit) {
    Command scene = command.add_group("Scene");
    add_search_path_option(scene, options.search_paths);
    add_override_options(scene, options.overrides);
    Command limits = command.add_group("Files and limits");
    add_memory_option(limits, memory_limit);
    add_root_options(limits, options);
}

void apply_asset_roots(const std::string& scene, const AssetOptions& options) {
    set_missing_assets(options.missing == "ignore" ? MissingAssets::Ignore : MissingAssets::Fail);
    std::vector<std::string> folders = options.roots;
    const char* const environment = std::getenv("VELATURA_ASSET_ROOTS");
    for (std::string& folder : usd::compose::split_search_path(environment ? environment : ""))
        folders.push_back(std::move(folder));
    const bool is_confined = options.is_confined || !folders.empty();
    Limits limits = options.limits;
    limits.decoding.is_sandboxed = is_confined || options.is_sandboxed;
    set_limits(limits);
    if (!is_confined) return set_asset_roots({});

    // Of "a.usdz[b.usda]" the folder of a.usdz; a link's own folder, for what stands beside it, and
    // that of what it leads to
    std::error_code failed;
    const bool is_file = fs::exists(scene, failed);
    const fs::path file = fs::absolute(is_file ? scene : split_package_path(scene).front(), failed);
    folders.push_back(file.parent_path().string());
    const fs::path real = fs::canonical(file, failed);
    if (!failed) folders.push_back(real.parent_path().string());
    set_asset_roots(AssetRoots::beneath(folders));
}

}  // namespace velatura::app
