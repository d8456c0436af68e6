// SPDX-License-Identifier: Apache-2.0
#include "base/frames.h"
#include "compositor/cli/command_outcome.h"
#include "compositor/cli/commands.h"
#include "compositor/cli/frame_runs.h"
#include "compositor/io/merge.h"

#include <fmt/format.h>

#include <memory>
#include <string>
#include <vector>

namespace velatura::compositor::cli {

namespace {

struct MergeOptions {
    std::vector<std::string> inputs;
    std::string output, frames;
    bool is_resumable = false;
};

int merge_one(const std::vector<std::string>& inputs,
              const std::string& output,
              bool is_resumable) {
    const auto written = merge_files(inputs, output, is_resumable);
    if (!written) return report(written.error());
    fmt::print("{}  {}\n", written->sha256, output);
    return done;
}

/// Into a sequence frame by frame; into one file all files of all inputs, whose numbers may be
/// those of their samples.
int run_merge(const MergeOptions& o) {
    if (!is_sequence(o.output)) {
        if (!o.frames.empty())
            return report({"bad-frames", o.output + " is one file: --frames needs #### in it"});
        std::vector<std::string> files;
        for (const std::string& input : o.inputs) {
            const std::vector<std::string> of_input = files_of(input);
            if (of_input.empty()) return report({"frame-missing", "no frame found of " + input});
            files.insert(files.end(), of_input.begin(), of_input.end());
        }
        return merge_one(files, o.output, o.is_resumable);
    }
    return run_frames({o.inputs, {o.output}, o.frames}, [&](const FrameNames& names) {
        std::vector<std::string> files;
        for (const std::string& input : o.inputs) files.push_back(names.input(input));
        return merge_one(files, names.output(o.output), o.is_resumable);
    });
}

}  // namespace

void add_merge_command(Command& app, std::function<int()>& run) {
    const auto o = std::make_shared<MergeOptions>();
    Command command = app.add_subcommand(
        "merge", "Join renders of adjacent sample ranges, bit for bit as one render");
    command
        .add_option(
            "inputs", o->inputs,
            "Files rendered with --samples A:B; sequences are merged frame by frame if -o is "
            "one")
        .required()
        .reads();
    add_frames_option(command, o->frames);
    command.add_option("-o,--output", o->output, "Merged file").required().writes();
    command
        .add_flag("--resumable,--keep-sums", o->is_resumable,
                  "Resumable output: store the exact sums, for --resume or another merge")
        .former_name("--keep-sums");
    command.example("velatura-comp merge a.exr b.exr -o shot.exr");
    command.callback([&run, o] { run = [o] { return run_merge(*o); }; });
}

}  // namespace velatura::compositor::cli
