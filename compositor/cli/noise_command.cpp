// SPDX-License-Identifier: Apache-2.0
#include "compositor/cli/command_outcome.h"
#include "compositor/cli/commands.h"
#include "compositor/cli/frame_runs.h"
#include "compositor/cli/look_command_options.h"
#include "compositor/cli/noise_report.h"
#include "compositor/io/image_name.h"
#include "compositor/io/layer_stack.h"
#include "compositor/noise/error_map.h"
#include "compositor/noise/noise_json.h"
#include "layers/layer_file.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <memory>
#include <optional>
#include <string>

namespace velatura::compositor::cli {

namespace {

struct NoiseOptions {
    std::string input, output, stats, frames;
    std::optional<std::string> target;
    LookOptions look;
    bool json = false;
};

std::string duration(double seconds) {
    if (seconds < 120) return fmt::format("{:.0f} s", seconds);
    if (seconds < 7200) return fmt::format("{:.0f} min", seconds / 60);
    return fmt::format("{:.1f} h", seconds / 3600);
}

std::string text_of(const noise::ControlCap& cap) {
    const bool is_gain = cap.control.kind == Control::Kind::Gain;
    const std::string option = (is_gain ? "--gain " : "--shadow ") + cap.control.target;
    if (!cap.max) return fmt::format("Removing {} is not enough.\n", option);
    if (!is_gain || !(*cap.max > 0))
        return fmt::format("Or {}={:.2g} in place of {}.\n", option, *cap.max, cap.control.value);
    const double stops = std::round(100 * std::log2(*cap.max)) / 100;
    // Not to grade is no advice
    if (stops == 0) return {};
    return fmt::format("Or {}={:+.2f}st in place of {}.\n", option, stops, cap.control.value);
}

void print_text(const noise::NoiseForecast& f,
                double samples,
                std::optional<double> seconds,
                std::optional<int> frame,
                bool has_target) {
    if (frame) fmt::print("frame {}\n", *frame);
    fmt::print("as rendered  {}\nthis mix     {}\n", interval(f.rendered), interval(f.mix));
    if (f.error.storage > f.mix.value / 3)
        fmt::print(
            "Rounding to half adds {}; render with --float-layers to measure noise below it.\n",
            percent(f.error.storage));
    const noise::NoiseAdvice& a = f.advice;
    if (a.sample_factor <= 1) {
        if (has_target) fmt::print("The target of {} is reached.\n", percent(a.target));
    } else {
        fmt::print("{} needs about {:.3g} times the samples ({:.0f} per pixel{}).\n",
                   percent(a.target), a.sample_factor, std::ceil(a.sample_factor * samples),
                   seconds ? ", " + duration(a.sample_factor * *seconds) : "");
        for (const noise::ControlCap& cap : a.caps) fmt::print("{}", text_of(cap));
    }
    fmt::print("{}", shares_text(f));
}

Result<void> write_map(const std::string& path,
                       const LayerStack& stack,
                       const noise::NoiseForecast& forecast) {
    const image::Image errors = noise::error_image(stack, forecast.error);
    if (is_display_image(path)) return noise::write_error_image(path, errors, forecast.mix.value);
    return layers::write_image_file(path, errors);
}

/// Of one file; `frame` is that of a sequence.
int noise_one(const NoiseOptions& o, std::optional<int> frame) {
    std::optional<double> target, seconds;
    if (o.target) {
        const auto parsed = parse_target(*o.target);
        if (!parsed) return report(parsed.error());
        target = *parsed;
    }
    if (!o.stats.empty()) {
        const auto read = render_seconds(o.stats);
        if (!read) return report(read.error());
        seconds = *read;
    }
    const auto asked = frame ? o.look.look_at_frame(*frame) : o.look.look_of_frame();
    if (!asked) return report(asked.error());
    const auto stack = LayerStack::load(o.input);
    if (!stack) return report(stack.error());
    const Look look = o.look.fitted(*stack, *asked);
    const auto forecast = noise::forecast_noise(*stack, look, target);
    if (!forecast) return report(forecast.error());
    if (!o.output.empty()) {
        if (const auto written = write_map(o.output, *stack, *forecast); !written)
            return report(written.error());
    }
    const double samples = noise::mean_samples(*stack);
    if (o.json)
        fmt::print("{}\n", noise::noise_json(*forecast, samples, seconds, frame).dump(2));
    else
        print_text(*forecast, samples, seconds, frame, target.has_value());
    if (!o.json && is_display_image(o.output))
        fmt::print("{}: black {} or less, orange {}, white {} or more, on a log scale\n", o.output,
                   percent(forecast->mix.value / 16), percent(forecast->mix.value),
                   percent(16 * forecast->mix.value));
    return done;
}

int run_noise(const NoiseOptions& o) {
    if (!o.output.empty() && !is_display_image(o.output) && !is_exr(o.output))
        return report({"bad-output", o.output + " is not " + image_names()});
    const FrameRuns runs = {{o.input, o.stats}, {o.output}, o.frames};
    if (o.look.frame && has_sequence(runs))
        return report({"bad-frames", "--frame needs a single file, not a sequence"});
    return run_frames(runs, [&](const FrameNames& names) {
        NoiseOptions one = o;
        one.input = names.input(o.input);
        one.stats = names.input(o.stats);
        one.output = names.output(o.output);
        return noise_one(one, names.frame());
    });
}

}  // namespace

void add_noise_command(Command& app, std::function<int()>& run) {
    const auto o = std::make_shared<NoiseOptions>();
    Command command = app.add_subcommand(
        "noise",
        "Predict the noise after grading, and the spp needed to keep it constant, from half "
        "images");
    command
        .add_option("input", o->input,
                    "File of light layers, or shot.####.exr, rendered with --halves")
        .required()
        .reads();
    add_frames_option(command, o->frames);
    o->look.add_to(command);
    command.add_option("--target", o->target, "Target error of the mix, e.g. 1%")
        .type_name("ERROR")
        .default_text("the error of the render without grading");
    command
        .add_option("--stats", o->stats,
                    "Statistics of the render (`velatura render --stats`), to predict times")
        .type_name("FILE")
        .reads();
    command
        .add_option("-o,--output", o->output,
                    "Noise map: .exr (standard error per channel), .png or .jpg (heat map)")
        .type_name("FILE")
        .writes();
    command.add_flag("--json", o->json, "Print JSON");
    command.example("velatura-comp noise shot.exr --gain key=+2st -o heat.png");
    command.callback([&run, o] { run = [o] { return run_noise(*o); }; });
}

}  // namespace velatura::compositor::cli
