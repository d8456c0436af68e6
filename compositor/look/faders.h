// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/look/controls.h"
#include "compositor/look/row_names.h"

#include <array>
#include <cstddef>
#include <string>
#include <vector>

namespace velatura::compositor {
inline namespace look {

/// What a person turns at a row of a mixer: its light counts times gain and tint, or not at all.
struct Fader {
    std::string name;  ///< of a group or bounce
    float gain = 1;
    std::array<float, 3> tint = {1, 1, 1};
    bool is_muted = false;

    std::array<float, 3> factor() const;
};

/// A gain within a matte.
struct MattedFader {
    size_t matte = 0;
    std::string target;  ///< as typed
    std::array<float, 3> gain = {1, 1, 1};
    Selection cells;
};

/// The gains of a look as faders: what a bounce of a group counts is the product of `all`, its
/// group, its bounce and its cell, with the matted ones that select it.
struct Faders {
    Faders() = default;
    Faders(const std::vector<std::string>& columns, const std::vector<std::string>& group_names);

    /// Gain, tint, color temperature or mute: of everything, of whole groups, of whole bounces, or
    /// cell by cell, the first that says it.
    void apply(Control::Kind kind, const std::array<float, 3>& factor, const Selection& selected);
    /// What no solo names.
    void mute(const Selection& selected);

    std::array<float, 3> cell(size_t column, size_t group) const {
        return cells[column * groups.size() + group];
    }

    Fader all;
    std::vector<Fader> bounces, groups;       ///< at least one, without a name where there is none
    std::vector<std::array<float, 3>> cells;  ///< [column][group]
    std::vector<MattedFader> matted;
};

}  // namespace look
}  // namespace velatura::compositor
