// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace velatura::translate::lights {

/// Which lights share a row of the mixer.
enum class LightGrouping : unsigned char {
    PerLight,  ///< a named group where the scene names one, else one row per light prim
    Groups,    ///< named groups only; all other lights are `rest`
    Off,       ///< every light is `rest`
};

}  // namespace velatura::translate::lights
