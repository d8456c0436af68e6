// SPDX-License-Identifier: Apache-2.0
#include "farm/check.h"

#include "base/atomic_file.h"
#include "farm/process.h"
#include "farm/run_piece.h"
#include "image/exr.h"
#include "layers/layer_header.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>

namespace velatura::farm {

namespace fs = std::filesystem;

namespace {

using json = nlohmann::ordered_json;

constexpr const char* schema = "velatura.farm.check/1";

/// The model of the processor, as Linux names it.
std::string processor_model() {
    std::ifstream file("/proc/cpuinfo");
    for (std::string line; std::getline(file, line);)
        if (line.starts_with("model name") && line.find(": ") != std::string::npos)
            return line.substr(line.find(": ") + 2);
    return "unknown";
}

/// A file name of a node.
std::string file_of(const Job& job, const std::string& node) {
    std::string name;
    for (const char c : node) name += c == '/' || c == '\0' ? '_' : c;
    return job.path("checks/" + name);
}

/// Renders, and reads what the file states of itself.
void render(const Job& job, MachineCheck& check) {
    const std::string image = file_of(job, check.node) + ".exr";
    std::vector<std::string> words = {job.program, "render", job.scene};
    words.insert(words.end(), job.options.begin(), job.options.end());
    if (!job.frames.front().empty()) words.push_back("--frames=" + job.frames.front());
    words.insert(words.end(),
                 {"--res", "8", "8", "--samples=0:1", "--output=" + image, "--progress=none"});
    ProcessRequest request;
    request.arguments = std::move(words);
    request.directory = job.directory;
    std::string error;
    request.on_line = [&](std::string_view line) {
        // The first one is the cause
        if (error.empty() && line.find("error: ") != std::string_view::npos) error = line;
    };
    const Result<ProcessResult> ended = run_process(request);
    if (!ended) {
        check.problem = ended.error().message;
        return;
    }
    if (ended->code != 0) {
        check.problem =
            fmt::format("exit code {}{}", ended->code, error.empty() ? "" : ": " + error);
        return;
    }
    const auto reader = image::ExrReader::open(image);
    const auto header = reader ? layers::read_layer_header(reader->header())
                               : Result<layers::LayerHeader>(reader.error());
    if (!header) {
        check.problem = header.error().message;
        return;
    }
    check.scene = header->samples.scene_hash;
    const json all =
        json::parse(layers::file_info_of(reader->header(), *header).settings_json, nullptr, false);
    if (all.is_object()) check.settings = all.value("settings", json::object()).dump();
    std::error_code ignored;
    fs::remove(image, ignored);
}

/// What must be equal: names and values.
std::map<std::string, std::string> facts_of(const MachineCheck& check) {
    std::map<std::string, std::string> facts = {{"build", check.build},
                                                {"files of the scene", check.scene}};
    const json settings = json::parse(check.settings, nullptr, false);
    if (settings.is_object())
        for (const auto& [name, value] : settings.items()) facts[name] = value.dump();
    return facts;
}

}  // namespace

Result<MachineCheck> check_machine(const Job& job, const std::string& build) {
    MachineCheck check;
    check.node = node_name();
    check.build = build;
    check.processor = processor_model();
    if (const auto made = make_folder_of(file_of(job, check.node)); !made) return made.error();
    render(job, check);
    const json j = {{"schema", schema},        {"node", check.node},
                    {"build", check.build},    {"processor", check.processor},
                    {"scene", check.scene},    {"settings", check.settings},
                    {"problem", check.problem}};
    if (const auto ok =
            write_file_atomically(file_of(job, check.node) + ".json",
                                  j.dump(1, ' ', false, json::error_handler_t::replace) + "\n");
        !ok)
        return ok.error();
    return check;
}

Result<std::vector<MachineCheck>> read_checks(const Job& job) {
    std::vector<MachineCheck> checks;
    std::error_code error;
    std::vector<fs::path> files;
    for (fs::directory_iterator at(job.path("checks"), error), end; !error && at != end;
         at.increment(error))
        if (at->path().extension() == ".json") files.push_back(at->path());
    std::sort(files.begin(), files.end());
    for (const fs::path& file : files) {
        const Result<std::string> text = read_file(file.string());
        if (!text) return text.error();
        const json j = json::parse(*text, nullptr, false);
        const auto value = [&](const char* name) {
            const json found = j.is_object() ? j.value(name, json()) : json();
            return found.is_string() ? found.get<std::string>() : std::string();
        };
        if (value("schema") != schema)
            return Error{"farm-piece", fmt::format("{} is damaged; remove it", file.string())};
        checks.push_back({value("node"), value("build"), value("processor"), value("scene"),
                          value("settings"), value("problem")});
    }
    return checks;
}

std::vector<std::string> differing_machines(const Job& job,
                                            const std::vector<MachineCheck>& checks) {
    std::vector<std::string> lines;
    std::map<std::string, std::map<std::string, size_t>> counts;
    for (const MachineCheck& check : checks)
        if (check.problem.empty())
            for (const auto& [name, value] : facts_of(check)) ++counts[name][value];
    for (const MachineCheck& check : checks) {
        if (!check.problem.empty()) {
            lines.push_back(fmt::format("{}: {}", check.node, check.problem));
            continue;
        }
        if (check.build != job.build)
            lines.push_back(fmt::format("{}: build {}, the job was submitted with {}", check.node,
                                        check.build, job.build));
        for (const auto& [name, value] : facts_of(check)) {
            if (name == "build") continue;
            const auto usual =
                std::max_element(counts[name].begin(), counts[name].end(),
                                 [](const auto& a, const auto& b) { return a.second < b.second; });
            if (usual->first != value)
                lines.push_back(
                    fmt::format("{}: {} {}, elsewhere {}", check.node, name, value, usual->first));
        }
    }
    return lines;
}

}  // namespace velatura::farm
