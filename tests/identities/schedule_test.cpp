// SPDX-License-Identifier: Apache-2.0
// One image, however it was made: mode, threads, tile size and order of passes leave every bit
// alone.
#include "integrator/schedule.h"

#include "usd_render.h"

#include <gtest/gtest.h>

namespace velatura::test {

namespace {

integrator::RenderOptions options_of(integrator::RenderMode mode, int tile_size) {
    integrator::RenderOptions options;
    options.mode = mode;
    options.tile_size = tile_size;
    options.end_sample = 11;  // not a power of two: the canonical nodes are [0,8) [8,10) [10,11)
    options.seed = 5;
    return options;
}

}  // namespace

TEST(Schedule, ModesThreadsAndTilesGiveTheSameBits) {
    // Wider than any of the tiles
    const scene::Scene scene = scene_from_usda(room_usda(), 72, 34);
    const uint64_t expected =
        fingerprint(render_scene(scene, options_of(integrator::RenderMode::Tile, 16), 1));
    for (const integrator::RenderMode mode :
         {integrator::RenderMode::Tile, integrator::RenderMode::Progressive}) {
        for (const int threads : {1, 2, 3, 7}) {
            for (const int tile : {8, 16, 33, 64}) {
                EXPECT_EQ(fingerprint(render_scene(scene, options_of(mode, tile), threads)),
                          expected)
                    << "mode " << int(mode) << ", threads " << threads << ", tile " << tile;
            }
        }
    }
}

TEST(Schedule, QualitiesOfTheTreeGiveTheSameBits) {
    const scene::Scene scene = scene_from_usda(room_usda(), 40, 34);
    const integrator::RenderOptions options = options_of(integrator::RenderMode::Tile, 16);
    const uint64_t expected = fingerprint(render_scene(scene, options));
    for (const accel::BvhQuality quality : {accel::BvhQuality::Fast, accel::BvhQuality::High}) {
        EXPECT_EQ(fingerprint(render_scene(scene, options, RenderSetup{.bvh_quality = quality})),
                  expected)
            << accel::name_of(quality);
    }
}

TEST(Schedule, ShortPassesGiveTheSameBits) {
    const scene::Scene scene = scene_from_usda(room_usda(), 20, 16);
    integrator::RenderOptions options = options_of(integrator::RenderMode::Progressive, 32);
    const uint64_t expected = fingerprint(render_scene(scene, options));
    options.snapshot_interval_s = 1e-9;  // forces passes of one sample
    EXPECT_EQ(fingerprint(render_scene(scene, options)), expected);
}

TEST(Schedule, AnotherSeedGivesOtherBits) {
    const scene::Scene scene = scene_from_usda(room_usda(), 20, 16);
    integrator::RenderOptions options = options_of(integrator::RenderMode::Tile, 32);
    const uint64_t first = fingerprint(render_scene(scene, options));
    options.seed = 6;
    EXPECT_NE(fingerprint(render_scene(scene, options)), first);
}

TEST(Schedule, PassesDoubleAndStayAligned) {
    constexpr uint64_t any = ~uint64_t(0);
    EXPECT_EQ(integrator::pass_end(0, 64, any), 1u);
    EXPECT_EQ(integrator::pass_end(1, 64, any), 2u);
    EXPECT_EQ(integrator::pass_end(2, 64, any), 4u);
    EXPECT_EQ(integrator::pass_end(32, 48, any), 48u);
    EXPECT_EQ(integrator::pass_end(32, 64, 5), 36u);
    EXPECT_EQ(integrator::pass_end(6, 64, any), 8u);
}

}  // namespace velatura::test
