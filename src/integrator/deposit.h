// SPDX-License-Identifier: Apache-2.0
// Where the light of a path goes; inlined into every vertex.
#pragma once

#include "film/sample_radiance.h"
#include "integrator/path.h"

#include <limits>

namespace velatura::integrator {

/// Adds light to the layers of (bounce, group), and tells the observer.
/// is_sharp: the path met it itself, after mirrors and smooth glass alone. That has no fireflies:
/// clamps of later bounces leave a lamp behind a pane as it is.
inline void deposit(const Path& path,
                    int bounce,
                    scene::GroupId group,
                    const Rgb& radiance,
                    const char* what,
                    film::SampleRadiance& out,
                    bool is_sharp = false) {
    if (is_black(radiance)) return;
    const bool has_limit = !is_sharp || bounce <= 1;
    constexpr float without_limit = std::numeric_limits<float>::infinity();
    out.add(bounce, int(group), radiance, has_limit ? path.share : without_limit);
    if (path.observer && !has_limit) path.observer->on_unlimited();
    if (path.observer) path.observer->on_deposit(bounce, group, radiance, what);
}

/// The last scattering's parts count by the multipliers, each kind by its own.
template <class Give>
void give_hit(film::PathLabels* labels,
              bool is_weighed,
              const lights::LobeMultipliers& multipliers,
              const Give& give) {
    if (labels && is_weighed) labels->weigh(multipliers.diffuse, multipliers.specular);
    give();
    if (labels && is_weighed) labels->stay();
}

/// Deposits light that the path met and that counts by multipliers.
inline void deposit_hit(const World& world,
                        const Path& path,
                        scene::GroupId group,
                        const Rgb& radiance,
                        const lights::LobeMultipliers& multipliers,
                        const char* what,
                        film::SampleRadiance& out) {
    give_hit(out.labels(), world.has_lobe_multipliers && path.bounce > 0, multipliers,
             [&] { deposit(path, path.bounce, group, radiance, what, out, path.is_sharp); });
}

/// The same of the unoccluded layers.
inline void add_unoccluded_hit(const World& world,
                               scene::GroupId group,
                               const Rgb& radiance,
                               const lights::LobeMultipliers& multipliers,
                               film::SampleRadiance& out) {
    if (is_black(radiance)) return;
    give_hit(out.labels(), world.has_lobe_multipliers, multipliers,
             [&] { out.add_unoccluded(int(group), radiance); });
}

}  // namespace velatura::integrator
