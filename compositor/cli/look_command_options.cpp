// SPDX-License-Identifier: Apache-2.0
#include "compositor/cli/look_command_options.h"

#include "base/atomic_file.h"
#include "base/frames.h"
#include "compositor/cli/command_outcome.h"
#include "compositor/mix/fit_look.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstddef>

namespace velatura::compositor::cli {

namespace {

constexpr double largest_frame = 1e7;
constexpr size_t longest_preset = size_t(1) << 24;  // bytes

struct ControlOption {
    const char* name;
    Control::Kind kind;
    const char* help;
};

constexpr std::array control_options = {
    ControlOption{"--gain", Control::Kind::Gain,
                  "NAME=G: factor (2, 0.5) or stops (+1.5st, -1st); repeatable, as those below"},
    ControlOption{"--tint", Control::Kind::Tint, "NAME=R,G,B: factor per channel"},
    ControlOption{"--kelvin", Control::Kind::Kelvin, "NAME=K: tint of a black body against 6504 K"},
    ControlOption{"--mute", Control::Kind::Mute, "NAME: take it out"},
    ControlOption{"--solo", Control::Kind::Solo, "NAME: take everything else out"},
    ControlOption{"--shadow", Control::Kind::Shadow, "GROUP=X: lift its shadows by X from 0 to 1"},
    ControlOption{"--caster", Control::Kind::Caster,
                  "GROUP:CASTER=X: lift the shadow that CASTER casts in GROUP's light"},
    ControlOption{"--clamp", Control::Kind::Clamp,
                  "NAME=X: give back the share X of what a firefly clamp removed"},
};
constexpr const char* matte_option = "--matte";
constexpr const char* rows_option = "--rows";

/// Which option it was, with the value as it was typed.
Error named(const std::string& option, const std::string& text, const Error& error) {
    return {error.code, fmt::format("{} {}: {}", option, text, error.message)};
}

void add_repeatable(Command& command, const char* name, const char* help) {
    // Without a destination: values are read by typed_options(), since the order among options
    // counts
    command.add_option(name, help).expected(1).take_all().type_name("TEXT");
}

}  // namespace

void LookOptions::add_to(Command& command) {
    command_ = command;
    for (const ControlOption& o : control_options) add_repeatable(command, o.name, o.help);
    add_repeatable(command, matte_option,
                   "LAYER:PATTERN of a Cryptomatte or FILE.exr:CHANNEL; with ! before it, all "
                   "else: restricts the control before it");
    add_repeatable(command, rows_option,
                   "NAME=ROW,ROW: a name for several rows, whose gain is their master");
    command.add_option("--exposure", exposure, "Stops on everything, from -64 to 64")
        .range(-largest_stops, largest_stops);
    command.add_option("--preset", preset, "Look to start from (JSON)").reads();
    command.add_option("--frame", frame, "Frame at which keys are read");
    command.add_option("--input-space", input_space,
                       "Color space of the file, where it does not say it or is wrong: one of "
                       "$OCIO, or lin_rec709, ACEScg, ACES2065-1, lin_p3d65, lin_rec2020");
    command.add_flag("--lenient", is_lenient,
                     "Leave out, with a warning, what the look asks for and the file lacks");
    command.footer(
        "NAME is a light group, b0, b1, ..., tail, direct (b1), indirect (b2 to tail), env (all "
        "domes), emissive,\n"
        "shadow (a gain on it is the strength that is left), all, GROUP:BOUNCE, or one of --rows.\n"
        "A row that is called like one of these words is that row; commas within the names of "
        "rows\n"
        "and mattes are typed as \\,.\n"
        "A VALUE may have keys, VALUE@FRAME,VALUE@FRAME: linear between them.");
}

Result<Look> LookOptions::look() const {
    Look look;
    if (!preset.empty()) {
        const auto text = read_file(preset, longest_preset);
        if (!text) return text.error();
        auto loaded = look_from_json(*text);
        if (!loaded) return Error{loaded.error().code, preset + ": " + loaded.error().message};
        look = std::move(*loaded);
    }
    Control* last = nullptr;
    for (const auto& [name, text] : command_->typed_options()) {
        if (name == rows_option) {
            if (auto added = add_rows(look, text); !added) return named(name, text, added.error());
        } else if (name == matte_option) {
            if (!last) return Error{"bad-matte", "--matte " + text + " has no control before it"};
            if (!last->matte.empty())
                return Error{"bad-matte",
                             fmt::format("--matte {}: --{} {} is within {} already", text,
                                         name_of(last->kind), last->target, last->matte)};
            last->matte = text;
        }
        for (const ControlOption& o : control_options) {
            if (name != o.name) continue;
            auto control = parse_control(o.kind, text);
            if (!control) return named(name, text, control.error());
            look.controls.push_back(std::move(*control));
            last = &look.controls.back();
        }
    }
    look.exposure_stops += exposure;
    look.input_space = input_space;
    if (std::abs(look.exposure_stops) > largest_stops)
        return Error{"bad-gain",
                     fmt::format("the preset's exposure and --exposure come to {:+} stops; {} are "
                                 "the most",
                                 look.exposure_stops, largest_stops)};
    return look;
}

Result<Look> LookOptions::look_of_frame() const {
    auto asked = look();
    if (!asked || !has_keys(*asked)) return asked;
    if (!frame) return Error{"no-frame", "the look has keys; say at which --frame"};
    return look_at(std::move(*asked), *frame);
}

Result<Look> LookOptions::look_at_frame(int frame_of_sequence) const {
    auto asked = look();
    if (!asked || !has_keys(*asked)) return asked;
    return look_at(std::move(*asked), frame_of_sequence);
}

Result<std::string> LookOptions::input_of_frame(const std::string& input) const {
    if (!is_sequence(input)) return input;
    if (!frame || *frame != std::floor(*frame) || std::abs(*frame) > largest_frame)
        return Error{"no-frame", input + " is a sequence: say which --frame of it, a whole number"};
    return frame_file(input, int(*frame));
}

Look LookOptions::fitted(const LayerStack& stack, const Look& look) const {
    if (!is_lenient) return look;
    mix::FittedLook fitted = mix::fit_look(stack, look);
    for (const std::string& line : fitted.left_out) warn("left out " + line);
    return std::move(fitted.look);
}

}  // namespace velatura::compositor::cli
