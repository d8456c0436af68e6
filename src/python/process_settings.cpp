// SPDX-License-Identifier: Apache-2.0
#include "python/process_settings.h"

#include "python/failure.h"

#include <fmt/format.h>

#include <cstdlib>
#include <filesystem>
#include <mutex>
#include <system_error>
#include <utility>

namespace velatura::python {

namespace {

/// Confined scenes can read from their own folder, too.
std::string content_of(const std::string& scene, const app::AssetOptions& assets) {
    const char* const environment = std::getenv("VELATURA_ASSET_ROOTS");
    const std::string more = environment ? environment : "";
    const Limits& l = assets.limits;
    std::string text = fmt::format(
        "{}|{}|{}|{}|{}|{}|{}|{}|{}|{}|{}|{}", fmt::join(assets.roots, ":"), more,
        assets.is_confined, assets.is_sandboxed, l.prims, l.prims_per_spec, l.layers, l.array_bytes,
        l.image_side, l.decoding.seconds, l.decoding.bytes, l.decoding.in_process_bytes);
    std::error_code ignored;
    if (assets.is_confined || !assets.roots.empty() || !more.empty())
        text += "|" + std::filesystem::absolute(scene, ignored).parent_path().string();
    return text;
}

}  // namespace

std::shared_ptr<const ProcessSettings> ProcessSettings::lease(const std::string& scene,
                                                              const app::AssetOptions& assets) {
    static std::mutex mutex;
    static std::weak_ptr<const ProcessSettings> in_force;
    const std::lock_guard lock(mutex);
    std::string content = content_of(scene, assets);
    if (std::shared_ptr<const ProcessSettings> held = in_force.lock()) {
        if (held->content_ == content) return held;
        throw Failure(Failure::Kind::Error, "process-settings",
                      "asset_root, confine, sandbox and limit hold for the whole process, and a "
                      "stage or renderer that is alive has other ones; delete it first, or render "
                      "in another process");
    }
    app::apply_asset_roots(scene, assets);
    std::shared_ptr<const ProcessSettings> made(new ProcessSettings(std::move(content)));
    in_force = made;
    return made;
}

}  // namespace velatura::python
