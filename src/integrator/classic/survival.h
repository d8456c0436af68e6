// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace velatura::integrator::classic {

/// By what the last scattering and the way there left.
constexpr float albedo_survival(float carried, float carried_before) {
    return carried / carried_before;
}

/// Whatever the path carries.
inline constexpr float constant_survival = 0.75f;

/// No roulette: a path ends below a share of what it began with. A bias.
constexpr bool survives_cutoff(float carried, float cutoff) {
    return !(carried < cutoff);
}

}  // namespace velatura::integrator::classic
