// SPDX-License-Identifier: Apache-2.0
#include "compositor/cli/command_outcome.h"
#include "compositor/cli/commands.h"
#include "compositor/cli/frame_runs.h"
#include "compositor/inspect/info.h"
#include "compositor/io/input_files.h"
#include "compositor/io/layer_stack.h"
#include "image/digest.h"
#include "layers/layer_file.h"

#include <fmt/format.h>

#include <memory>
#include <string>
#include <vector>

namespace velatura::compositor::cli {

namespace {

struct InfoOptions {
    std::vector<std::string> files;
    std::string stereo, frames;
    bool hash = false, json = false;
};

int info_one(const InfoOptions& o) {
    if (o.hash) {
        if (o.files.size() > 1) return report({"bad-output", "--hash needs a single file"});
        const auto image = layers::read_layer_file(o.files[0]);
        if (!image) return report(image.error());
        fmt::print("{}\n", image::digest_of(*image));
        return done;
    }
    const auto stack = load_input(o.files, o.stereo);
    if (!stack) {
        // Mattes by themselves, as `velatura-comp mattes` writes them
        const bool may_be_mattes = stack.error().code == "not-layers" && o.files.size() == 1;
        const auto image = may_be_mattes ? layers::read_layer_file(o.files[0])
                                         : Result<image::Image>(stack.error());
        if (!image || !inspect::has_mattes(*image, o.files[0])) return report(stack.error());
        fmt::print("{}", o.json ? inspect::mattes_info_json(*image, o.files[0])
                                : inspect::mattes_info_text(*image, o.files[0]));
        return done;
    }
    fmt::print("{}", o.json ? inspect::info_json(*stack) : inspect::info_text(*stack));
    return done;
}

int run_info(const InfoOptions& o) {
    return run_frames({o.files, {}, o.frames}, [&](const FrameNames& names) {
        InfoOptions one = o;
        for (std::string& file : one.files) file = names.input(file);
        return info_one(one);
    });
}

}  // namespace

void add_info_command(Command& app, std::function<int()>& run) {
    const auto o = std::make_shared<InfoOptions>();
    Command command = app.add_subcommand(
        "info", "Summarize a file: layers, light groups, energy, samples, closure");
    command
        .add_option("file", o->files,
                    "File of light layers, or shot.####.exr; several files are one mix (see `mix`)")
        .required()
        .reads();
    add_frames_option(command, o->frames);
    Option hash = command.add_flag("--hash", o->hash, "Print only the SHA-256 of all pixel data");
    command.add_flag("--json", o->json, "Print JSON, with the SHA-256").excludes(hash);
    add_stereo_option(command, o->stereo).excludes(hash);
    command.example("velatura-comp info shot.exr");
    command.callback([&run, o] { run = [o] { return run_info(*o); }; });
}

}  // namespace velatura::compositor::cli
