// SPDX-License-Identifier: Apache-2.0
#include "app/volume_loading.h"

#include "base/asset_roots.h"
#include "media/load_volumes.h"
#include "plugin/registry.h"

namespace velatura::app {

namespace {

const plugin::Need need = {media::volume_source_interface,
                           media::volume_source_interface_version,
                           {"effect", "volumes"},
                           "volume"};

/// The grids of files that the scene may name.
class AdmittedGrids final : public media::VolumeSource {
  public:
    explicit AdmittedGrids(const media::VolumeSource& source) : source_(source) {}

    Result<scene::VoxelGrid> read(const media::GridRequest& request) const override {
        if (request.file.empty()) return source_.read(request);
        Result<std::string> file = admit_asset(request.file);
        if (!file) return Error{"volume-file", file.error().message};
        media::GridRequest admitted = request;
        admitted.file = *std::move(file);
        return source_.read(admitted);
    }

  private:
    const media::VolumeSource& source_;
};

}  // namespace

void load_volumes(scene::Scene& scene, std::optional<double> most_gb, Diagnostics& diagnostics) {
    if (!media::needs_grids(scene)) return;
    const Result<const void*> object = plugin::open_needed(need);
    if (!object) {
        media::drop_volumes(scene, object.error(), diagnostics);
        return;
    }
    const size_t most = most_gb ? size_t(*most_gb * 1e9) : media::usual_volume_bytes();
    const AdmittedGrids source(*static_cast<const media::VolumeSource*>(*object));
    media::load_volumes(scene, source, most, diagnostics);
}

}  // namespace velatura::app
