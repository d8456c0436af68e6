// SPDX-License-Identifier: Apache-2.0
#include "render/volume_loading.h"

#include "base/asset_roots.h"
#include "base/process/memory_limit.h"
#include "media/load_volumes.h"
#include "plugin/registry.h"

#include <new>

namespace velatura::render {

namespace {

const plugin::Need volume_need = {media::volume_source_interface,
                                  media::volume_source_interface_version,
                                  {"effect", "volumes"},
                                  "volume"};

/// The grids of files that the scene may name.
class AdmittedGrids final : public media::VolumeSource {
  public:
    /// `can_be_omitted`: grids that memory does not suffice for; else std::bad_alloc is thrown.
    AdmittedGrids(const media::VolumeSource& source, bool can_be_omitted)
        : source_(source), can_be_omitted_(can_be_omitted) {}

    Result<scene::VoxelGrid> read(const media::GridRequest& request) const override {
        if (request.file.empty()) return source_.read(request);
        Result<std::string> file = admit_asset(request.file);
        if (!file) return Error{"volume-file", file.error().message};
        media::GridRequest admitted = request;
        admitted.file = *std::move(file);
        Result<scene::VoxelGrid> grid = source_.read(admitted);
        if (!grid && grid.error().code == "volume-memory" && !can_be_omitted_)
            throw std::bad_alloc();
        return grid;
    }

  private:
    const media::VolumeSource& source_;
    bool can_be_omitted_;
};

}  // namespace

void load_volumes(scene::Scene& scene, std::optional<double> max_gb, Diagnostics& diagnostics) {
    if (!media::needs_grids(scene)) return;
    const Result<const void*> object = plugin::open_needed(volume_need);
    if (!object) {
        media::drop_volumes(scene, object.error(), diagnostics);
        return;
    }
    const size_t max = max_gb ? size_t(*max_gb * 1e9) : MemoryLimit::allowed() / 2;
    // Without a volume it would be another image: only who says what volumes may take wants that
    const AdmittedGrids source(*static_cast<const media::VolumeSource*>(*object),
                               max_gb.has_value() || !MemoryLimit::is_set());
    media::load_volumes(scene, source, max, diagnostics);
}

}  // namespace velatura::render
