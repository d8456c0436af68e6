// SPDX-License-Identifier: Apache-2.0
#include "render/accelerator_choice.h"

#include "plugin/registry.h"

#include <fmt/format.h>

#include <string_view>

namespace velatura::render {

namespace {

constexpr std::string_view trigger_prefix = "accel=";

/// Names that plugins bring, for the message about one that none brings.
std::string known_names(const plugin::Registry& registry) {
    std::string names = "bvh";
    for (const plugin::Manifest& manifest : registry.manifests()) {
        if (!manifest.has_interface(accel::accelerator_interface)) continue;
        for (const plugin::Trigger& trigger : manifest.triggers) {
            if (trigger.kind == "option" && trigger.value.starts_with(trigger_prefix))
                names += ", " + trigger.value.substr(trigger_prefix.size());
        }
    }
    return names;
}

}  // namespace

std::optional<const accel::AcceleratorFactory*> find_accelerator(const std::string& name,
                                                                 Diagnostics& diagnostics) {
    if (name == "bvh") return nullptr;
    const plugin::Registry registry(plugin::plugin_folders(), diagnostics);
    const plugin::Manifest* manifest =
        registry.find(accel::accelerator_interface, {"option", std::string(trigger_prefix) + name});
    if (!manifest) {
        diagnostics.error(
            "plugin-missing", {}, {},
            fmt::format("--accel {}: no plugin provides it; expected one of {}; searched {}", name,
                        known_names(registry), registry.searched()));
        return std::nullopt;
    }
    const void* object = plugin::open_interface(*manifest, accel::accelerator_interface,
                                                accel::accelerator_interface_version, diagnostics);
    if (!object) return std::nullopt;
    return static_cast<const accel::AcceleratorFactory*>(object);
}

}  // namespace velatura::render
