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
#include <iterator>
#include <map>
#include <set>
#include <sstream>
#include <string_view>

namespace velatura::farm {

namespace fs = std::filesystem;

namespace {

using json = nlohmann::ordered_json;

constexpr const char* schema = "velatura.farm.check/1";

/// What Linux says of the first processor: "model name", "flags".
std::string processor_fact(std::string_view name) {
    std::ifstream file("/proc/cpuinfo");
    for (std::string line; std::getline(file, line);)
        if (line.starts_with(name) && line.find(": ") != std::string::npos)
            return line.substr(line.find(": ") + 2);
    return {};
}

/// Those of the flags that vector code is chosen by, in the order of this list.
std::string vector_features() {
    const std::string flags = " " + processor_fact("flags") + " ";
    std::string found;
    for (const std::string name : {"sse4_2", "avx", "f16c", "fma", "bmi2", "avx2", "avx512f",
                                   "avx512bw", "avx512vl", "avx512_bf16", "avx512_fp16"})
        if (flags.find(" " + name + " ") != std::string::npos)
            found += (found.empty() ? "" : " ") + name;
    return found;
}

std::set<std::string> words_of(const std::string& text) {
    std::istringstream stream(text);
    return {std::istream_iterator<std::string>(stream), {}};
}

/// SHA-256 of the pixels of a file; empty: it cannot be read.
std::string pixels_of(const std::string& image) {
    std::string hash;
    ProcessRequest request;
    request.arguments = {compositor_program(), "info", "--hash", image};
    request.on_line = [&](std::string_view line) {
        constexpr size_t digits = 64;
        const bool is_hash = line.find_first_not_of("0123456789abcdef") >= digits;
        if (line.size() >= digits && is_hash) hash = std::string(line.substr(0, digits));
    };
    const Result<ProcessResult> ended = run_process(request);
    return ended && ended->code == 0 ? hash : std::string();
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
                 {"--res", "8", "8", "--samples=0:4", "--output=" + image, "--progress=none"});
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
    check.pixels = pixels_of(image);
    std::error_code ignored;
    fs::remove(image, ignored);
}

/// Why a machine cannot be compared; empty: it can.
std::string problem_of(const MachineCheck& check) {
    return check.problem.empty() && check.pixels.empty()
               ? "its pixels are not known: velatura-comp info --hash failed there"
               : check.problem;
}

/// What must be equal: names and values.
std::map<std::string, std::string> facts_of(const MachineCheck& check) {
    std::map<std::string, std::string> facts = {
        {"build", check.build}, {"files of the scene", check.scene}, {"pixels", check.pixels}};
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
    check.processor = processor_fact("model name");
    check.features = vector_features();
    if (const auto made = make_folder_of(file_of(job, check.node)); !made) return made.error();
    render(job, check);
    const json j = {{"schema", schema},           {"node", check.node},
                    {"build", check.build},       {"processor", check.processor},
                    {"features", check.features}, {"scene", check.scene},
                    {"pixels", check.pixels},     {"settings", check.settings},
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
        checks.push_back({value("node"), value("build"), value("processor"), value("features"),
                          value("scene"), value("pixels"), value("settings"), value("problem")});
    }
    return checks;
}

std::vector<std::string> differing_processors(const std::vector<MachineCheck>& checks) {
    std::set<std::string> all;
    for (const MachineCheck& check : checks) all.merge(words_of(check.features));
    std::vector<std::string> lines;
    for (const MachineCheck& check : checks) {
        const std::set<std::string> own = words_of(check.features);
        std::vector<std::string> lacks;
        std::set_difference(all.begin(), all.end(), own.begin(), own.end(),
                            std::back_inserter(lacks));
        if (!lacks.empty())
            lines.push_back(fmt::format("{} ({}) has no {}", check.node, check.processor,
                                        fmt::join(lacks, ", ")));
    }
    return lines;
}

std::vector<std::string> differing_machines(const Job& job,
                                            const std::vector<MachineCheck>& checks) {
    std::vector<std::string> lines;
    std::map<std::string, std::map<std::string, size_t>> counts;
    for (const MachineCheck& check : checks)
        if (problem_of(check).empty())
            for (const auto& [name, value] : facts_of(check)) ++counts[name][value];
    for (const MachineCheck& check : checks) {
        if (const std::string problem = problem_of(check); !problem.empty()) {
            lines.push_back(fmt::format("{}: {}", check.node, problem));
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
