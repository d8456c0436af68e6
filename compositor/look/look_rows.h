// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/io/layer_stack.h"
#include "compositor/look/controls.h"

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace velatura::compositor {
inline namespace look {

/// What the mixer has a row for: targets of controls.
struct MixerRows {
    std::vector<std::string> lights;   ///< `all`, `env` where there are domes, every light group
    std::vector<std::string> bounces;  ///< `direct`, `indirect`, then one by one; empty: not stored
    std::vector<std::string> lobes;    ///< empty: no lobe matrix is stored
    std::vector<std::string> groups, columns;  ///< of the cells; empty where no matrix is stored
    std::vector<std::string> shadows;          ///< groups with a stored shadow
    std::vector<std::string> casters;  ///< `group:caster` of those that are stored one by one
    std::vector<std::string> clamps;   ///< `all` and every light group where a clamp took light

    /// True if a control of that kind has its place in a row.
    bool has_place(Control::Kind kind, const std::string& target) const;
};

MixerRows mixer_rows(const LayerStack& stack);

/// A name as the row shows it: `all light` for `all`.
std::string row_title(const std::string& target);

/// What a row is about: a target of controls, and where they act.
struct RowTarget {
    std::string name;
    std::string matte = {};  ///< empty: everywhere

    // From a name alone, as most rows are about the whole image
    RowTarget(const std::string& target) : name(target) {}

    RowTarget(const char* target) : name(target) {}

    RowTarget(const std::string& target, const std::string& within) : name(target), matte(within) {}
};

/// How one target stands in a look. A look is a list of controls; the row of a target shows, and
/// edits in place, the first control of each kind that names it, acts within that matte and has no
/// keys, so that whatever else a preset says, and its order, stays as it was.
struct RowState {
    bool is_muted = false, is_soloed = false;
    float stops = 0;  ///< −∞ for a factor of 0
    std::array<float, 3> tint = {1, 1, 1};
    std::optional<float> kelvin;

    bool operator==(const RowState&) const = default;
};

RowState row_state(const Look& look, const RowTarget& target);

// Numbers that are not finite, which a box takes when they are typed, change nothing.

/// Rounded to what the row shows, 0.01 stops, and kept within what a control takes. 0 takes the
/// control away.
void set_stops(Look& look, const RowTarget& target, float stops);
void set_muted(Look& look, const RowTarget& target, bool is_muted);
void set_soloed(Look& look, const RowTarget& target, bool is_soloed);
/// Soloes the target alone, or nothing when it is the only one already.
void toggle_only_solo(Look& look, const RowTarget& target);
void set_tint(Look& look, const RowTarget& target, const std::array<float, 3>& tint);
/// Rounded to 10 K and kept within what a control takes; none takes the control away.
void set_kelvin(Look& look, const RowTarget& target, std::optional<float> kelvin);

/// What is given back of a shadow (Shadow, Caster) or of what a clamp took (Clamp), 0 … 1.
float share_given(const Look& look, Control::Kind kind, const RowTarget& target);
/// Rounded to a hundredth.
void set_share(Look& look, Control::Kind kind, const RowTarget& target, float share);

/// Takes away everything that the row of the target shows.
void reset_row(Look& look, const RowTarget& target);

/// Indices of the controls that no row shows, neither everywhere nor within `matte`: repeated ones,
/// those with other mattes or with keys, sets of rows, and names that this file has not.
std::vector<size_t> advanced_controls(const Look& look,
                                      const MixerRows& rows,
                                      const std::string& matte = {});

/// A control as a line: `gain key:b2 +1.5st`.
std::string control_text(const Control& control);

/// True if they are saved as the same text.
bool same_look(const Look& a, const Look& b);

/// What a box of stops takes: `1.5`, `+1.5`, `1.5 st` are stops, `2x`, `x2`, `×2` a multiplier.
/// Returns: stops, −∞ for a multiplier of 0; none for anything else, as while it is being typed.
std::optional<float> stops_of_text(std::string_view text);

}  // namespace look
}  // namespace velatura::compositor
