// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "../media/grid_fixtures.h"
#include "test_scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace velatura::test {

using media::testing::add_field;
using media::testing::add_volume;
using media::testing::constant_box;
using media::testing::make_voxel_grid;
using scene::LightKind;

/// Lumps of smoke in a box of edge 2 around z = −4, soft at its sides.
inline scene::VoxelGrid smoke(float density) {
    constexpr int n = 40;
    scene::VoxelGrid grid = make_voxel_grid(scene::Vec3i(n), 2.0f / n, [&](int x, int y, int z) {
        return density * std::max(0.0f, std::sin(0.4f * float(x)) * std::sin(0.5f * float(y)) +
                                            0.6f * std::sin(0.3f * float(z)));
    });
    Mat4d moved;
    moved.translate(Vec3d(-1, -1, -5));
    grid.volume_from_lattice = grid.volume_from_lattice * moved;
    return grid;
}

/// A slab from z = −3 to z = −2, as wide as 200.
inline scene::Volume& add_slab(TestScene& test, float tau) {
    return add_volume(test.scene, constant_box(Vec3d(-100, -100, -3), Vec3d(100, 100, -2), tau));
}

/// Light along −z, irradiance 1 on what faces it; it comes from behind the camera.
inline scene::Light& add_sun(TestScene& test) {
    scene::Light& sun = test.add_light(LightKind::Distant, Mat4d());
    sun.angle_deg = 0.0f;
    return sun;
}

inline TestScene furnace(const scene::VolumeOptics& optics, float density = 6.0f) {
    TestScene test;
    add_volume(test.scene, smoke(density)).optics = optics;
    test.add_light(LightKind::Dome, Mat4d()).is_camera_visible = true;
    test.look_with_perspective(0.2);
    return test;
}

inline scene::VolumeOptics white(float g, const Rgb& extinction = Rgb(1.0f)) {
    scene::VolumeOptics optics;
    optics.albedo = Rgb(1.0f);
    optics.anisotropy = g;
    optics.extinction_color = extinction;
    return optics;
}

inline const integrator::EstimatorOptions by_paths{.light_sampling =
                                                       integrator::LightSampling::Bsdf};

/// MIS, BSDF sampling and light sampling give one image, and the first two the same layers from
/// `first_bounce` on.
inline void expect_strategies_agree(const TestScene& test, int first_bounce) {
    const RenderedLayers both = render(test, {.size = 24, .samples = 192});
    const RenderedLayers paths =
        render(test, {.size = 24, .samples = 192, .estimator = by_paths, .seed = 2});
    const RenderedLayers lamps =
        render(test, {.size = 24,
                      .samples = 192,
                      .estimator = {.light_sampling = integrator::LightSampling::Light},
                      .seed = 3});
    expect_agreement(both, paths, 1.2e-1, "MIS and paths alone");
    expect_agreement(both, lamps, 6e-2, "MIS and light sampling alone");
    for (int k = first_bounce; k <= 3; ++k) {
        const Estimate a = both.bounce(k), b = paths.bounce(k);
        EXPECT_NEAR(a.mean, b.mean, 4.0 * std::hypot(a.standard_error, b.standard_error)) << k;
    }
}

}  // namespace velatura::test
