// SPDX-License-Identifier: Apache-2.0
#include "compositor/command_outcome.h"
#include "compositor/commands.h"
#include "compositor/merge.h"

#include <fmt/format.h>

#include <memory>
#include <string>
#include <vector>

namespace velatura::compositor {

namespace {

struct MergeOptions {
    std::vector<std::string> inputs;
    std::string output;
    bool keep_sums = false;
};

int run_merge(const MergeOptions& o) {
    const auto written = merge_files(o.inputs, o.output, o.keep_sums);
    if (!written) return report(written.error());
    fmt::print("{}  {}\n", written->sha256, o.output);
    return done;
}

}  // namespace

void add_merge_command(Command& app, std::function<int()>& run) {
    const auto o = std::make_shared<MergeOptions>();
    Command command = app.add_subcommand(
        "merge", "Join renders of adjacent sample ranges into the single render");
    command.add_option("inputs", o->inputs, "Files rendered with --samples A:B").required();
    command.add_option("-o,--output", o->output, "Merged file").required();
    command.add_flag("--keep-sums", o->keep_sums, "Keep the exact sums, for another merge");
    command.callback([&run, o] { run = [o] { return run_merge(*o); }; });
}

}  // namespace velatura::compositor
