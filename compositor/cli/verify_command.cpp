// SPDX-License-Identifier: Apache-2.0
#include "compositor/cli/command_outcome.h"
#include "compositor/cli/commands.h"
#include "compositor/cli/frame_runs.h"
#include "compositor/io/layer_stack.h"
#include "layers/layer_check.h"

#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <string>

namespace velatura::compositor::cli {

namespace {

struct VerifyOptions {
    std::string file, frames;
    bool quiet = false;
};

int verify_one(const VerifyOptions& o) {
    const auto stack = LayerStack::load(o.file);
    if (!stack) {
        const int code = report(stack.error());
        // A file that opens but whose header or pixels are broken has failed the check
        return stack.error().code == "io-open" ? code : int(check_failed);
    }
    const layers::LayerCheck check = layers::check_layers(stack->image(), stack->header());
    for (const std::string& problem : check.problems)
        report({"verify-failed", fmt::format("{}: {}", o.file, problem)});
    if (!check.is_good()) return check_failed;
    if (o.quiet) return done;
    fmt::print("{}: {} layers, {} channels\n", o.file, check.layers, check.channels);
    for (const layers::FamilyClosure& c : check.closure) {
        fmt::print("  {}: {} AOVs sum to the beauty: OK, {}\n", c.family, c.order.size(),
                   c.is_exact ? std::string("bit for bit")
                              : fmt::format("within rounding ({:.3f} of its bound)", c.measured));
    }
    return done;
}

int run_verify(const VerifyOptions& o) {
    return run_frames({{o.file}, {}, o.frames}, [&](const FrameNames& names) {
        return verify_one({names.input(o.file), {}, o.quiet});
    });
}

}  // namespace

void add_verify_command(Command& app, std::function<int()>& run) {
    const auto o = std::make_shared<VerifyOptions>();
    Command command = app.add_subcommand(
        "verify", "Verify that AOVs sum to the beauty, and names, values and digests of a file");
    command.add_option("file", o->file, "File of light layers, or shot.####.exr")
        .required()
        .reads();
    add_frames_option(command, o->frames);
    command.add_flag("-q,--quiet", o->quiet, "Print errors only");
    command.example("velatura-comp verify shot.exr");
    command.callback([&run, o] { run = [o] { return run_verify(*o); }; });
}

}  // namespace velatura::compositor::cli
