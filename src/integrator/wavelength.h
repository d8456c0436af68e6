// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "integrator/path.h"

#include <utility>

namespace velatura::integrator {

/// At a dispersive surface: gives the path a wavelength, unless it has one. One channel is drawn in
/// proportion to Path::beta, then a wavelength of its band.
void choose_wavelength(const World& world, Path& path, scene::MaterialId material);

/// Leaves light of the drawn channel alone, if one is.
inline void keep_channel(Path& path) {
    const int channel = std::exchange(path.channel_beyond, -1);
    if (channel < 0) return;
    Rgb kept(0.0f);
    kept[channel] = path.beta[channel] * path.channel_scale;
    path.beta = kept;
}

/// The same where the path goes through the surface; what is reflected keeps its colors.
inline void settle_channel(Path& path, shading::ScatterKind kind) {
    if (path.channel_beyond < 0) return;
    if (kind == shading::ScatterKind::Transmit) {
        keep_channel(path);
    } else {
        path.spread = 0.0f;
        path.channel_beyond = -1;
    }
}

}  // namespace velatura::integrator
