// SPDX-License-Identifier: Apache-2.0
#include "compositor/look_command_options.h"

#include "base/atomic_file.h"

#include <CLI/CLI.hpp>

#include <cstddef>

namespace velatura::compositor {

namespace {

constexpr size_t longest_preset = size_t(1) << 24;  // bytes

}  // namespace

void LookOptions::add_to(CLI::App& command) {
    const auto control = [&](const char* name, Control::Kind kind, const char* help) {
        command
            .add_option_function<std::vector<std::string>>(
                name,
                [this, kind](const std::vector<std::string>& texts) {
                    for (const std::string& text : texts) controls.emplace_back(kind, text);
                },
                help)
            ->take_all()
            ->allow_extra_args(false);
    };
    control("--gain", Control::Kind::Gain,
            "NAME=G: factor (2, 0.5) or stops (+1.5st, -1st); repeatable");
    control("--tint", Control::Kind::Tint, "NAME=R,G,B: factor per channel; repeatable");
    control("--kelvin", Control::Kind::Kelvin,
            "NAME=K: tint of a black body against 6504 K; repeatable");
    control("--mute", Control::Kind::Mute, "NAME: take it out; repeatable");
    control("--solo", Control::Kind::Solo, "NAME: take everything else out; repeatable");
    control("--shadow", Control::Kind::Shadow,
            "GROUP=X: lift its shadows by X from 0 to 1; repeatable");
    command.add_option("--exposure", exposure, "Stops on everything");
    command.add_option("--preset", preset, "Look to start from (JSON)");
    command.footer(
        "NAME is a light group, b0, b1, ..., tail, direct (b1), indirect (b2 to tail), env (all "
        "domes), emissive,\n"
        "shadow (a gain on it is the strength that is left), all, or GROUP:BOUNCE.");
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
    for (const auto& [kind, text] : controls) {
        auto control = parse_control(kind, text);
        if (!control) return control.error();
        look.controls.push_back(std::move(*control));
    }
    look.exposure_stops += exposure;
    return look;
}

}  // namespace velatura::compositor
