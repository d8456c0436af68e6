// SPDX-License-Identifier: Apache-2.0
// What becomes of volumes whose grids can and cannot be read.
#include "media/load_volumes.h"

#include "grid_fixtures.h"

#include <gtest/gtest.h>

#include <vector>

namespace velatura::media {
namespace {

/// Gives a box of ones for files called good.
class FakeSource final : public VolumeSource {
  public:
    Result<scene::VoxelGrid> read(const GridRequest& request) const override {
        asked.push_back(request);
        if (request.file != "good") return Error{"volume-file", "cannot be opened"};
        return testing::make_voxel_grid(scene::Vec3i(4), 1.0f, [](int, int, int) { return 1.0f; });
    }

    mutable std::vector<GridRequest> asked;
};

uint32_t add_unread(scene::Scene& scene, const char* file) {
    scene::VolumeField field;
    field.file = field.authored = file;
    scene.volume_fields.push_back(field);
    return uint32_t(scene.volume_fields.size() - 1);
}

scene::Volume volume_of(uint32_t density) {
    scene::Volume volume;
    volume.name = "/Smoke";
    volume.density = density;
    return volume;
}

}  // namespace

TEST(LoadVolumes, ReadsWhatIsSeenOnce) {
    scene::Scene scene;
    scene.volumes = {volume_of(add_unread(scene, "good")), volume_of(0),
                     volume_of(add_unread(scene, "never"))};
    scene.volumes[2].optics.density_scale = 0.0f;
    FakeSource source;
    Diagnostics diagnostics;
    EXPECT_TRUE(needs_grids(scene));
    load_volumes(scene, source, 1 << 20, diagnostics);
    EXPECT_FALSE(needs_grids(scene));
    EXPECT_EQ(source.asked.size(), 1u);
    EXPECT_EQ(scene.volumes.size(), 3u);
    EXPECT_EQ(diagnostics.error_count(), 0u);
    // What is there counts against what may still be taken
    EXPECT_EQ(source.asked[0].max_bytes, size_t(1) << 20);
}

TEST(LoadVolumes, LosesAVolumeAndNoMore) {
    scene::Scene scene;
    scene.volumes = {volume_of(add_unread(scene, "good")), volume_of(add_unread(scene, "bad")),
                     volume_of(0)};
    scene.volumes[2].temperature = 1;
    FakeSource source;
    Diagnostics diagnostics;
    load_volumes(scene, source, 1 << 20, diagnostics);
    EXPECT_EQ(scene.volumes.size(), 1u);
    ASSERT_EQ(diagnostics.error_count(), 1u);
    EXPECT_EQ(diagnostics.all()[0].message, "@bad@: cannot be opened; the volume is skipped");
    ASSERT_EQ(scene.effect_notes.size(), 1u);
    EXPECT_EQ(scene.effect_notes[0].prims, 2u);
}

TEST(LoadVolumes, WithoutAnyoneToReadAllGridsAreLost) {
    scene::Scene scene;
    scene.volumes = {volume_of(add_unread(scene, "good")), volume_of(0)};
    Diagnostics diagnostics;
    drop_volumes(scene, {"plugin-missing", "plugin volume is missing"}, diagnostics);
    EXPECT_TRUE(scene.volumes.empty());
    EXPECT_EQ(diagnostics.error_count(), 1u);
}

}  // namespace velatura::media
