// SPDX-License-Identifier: Apache-2.0
#include "base/frames.h"
#include "compositor/cli/command_outcome.h"
#include "compositor/cli/commands.h"
#include "compositor/cli/frame_runs.h"
#include "compositor/io/merge.h"
#include "compositor/io/merge_deep.h"
#include "layers/deep_file.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <charconv>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace velatura::compositor::cli {

namespace {

using Json = nlohmann::ordered_json;

struct MergeArguments {
    std::vector<std::string> inputs;
    std::string output, frames, expected;
    bool is_resumable = false, accepts_incomplete = false, is_json = false;
};

/// Nothing where it is not A:B with A < B.
std::optional<SampleRange> parse_range(const std::string& text) {
    SampleRange range;
    const char* const end = text.data() + text.size();
    const auto first = std::from_chars(text.data(), end, range.first);
    if (first.ec != std::errc() || first.ptr == end || *first.ptr != ':') return std::nullopt;
    const auto last = std::from_chars(first.ptr + 1, end, range.second);
    if (last.ec != std::errc() || last.ptr != end || range.first >= range.second)
        return std::nullopt;
    return range;
}

Json json_of(const std::optional<SampleRange>& range) {
    return range ? Json{range->first, range->second} : Json();
}

/// x0, y0, x1, y1: pixels from the upper left, without the last column and row.
Json json_of(const std::optional<image::Window>& w) {
    return w ? Json{w->x0, w->y0, w->x1, w->y1} : Json();
}

Json json_of(const MergeReport& report,
             const std::string& output,
             const Result<layers::WriteReport>& written) {
    Json j;
    j["schema"] = "velatura.merge/1";
    j["output"] = output;
    j["merged"] = written.has_value();
    if (written) j["sha256"] = written->sha256;
    j["samples"] = json_of(report.samples);
    j["complete"] = report.is_complete;
    j["parts"] = Json::array();
    for (const MergePart& part : report.parts)
        j["parts"].push_back({{"file", part.path},
                              {"samples", json_of(part.samples)},
                              {"window", json_of(std::optional(part.window))},
                              {"complete", part.is_complete},
                              {"lacks", part.lacks}});
    j["faults"] = Json::array();
    for (const MergeFault& fault : report.faults)
        j["faults"].push_back({{"kind", fault.kind},
                               {"text", fault.text},
                               {"files", fault.files},
                               {"samples", json_of(fault.samples)},
                               {"window", json_of(fault.window)}});
    if (!written && report.faults.empty())
        j["faults"].push_back({{"kind", "output"},
                               {"text", written.error().message},
                               {"files", Json::array()},
                               {"samples", Json()},
                               {"window", Json()}});
    return j;
}

/// A render without an asset or a plugin is another image than the scene describes.
void warn_of_lacks(const MergeReport& merge) {
    std::map<std::string, std::vector<std::string>> files;  // by what they lack
    for (const MergePart& part : merge.parts)
        for (const std::string& name : part.lacks) files[name].push_back(part.path);
    for (const auto& [name, of] : files) {
        if (of.size() == merge.parts.size())
            warn(fmt::format("all parts were rendered without {}", name));
        else
            warn(fmt::format("{} of {} parts were rendered without {}, {} among them", of.size(),
                             merge.parts.size(), name, of[0]));
    }
}

/// Prints each fault by itself. Returns: the exit code.
int report_faults(const MergeReport& merge, const Error& error) {
    for (const MergeFault& fault : merge.faults) report({fault.code, fault.text});
    if (merge.faults.empty()) return report(error);
    return error.code == "merge-refused" ? int(refused) : int(failed);
}

/// Deep images of crops. Returns: the exit code.
int merge_deep(const std::vector<std::string>& inputs,
               const std::string& output,
               const MergeArguments& o) {
    if (o.is_resumable || o.accepts_incomplete || o.is_json || !o.expected.empty())
        return report({"merge-refused",
                       "deep images have no samples to count: --resumable, --incomplete, --expect "
                       "and --json are not for them"});
    if (const Result<void> written = merge_deep_files(inputs, output); !written)
        return report(written.error());
    fmt::print("{}\n", output);
    return done;
}

int merge_one(const std::vector<std::string>& inputs,
              const std::string& output,
              const MergeArguments& o) {
    if (std::any_of(inputs.begin(), inputs.end(), layers::is_deep_file))
        return merge_deep(inputs, output, o);
    MergeOptions options;
    options.keep_sums = o.is_resumable;
    options.accepts_incomplete = o.accepts_incomplete;
    options.expected = parse_range(o.expected);
    MergeReport merge;
    const auto written = merge_files(inputs, output, options, merge);
    if (o.is_json) fmt::print("{}\n", json_of(merge, output, written).dump());
    if (!written) return report_faults(merge, written.error());
    warn_of_lacks(merge);
    if (!o.is_json) fmt::print("{}  {}\n", written->sha256, output);
    return done;
}

/// Into a sequence frame by frame; into one file all files of all inputs, whose numbers may be
/// those of their samples.
int run_merge(const MergeArguments& o) {
    if (!is_sequence(o.output)) {
        if (!o.frames.empty())
            return report({"bad-frames", o.output + " is one file: --frames needs #### in it"});
        std::vector<std::string> files;
        for (const std::string& input : o.inputs) {
            const std::vector<std::string> of_input = files_of(input);
            if (of_input.empty()) return report({"frame-missing", "no frame found of " + input});
            files.insert(files.end(), of_input.begin(), of_input.end());
        }
        return merge_one(files, o.output, o);
    }
    return run_frames({o.inputs, {o.output}, o.frames}, [&](const FrameNames& names) {
        std::vector<std::string> files;
        for (const std::string& input : o.inputs) files.push_back(names.input(input));
        return merge_one(files, names.output(o.output), o);
    });
}

}  // namespace

void add_merge_command(Command& app, std::function<int()>& run) {
    const auto o = std::make_shared<MergeArguments>();
    Command command = app.add_subcommand(
        "merge", "Join renders of adjacent sample ranges or crops, bit for bit as one render");
    command
        .add_option(
            "inputs", o->inputs,
            "Files rendered with --samples A:B, or with --crop and --resumable; or deep images of "
            "crops. Sequences are merged frame by frame if -o is one")
        .required()
        .reads();
    add_frames_option(command, o->frames);
    command.add_option("-o,--output", o->output, "Merged file").required().writes();
    command
        .add_flag("--resumable,--keep-sums", o->is_resumable,
                  "Resumable output: store the exact sums, for --resume or another merge")
        .former_name("--keep-sums");
    command
        .add_option("--expect", o->expected,
                    "Sample range A:B that the files must cover together; else exit code 5 and no "
                    "output")
        .type_name("A:B")
        .check([](const std::string& value) {
            return parse_range(value) ? std::string()
                                      : "expected A:B with A < B, found \"" + value + "\"";
        });
    command.add_flag(
        "--incomplete", o->accepts_incomplete,
        "Also merge files that were stopped before they had all of their samples; only "
        "the last one can be");
    command.add_flag("--json", o->is_json,
                     "Print a JSON report: parts with their samples, every fault, the ranges that "
                     "are missing");
    command.example("velatura-comp merge a.exr b.exr -o shot.exr --expect 0:64");
    command.callback([&run, o] { run = [o] { return run_merge(*o); }; });
}

}  // namespace velatura::compositor::cli
