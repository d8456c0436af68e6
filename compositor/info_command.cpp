// SPDX-License-Identifier: Apache-2.0
#include "compositor/command_outcome.h"
#include "compositor/commands.h"
#include "compositor/frame_runs.h"
#include "compositor/info.h"
#include "compositor/layer_stack.h"
#include "image/digest.h"
#include "image/layer_file.h"

#include <fmt/format.h>

#include <memory>
#include <string>

namespace velatura::compositor {

namespace {

struct InfoOptions {
    std::string file, frames;
    bool hash = false, json = false;
};

int info_one(const InfoOptions& o) {
    if (o.hash) {
        const auto image = image::read_layer_file(o.file);
        if (!image) return report(image.error());
        fmt::print("{}\n", image::digest_of(*image));
        return done;
    }
    const auto stack = LayerStack::load(o.file, ForeignFiles::Plain);
    if (!stack) return report(stack.error());
    fmt::print("{}", o.json ? info_json(*stack) : info_text(*stack));
    return done;
}

int run_info(const InfoOptions& o) {
    return run_frames({{o.file}, {}, o.frames}, [&](const FrameNames& names) {
        return info_one({names.input(o.file), {}, o.hash, o.json});
    });
}

}  // namespace

void add_info_command(Command& app, std::function<int()>& run) {
    const auto o = std::make_shared<InfoOptions>();
    Command command =
        app.add_subcommand("info", "What a file holds: layers, groups, energy, samples, closure");
    command.add_option("file", o->file, "File of light layers, or shot.####.exr")
        .required()
        .reads();
    add_frames_option(command, o->frames);
    Option hash = command.add_flag("--hash", o->hash, "Print only the SHA-256 of all pixel data");
    command.add_flag("--json", o->json, "As JSON, the SHA-256 with it").excludes(hash);
    command.callback([&run, o] { run = [o] { return run_info(*o); }; });
}

}  // namespace velatura::compositor
