// SPDX-License-Identifier: Apache-2.0
#include "compositor/cli/command_outcome.h"
#include "compositor/cli/commands.h"
#include "compositor/cli/frame_runs.h"
#include "compositor/denoise/denoise.h"
#include "compositor/io/image_name.h"
#include "compositor/io/layer_stack.h"
#include "layers/layer_file.h"

#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <string>

namespace velatura::compositor::cli {

namespace {

struct DenoiseOptions {
    std::string input, output, frames;
};

int denoise_one(const DenoiseOptions& o) {
    const auto stack = LayerStack::load(o.input);
    if (!stack) return report(stack.error());
    denoise::DenoiseReport denoise_report;
    const auto denoised = denoise::denoise(*stack, denoise_report);
    if (!denoised) return report(denoised.error());
    if (const auto written = layers::write_image_file(o.output, *denoised); !written)
        return report(written.error());
    for (const std::string& note : denoise_report.notes) warn(note);
    fmt::print("{}: mean luminance {:+.3f} %\n", o.output, 100 * (denoise_report.energy_ratio - 1));
    return done;
}

int run_denoise(const DenoiseOptions& o) {
    if (!is_exr(o.output)) return report(Error{"bad-output", o.output + " is not .exr"});
    return run_frames({{o.input}, {o.output}, o.frames}, [&](const FrameNames& names) {
        return denoise_one({names.input(o.input), names.output(o.output), {}});
    });
}

}  // namespace

void add_denoise_command(Command& app, std::function<int()>& run) {
    const auto o = std::make_shared<DenoiseOptions>();
    Command command = app.add_subcommand("denoise",
                                         "Denoise all layers together; they still sum to the "
                                         "beauty and can be graded");
    command
        .add_option("input", o->input,
                    "File of light layers, or shot.####.exr, rendered with --halves and --layers "
                    "...,data")
        .required()
        .reads();
    command.add_option("-o,--output", o->output, "Denoised .exr, with the same layers")
        .required()
        .writes();
    add_frames_option(command, o->frames);
    command.footer(
        "Every pixel becomes a weighted mean of its neighbors, with the same weights in every "
        "layer. The weights come from the half images of the beauty, albedo, N, Z and b0. Without "
        "half images the result is coarser, with a warning. The half images of the result hold "
        "the remaining noise, for `velatura-comp noise`.");
    command.example("velatura-comp denoise shot.exr -o shot_denoised.exr");
    command.callback([&run, o] { run = [o] { return run_denoise(*o); }; });
}

}  // namespace velatura::compositor::cli
