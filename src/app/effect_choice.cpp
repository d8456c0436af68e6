// SPDX-License-Identifier: Apache-2.0
#include "app/effect_choice.h"

#include "app/parse_values.h"

#include <fmt/format.h>

namespace velatura::app {

namespace {

using scene::Effect;

Error usage(std::string message) {
    return {"usage", std::move(message)};
}

std::string names_that_can_be_left_out() {
    std::string names;
    for (size_t i = 0; i < scene::effect_count; ++i) {
        if (!integrator::can_omit(Effect(i))) continue;
        if (!names.empty()) names += ", ";
        names += scene::info(Effect(i)).name;
    }
    return names;
}

/// Why an effect stays, whatever the command line says.
std::string why_it_stays(Effect effect) {
    const scene::EffectInfo& about = scene::info(effect);
    switch (about.kind) {
        case scene::EffectKind::Estimator:
            return fmt::format(
                "--effects: {} changes only the noise of the image and has an option of its own "
                "(see --help-all)",
                about.name);
        case scene::EffectKind::Output:
            return fmt::format("--effects: {} are set by --layers and --halves", about.name);
        case scene::EffectKind::Scene:
            break;
    }
    return fmt::format(
        "--effects: {} cannot be switched off, because the scene is built of it; expected one of "
        "{}",
        about.name, names_that_can_be_left_out());
}

}  // namespace

Result<EffectChoice> parse_effects(const std::string& text) {
    EffectChoice choice;
    if (text.empty()) return choice;
    for (const std::string& part : split(text, ',')) {
        if (part == "all") {
            choice.force_all = true;
            continue;
        }
        if (!part.starts_with('-'))
            return usage(fmt::format("--effects: expected all or -NAME, found \"{}\"", part));
        const std::optional<Effect> effect = scene::find_effect(std::string_view(part).substr(1));
        if (!effect)
            return usage(fmt::format("--effects: unknown effect \"{}\"; expected one of {}",
                                     part.substr(1), names_that_can_be_left_out()));
        if (!integrator::can_omit(*effect)) return usage(why_it_stays(*effect));
        choice.omitted.add(*effect);
    }
    return choice;
}

}  // namespace velatura::app
