// SPDX-License-Identifier: Apache-2.0
#include "base/atomic_file.h"
#include "compositor/command_outcome.h"
#include "compositor/commands.h"
#include "compositor/layer_stack.h"
#include "compositor/look_command_options.h"
#include "compositor/mix.h"
#include "image/layer_file.h"

#include <CLI/CLI.hpp>

#include <memory>
#include <string>

namespace velatura::compositor {

namespace {

struct MixOptions {
    std::string input, output, save_preset, display, view;
    LookOptions look;
    bool with_layers = false;
};

int run_mix(const MixOptions& o) {
    const bool is_display = is_display_picture(o.output);
    if (!is_display && !is_exr(o.output))
        return report({"bad-output", o.output + " is not .exr, .png or .jpg"});
    auto look = o.look.look();
    if (!look) return report(look.error());
    if (!o.display.empty()) look->display = o.display;
    if (!o.view.empty()) look->view = o.view;
    const auto file = image::StripReader::open(o.input);
    if (!file) return report(file.error());
    const auto layout = LayerStack::describe(*file, o.input, ForeignFiles::Plain);
    if (!layout) return report(layout.error());
    const auto plan = plan_mix(*layout, *look);
    if (!plan) return report(plan.error());
    const auto mixed = mix_file(*file, *layout, *plan, *look, o.with_layers && !is_display);
    if (!mixed) return report(mixed.error());
    const auto written = is_display ? write_display(o.output, *mixed, *look)
                                    : image::write_image_file(o.output, *mixed);
    if (!written) return report(written.error());
    if (!o.save_preset.empty()) {
        if (auto saved = write_file_atomically(o.save_preset, look_to_json(*look)); !saved)
            return report(saved.error());
    }
    return done;
}

}  // namespace

void add_mix_command(CLI::App& app, std::function<int()>& run) {
    const auto o = std::make_shared<MixOptions>();
    CLI::App* command = app.add_subcommand("mix", "Gains, tints, mute, solo and shadow lift");
    command->add_option("input", o->input, "File of light layers")->required();
    command
        ->add_option("-o,--output", o->output,
                     "Scene-linear .exr, or .png / .jpg through OpenColorIO")
        ->required();
    o->look.add_to(*command);
    command->add_option("--save-preset", o->save_preset, "Write the look as JSON");
    command->add_option("--display", o->display, "OpenColorIO display for .png and .jpg");
    command->add_option("--view", o->view,
                        "OpenColorIO view: ACES, sRGB or Raw in the built-in config");
    command->add_flag("--with-layers", o->with_layers,
                      "Store the gained layers in the .exr as well");
    command->callback([&run, o] { run = [o] { return run_mix(*o); }; });
}

}  // namespace velatura::compositor
