// SPDX-License-Identifier: Apache-2.0
#include "built_plugin.h"
#include "fuzz_targets.h"
#include "media/volume_source.h"
#include "temporary_file.h"

#include <cmath>
#include <cstdlib>

namespace velatura::fuzz {

/// Any bytes are a .vdb file whose grid is read into what may be walked through, or refused;
/// OpenVDB, which reads it, costs no more than the process that it runs in.
void volume(std::string_view bytes) {
    static const auto* source = static_cast<const media::VolumeSource*>(
        built_interface(media::volume_source_interface, media::volume_source_interface_version,
                        "effect", "volumes"));
    if (source == nullptr) return;
    const std::string file = memory_file("fuzz.vdb", bytes);
    const auto grid = source->read(
        {.file = file, .kind = scene::GridKind::AsStored, .max_bytes = size_t(64) << 20});
    if (!grid) return;
    for (const uint32_t id : grid->nodes)
        if ((id & scene::VoxelGrid::is_node) == 0 && id >= grid->bricks.size()) std::abort();
    for (const float value : grid->values)
        if (!std::isfinite(value) || (!grid->is_level_set && value < 0.0f)) std::abort();
}

}  // namespace velatura::fuzz
