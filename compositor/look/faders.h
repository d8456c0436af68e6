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
    std::string name;  ///< of a group, bounce or lobe
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

/// The gains of a look as faders: what a lobe of a bounce of a group counts is the product of
/// `all`, its group, its bounce, its lobe and its cell, with the matted ones that select it.
struct Faders {
    Faders() = default;
    Faders(const std::vector<std::string>& columns,
           const std::vector<std::string>& group_names,
           const std::vector<std::string>& lobe_names);

    /// Gain, tint, color temperature or mute: of everything, of whole groups, of whole bounces, of
    /// whole lobes, or cell by cell, the first that says it.
    void apply(Control::Kind kind, const std::array<float, 3>& factor, const Selection& selected);
    /// What no solo names.
    void mute(const Selection& selected);

    /// As Selection.
    size_t place(size_t column, size_t group, size_t lobe) const {
        return (column * groups.size() + group) * lobes.size() + lobe;
    }

    /// The product of all that counts for a cell but for mattes.
    std::array<float, 3> factor(size_t column, size_t group, size_t lobe) const;

    Fader all;
    std::vector<Fader> bounces, groups,
        lobes;                                ///< at least one, without a name where there is none
    std::vector<std::array<float, 3>> cells;  ///< as Selection
    std::vector<MattedFader> matted;
};

}  // namespace look
}  // namespace velatura::compositor
