// SPDX-License-Identifier: Apache-2.0
#include "app/volume_loading.h"

#include "media/load_volumes.h"
#include "plugin/registry.h"

namespace velatura::app {

namespace {

const plugin::Need need = {media::volume_source_interface,
                           media::volume_source_interface_version,
                           {"effect", "volumes"},
                           "volume"};

}  // namespace

void load_volumes(scene::Scene& scene, std::optional<double> most_gb, Diagnostics& diagnostics) {
    if (!media::needs_grids(scene)) return;
    const Result<const void*> object = plugin::open_needed(need);
    if (!object) {
        media::drop_volumes(scene, object.error(), diagnostics);
        return;
    }
    const size_t most = most_gb ? size_t(*most_gb * 1e9) : media::usual_volume_bytes();
    media::load_volumes(scene, *static_cast<const media::VolumeSource*>(*object), most,
                        diagnostics);
}

}  // namespace velatura::app
