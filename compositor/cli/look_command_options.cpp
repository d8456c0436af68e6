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
#include <utility>

namespace velatura::compositor::cli {

namespace {

constexpr double largest_frame = 1e7;
constexpr size_t longest_preset = size_t(1) << 24;  // bytes

struct ControlOption {
    const char* name;
    Control::Kind kind;
    const char* value;
    const char* help;
};

constexpr std::array control_options = {
    ControlOption{
        "--gain", Control::Kind::Gain, "NAME=G",
        "Gain of a light group, bounce, lobe or row: a factor (2, 0.5) or stops (+1.5st)"},
    ControlOption{"--tint", Control::Kind::Tint, "NAME=R,G,B", "Tint: a factor per channel"},
    ControlOption{"--kelvin", Control::Kind::Kelvin, "NAME=K",
                  "Color temperature: tint of a black body relative to 6504 K"},
    ControlOption{"--mute", Control::Kind::Mute, "NAME", "Mute"},
    ControlOption{"--solo", Control::Kind::Solo, "NAME", "Solo: mute everything else"},
    ControlOption{"--shadow", Control::Kind::Shadow, "GROUP=X",
                  "Shadow lift of a light group, 0 to 1"},
    ControlOption{"--caster", Control::Kind::Caster, "GROUP:CASTER=X",
                  "Shadow lift of one shadow caster in the light of a group, 0 to 1"},
    ControlOption{"--clamp", Control::Kind::Clamp, "NAME=X", "Undo X of the firefly clamp, 0 to 1"},
};
constexpr const char* matte_option = "--matte";
constexpr const char* rows_option = "--rows";

/// Which option it was, with the value as it was typed.
Error named(const std::string& option, const std::string& text, const Error& error) {
    return {error.code, fmt::format("{} {}: {}", option, text, error.message)};
}

void add_repeatable(Command& command, const char* name, const char* value, const char* help) {
    // Without a destination: values are read by typed_options(), since the order among options
    // counts
    command.add_option(name, help).expected(1).take_all().type_name(value);
}

}  // namespace

void LookOptions::add_to(Command& command) {
    command_ = command;
    for (const ControlOption& o : control_options) add_repeatable(command, o.name, o.value, o.help);
    add_repeatable(command, matte_option, "MATTE",
                   "Matte of the preceding option: LAYER:PATTERN of a Cryptomatte or "
                   "FILE.exr:CHANNEL; a leading ! inverts it");
    add_repeatable(command, rows_option, "NAME=ROW,ROW", "Master fader of several rows");
    command.add_option("--exposure", exposure, "Exposure of the image, in stops")
        .range(-largest_stops, largest_stops);
    command.add_option("--preset", preset, "Preset (JSON) that the other options change")
        .type_name("FILE")
        .reads();
    command.add_option("--frame", frame, "Frame at which keyed values are read");
    command
        .add_option("--input-space", input_space,
                    "Color space of the file, overrides its header: one of $OCIO, or "
                    "lin_rec709, ACEScg, ACES2065-1, lin_p3d65, lin_rec2020")
        .type_name("SPACE")
        .default_text("that of the header");
    command.add_flag("--lenient", is_lenient,
                     "Skip, with a warning, what the preset names and the file lacks");
    command.footer(
        "NAME: a light group, b0, b1, ..., tail, direct (b1), indirect (b2 to tail), env (all "
        "domes), emissive, shadow (its gain is the remaining strength), all, GROUP:BOUNCE, or one "
        "of --rows. A row of that name comes first. Commas in names of rows and mattes are "
        "typed \\,.\n"
        "Keyed values: VALUE@FRAME,VALUE@FRAME, linear between keys.");
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
            if (!last)
                return Error{"bad-matte", "--matte " + text +
                                              " has no option before it that it could limit; put "
                                              "it after one, e.g. --gain key=2 --matte " +
                                              text};
            if (!last->matte.empty())
                return Error{"bad-matte",
                             fmt::format("--matte {}: --{} {} has the matte {} already", text,
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
                     fmt::format("exposure of the preset and --exposure add up to {:+} stops; the "
                                 "maximum is {}",
                                 look.exposure_stops, largest_stops)};
    return look;
}

Result<Look> LookOptions::look_of_frame() const {
    auto asked = look();
    if (!asked || !has_keys(*asked)) return asked;
    if (!frame)
        return Error{"no-frame", "the preset has keyed values; choose a frame with --frame N"};
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
        return Error{"no-frame",
                     input + " is a sequence; choose a frame with --frame N, a whole number"};
    return frame_file(input, int(*frame));
}

Result<OpenedMix> LookOptions::open(const std::string& input) const {
    const auto asked = look_of_frame();
    if (!asked) return asked.error();
    auto file = input_of_frame(input);
    if (!file) return file.error();
    auto stack = LayerStack::load(*file);
    if (!stack) return stack.error();
    Look look = fitted(*stack, *asked);
    return OpenedMix{std::move(*file), std::move(*stack), std::move(look)};
}

Look LookOptions::fitted(const LayerStack& stack, const Look& look) const {
    if (!is_lenient) return look;
    mix::FittedLook fitted = mix::fit_look(stack, look);
    for (const std::string& line : fitted.omitted) warn("skipped " + line);
    return std::move(fitted.look);
}

}  // namespace velatura::compositor::cli
