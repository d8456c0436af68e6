// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"

#include <array>
#include <string>
#include <vector>

namespace velatura::compositor {

/// One thing an artist did to a target: a group, `bK`, `tail`, `direct`, `indirect`, `env`,
/// `shadow`, `all`, or `group:bK` (`group:direct`, `env:indirect` …).
struct Control {
    enum class Kind : uint8_t { Gain, Tint, Kelvin, Mute, Solo, Shadow };
    Kind kind = Kind::Gain;
    std::string target;
    std::string value;  ///< as typed: `+1.5st`, `1,.9,.8`; empty for mute and solo
    std::array<float, 3> factor = {1, 1,
                                   1};  ///< what it means; for Shadow the lift 0 … 1 in all three
};

/// A look: what `--preset` loads and `--save-preset` saves.
struct Look {
    std::vector<Control> controls;
    float exposure_stops = 0;
    std::string display, view;
};

/// `2`, `0.5`, `+1.5st`, `-1st` as a factor. Errors: "bad-gain".
Result<float> parse_gain(const std::string& text);

/// Reads `NAME=VALUE` (`NAME` for mute and solo). Errors: "bad-gain".
Result<Control> parse_control(Control::Kind kind, const std::string& text);

/// Linear Rec.709 tint of a black body against 6504 K, luminance 1; kelvin in [1667, 25000].
/// Ref: Kim et al. 2002, US patent 7024034 (cubic approximation of the Planckian locus).
std::array<float, 3> kelvin_tint(float kelvin);

std::string look_to_json(const Look& look);
/// Errors: "bad-preset".
Result<Look> look_from_json(const std::string& text);

}  // namespace velatura::compositor
