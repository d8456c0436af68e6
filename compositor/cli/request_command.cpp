// SPDX-License-Identifier: Apache-2.0
#include "compositor/cli/command_outcome.h"
#include "compositor/cli/commands.h"
#include "compositor/cli/look_command_options.h"
#include "compositor/cli/noise_report.h"
#include "compositor/io/layer_stack.h"
#include "compositor/noise/top_up.h"
#include "layers/sums_reader.h"

#include <fmt/format.h>

#include <memory>
#include <optional>
#include <string>

namespace velatura::compositor::cli {

namespace {

struct RequestOptions {
    std::string input, output, stats, target, time;
    std::optional<double> samples, factor;
    LookOptions look;
};

double mean_of(const std::vector<uint64_t>& counts) {
    double sum = 0;
    for (const uint64_t n : counts) sum += double(n);
    return sum / double(counts.size());
}

/// What the options ask for. Errors: "bad-target", those of render_seconds.
Result<noise::TopUpGoal> wish_of(const RequestOptions& o, const std::vector<uint64_t>& counts) {
    noise::TopUpGoal goal;
    if (!o.target.empty()) {
        const auto target = parse_target(o.target);
        if (!target) return target.error();
        goal.target = *target;
    }
    if (o.samples) goal.samples = *o.samples;
    if (o.factor) goal.samples = *o.factor * mean_of(counts);
    if (o.time.empty()) return goal;
    const auto time = parse_amount(o.time, "--time", {{'s', 1}, {'m', 60}, {'h', 3600}});
    if (!time) return time.error();
    const auto seconds = render_seconds(o.stats);
    if (!seconds) return seconds.error();
    goal.samples = mean_of(counts) * (1 + *time / *seconds);
    return goal;
}

void print_plan(const noise::TopUpPlan& plan) {
    const noise::NoiseForecast& f = plan.forecast;
    fmt::print("this mix     {} with {:.4g} samples per pixel\n", interval(f.mix),
               plan.samples_now);
    if (plan.target > 0 && plan.error_after > plan.target * 1.02)
        fmt::print("{} is out of reach.\n", percent(plan.target));
    if (plan.request.samples <= plan.samples_now) {
        fmt::print("{} is already reached; no samples requested.\n",
                   plan.target > 0 ? percent(plan.target) : "That many samples");
    } else {
        fmt::print("topped up    {} with {:.4g}, placed for this mix\n", percent(plan.error_after),
                   plan.request.samples);
        fmt::print("             the same with {:.4g}, placed as they are now\n",
                   plan.samples_evenly);
    }
    fmt::print("{}", shares_text(f));
}

int run_request(const RequestOptions& o) {
    if (!o.output.ends_with(".json")) return report({"bad-output", o.output + " is not .json"});
    const auto mix = o.look.open(o.input);
    if (!mix) return report(mix.error());
    const auto counts = layers::read_sample_counts(mix->input);
    if (!counts && counts.error().code.starts_with("io-")) return report(counts.error());
    if (!counts)
        return report(
            {counts.error().code,
             fmt::format("{}: {}; render with --resumable, so that --resume can continue it",
                         mix->input, counts.error().message)});
    const auto goal = wish_of(o, *counts);
    if (!goal) return report(goal.error());
    const auto plan = noise::plan_top_up(mix->stack, *counts, mix->look, *goal);
    if (!plan) return report(plan.error());
    if (const auto written = layers::write_top_up(o.output, plan->request); !written)
        return report(written.error());
    print_plan(*plan);
    return done;
}

void declare(Command& command, const std::shared_ptr<RequestOptions>& o) {
    command
        .add_option("input", o->input,
                    "File rendered with --halves --resumable, or shot.####.exr with --frame")
        .required()
        .reads();
    o->look.add_to(command);
    command
        .add_option("-o,--output", o->output, "Request file, .json; also writes STEM.priority.exr")
        .required()
        .writes();
    Command how = command.add_group("Amount of samples, one of");
    how.add_option("--target", o->target, "Target error of the mix, e.g. 1%")
        .type_name("ERROR")
        .default_text("the error of the render without grading");
    how.add_option("--samples-factor", o->factor, "Factor on the samples of the file")
        .range(1.0, 1e6);
    how.add_option("--spp", o->samples, "Samples per pixel on average, including those of the file")
        .range(1.0, 0x1p31);
    Option time =
        how.add_option("--time", o->time, "Further render time, e.g. 90s, 10m").type_name("TIME");
    how.require_options(0, 1);
    Option stats =
        command
            .add_option("--stats", o->stats,
                        "Statistics of the render (`velatura render --stats`), for --time")
            .type_name("FILE")
            .reads();
    time.needs(stats);
    stats.needs(time);
}

}  // namespace

void add_request_command(Command& app, std::function<int()>& run) {
    const auto o = std::make_shared<RequestOptions>();
    Command command = app.add_subcommand(
        "request", "Plan further samples where a mix is noisy, for `velatura render --for-mix`");
    declare(command, o);
    command.example(
        "velatura-comp request shot.exr --gain key=+2st --target 1% -o request.json\n"
        "velatura render shot.usda -o shot.exr --resume --for-mix request.json");
    command.callback([&run, o] { run = [o] { return run_request(*o); }; });

    // As it was called until 0.1.0; `velatura plan` is something else
    const auto old = std::make_shared<RequestOptions>();
    Command former = app.add_subcommand("plan", "Former name of request").hidden();
    declare(former, old);
    former.callback([&run, old] {
        run = [old] {
            fmt::print(stderr,
                       "note: `velatura-comp plan` is now `velatura-comp request` [renamed]\n");
            return run_request(*old);
        };
    });
}

}  // namespace velatura::compositor::cli
