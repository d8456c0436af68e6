// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "integrator/path.h"

namespace velatura::integrator {

/// At a dispersive surface: gives the path a wavelength, unless it has one. One channel is drawn in
/// proportion to Path::beta, then a wavelength of its band. Returns: whether Path::channel_beyond
/// was drawn.
bool choose_wavelength(const World& world, Path& path, scene::MaterialId material);

/// Light of the drawn channel alone.
inline Rgb in_channel(const Rgb& light, const Path& path) {
    Rgb out(0.0f);
    out[path.channel_beyond] = light[path.channel_beyond] * path.channel_scale;
    return out;
}

/// Leaves light of the drawn channel alone, if one is.
inline void keep_channel(Path& path) {
    if (path.channel_beyond < 0) return;
    path.beta = in_channel(path.beta, path);
    path.channel_beyond = -1;
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
