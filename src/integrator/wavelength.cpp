// SPDX-License-Identifier: Apache-2.0
#include "integrator/wavelength.h"

#include "scene/effect_calls.h"
#include "shading/dispersion.h"

namespace velatura::integrator {

void choose_wavelength(const World& world, Path& path, scene::MaterialId material) {
    if (path.spread != 0.0f || !world.materials.is_dispersive(material)) return;
    const float sum = path.beta.x + path.beta.y + path.beta.z;
    if (!(sum > 0.0f)) return;
    scene::count_call(scene::Effect::Dispersion);
    const Vec2 u = path.sampler.get_2d(path.bounce, sampling::Purpose::Wavelength, path.pass_count);
    float rest = u.x * sum;
    int channel = 0;
    while (channel < 2 && !(rest < path.beta[channel])) rest -= path.beta[channel++];
    // Rounding of the sum falls to the last channel that has a share
    while (channel > 0 && !(path.beta[channel] > 0.0f)) --channel;
    path.channel_beyond = channel;
    path.channel_scale = sum / path.beta[channel];
    path.spread = shading::spread_of(
        shading::sample_wavelength(world.materials.wavelengths_of(channel), u.y));
    // 0 means none
    if (path.spread == 0.0f) path.spread = 1e-9f;
}

}  // namespace velatura::integrator
