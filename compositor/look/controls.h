// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "image/primaries.h"

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace velatura::compositor {
inline namespace look {

/// A value at a frame, as numbers between which values are interpolated linearly.
struct Keyframe {
    double frame = 0;
    std::array<float, 3> numbers = {1, 1, 1};  ///< factors, stops or kelvin

    bool operator==(const Keyframe&) const = default;
};

/// Of a gain, of the gains of a layer together, and of the exposure: floats bear it, and no image
/// needs it.
inline constexpr float largest_stops = 64;
inline constexpr float largest_factor = 0x1p64f;

/// One thing that an artist did to a target: a group, `bK`, `tail`, `direct`, `indirect`, `env`,
/// `shadow`, `all`, `group:bK` (`group:direct`, `env:indirect` …), a named set of rows, or
/// `group:caster` for the shadow of a caster.
struct Control {
    enum class Kind : uint8_t { Gain, Tint, Kelvin, Mute, Solo, Shadow, Caster, Clamp };
    Kind kind = Kind::Gain;
    std::string target;
    std::string value;  ///< as typed: `+1.5st`, `1,.9,.8`, `1@1,2@24`; empty for mute and solo
    /// What it means, with keys at the first of them; for Shadow, Caster and Clamp the share given
    /// back, 0 … 1, in all three.
    std::array<float, 3> factor = {1, 1, 1};
    std::string matte = {};           ///< where it acts (mattes.h); empty = everywhere
    std::vector<Keyframe> keys = {};  ///< by frame; empty = the same in every frame
    bool keys_are_stops = false;
    float kelvin = 0;  ///< of Kelvin, as factor; that one is for linear Rec.709
};

/// A look: what `--preset` loads and `--save-preset` saves.
struct Look {
    std::vector<Control> controls;
    float exposure_stops = 0;  ///< at most largest_stops either way
    std::string display, view;
    /// Color space of the file, where that is not to say it (image/file_color.h). Not in presets:
    /// it is no matter of the look.
    std::string input_space = {};
    /// Names that stand for several rows: a control of one of them is their master.
    std::map<std::string, std::vector<std::string>> rows = {};
};

/// `2`, `0.5`, `+1.5st`, `-1st` as a factor, of largest_stops at most. `+1.5` may mean either and
/// is refused. Errors: "bad-gain".
Result<float> parse_gain(const std::string& text);

/// Reads `NAME=VALUE` (`NAME` for mute and solo); a value may be `VALUE@FRAME,VALUE@FRAME …`. A
/// name may hold `=` itself: the last one counts. Errors: "bad-gain".
Result<Control> parse_control(Control::Kind kind, const std::string& text);

/// The same of a name, whatever it holds, and a value (empty for mute and solo).
Result<Control> make_control(Control::Kind kind,
                             const std::string& target,
                             const std::string& value);

/// `gain`, `tint` … `clamp`.
const char* name_of(Control::Kind kind);

/// Reads `NAME=ROW,ROW …` into the look's rows; `\,` is a comma within a row's name.
/// Errors: "bad-gain".
Result<void> add_rows(Look& look, const std::string& text);

/// The same of a name and rows. Errors: "bad-gain".
Result<void> add_rows(Look& look, const std::string& name, std::vector<std::string> rows);

/// `a,b\,c` → `a` and `b,c`: at commas without a backslash, which is taken off before commas alone.
std::vector<std::string> split_at_commas(std::string_view text);

/// True if a control has keys: the look needs a frame.
bool has_keys(const Look& look);

/// The look with every keyed control at its value of the frame: linear between keys, in stops where
/// all keys are, and held before the first and after the last.
Look look_at(Look look, double frame);

/// Linear Rec.709 tint of a black body against 6504 K, luminance 1; kelvin in [1667, 25000].
/// Ref: Kim et al. 2002, US patent 7024034 (cubic approximation of the Planckian locus).
std::array<float, 3> kelvin_tint(float kelvin);

/// The same color in the numbers of a file.
std::array<float, 3> kelvin_tint(float kelvin, const image::ColorMatrix& file_from_rec709);

std::string look_to_json(const Look& look);
/// Errors: "bad-preset".
Result<Look> look_from_json(const std::string& text);

/// What makes of the one look the other: a line for each control that was added (+), taken away (-)
/// or changed, for rows, exposure, display and view. Empty where both do the same.
std::vector<std::string> look_differences(const Look& a, const Look& b);

}  // namespace look
}  // namespace velatura::compositor
