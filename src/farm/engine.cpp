// SPDX-License-Identifier: Apache-2.0
#include "farm/engine.h"

#include "base/atomic_file.h"
#include "base/frames.h"
#include "base/markup.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <charconv>
#include <cstdlib>

namespace velatura::farm {

namespace {

using json = nlohmann::ordered_json;

std::string list_of(std::vector<size_t> pieces) {
    std::sort(pieces.begin(), pieces.end());
    return frame_list(std::vector<int>(pieces.begin(), pieces.end()));
}

int number_option(const Job& job, std::string_view name) {
    const std::string text = engine_option(job, name);
    int value = 0;
    std::from_chars(text.data(), text.data() + text.size(), value);
    return value;
}

/// A name of an engine: without control characters, at most `length` characters of ASCII.
std::string plain_name(const std::string& name, size_t length) {
    std::string text;
    for (const char c : name) text += c >= ' ' && c < 127 ? c : '_';
    return text.substr(0, length);
}

/// Braces begin and end an expression in format strings.
std::string without_braces(std::string text) {
    for (const char* const braces : {"{{", "}}"})
        for (size_t at; (at = text.find(braces)) != std::string::npos;) text.replace(at, 2, "__");
    return text;
}

json openjd_action(const std::vector<std::string>& arguments) {
    json action;
    action["command"] = "{{Param.Velatura}}";
    action["args"] = arguments;
    // Without it a task is killed at once; 600 s is the maximum
    action["cancelation"] = {{"mode", "NOTIFY_THEN_TERMINATE"}, {"notifyPeriodInSeconds", 600}};
    return {{"actions", {{"onRun", action}}}};
}

/// Of letters, digits and "_-.", as DTDs' NMTOKEN.
std::string token(const std::string& name) {
    std::string text;
    for (const char c : name) {
        const bool is_plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
                              (c >= '0' && c <= '9') || c == '_' || c == '-' || c == '.';
        text += is_plain ? c : '_';
    }
    return text;
}

/// A word of a command line, as OpenCue's shell reads it.
std::string quoted(const std::string& word) {
    std::string text = "'";
    for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return text + "'";
}

std::string opencue_layer(const std::string& name,
                          const std::string& type,
                          const std::string& command,
                          const std::string& range,
                          int chunk,
                          int threads) {
    return fmt::format(
        "      <layer name=\"{}\" type=\"{}\">\n        <cmd>{}</cmd>\n"
        "        <range>{}</range>\n        <chunk>{}</chunk>\n{}"
        "        <services>\n          <service>shell</service>\n        </services>\n"
        "      </layer>\n",
        name, type, escape_markup(command), range, chunk,
        threads > 0 ? fmt::format("        <cores>{}</cores>\n        "
                                  "<threadable>False</threadable>\n",
                                  threads)
                    : "        <threadable>True</threadable>\n");
}

Result<std::string> write_for(const Job& job,
                              const std::string& name,
                              const std::string& text,
                              const std::string& how) {
    if (const auto ok = write_file_atomically(job.path(name), text); !ok) return ok.error();
    return job.path(name) + how;
}

}  // namespace

std::string engine_option(const Job& job, std::string_view name) {
    const std::string start = "--" + std::string(name) + "=";
    std::string value;
    for (const std::string& word : job.engine_options)
        if (word.starts_with(start)) value = word.substr(start.size());
    return value;
}

std::string openjd_template(const Job& job, const std::vector<size_t>& pieces) {
    const int chunk = number_option(job, "chunk");
    json j;
    j["specificationVersion"] = "jobtemplate-2023-09";
    if (chunk > 0) j["extensions"] = {"TASK_CHUNKING"};
    j["name"] = without_braces(plain_name(job.name, 128));
    j["parameterDefinitions"] = {{{"name", "Job"},
                                  {"type", "PATH"},
                                  {"objectType", "DIRECTORY"},
                                  {"dataFlow", "INOUT"},
                                  {"default", job.folder},
                                  {"description", "Job folder of velatura farm"}},
                                 {{"name", "Velatura"},
                                  {"type", "STRING"},
                                  {"default", job.program},
                                  {"description", "The program velatura on the workers"}}};
    json render = {{"name", "Render"}};
    json piece = {{"name", "Piece"}, {"type", chunk > 0 ? "CHUNK[INT]" : "INT"}};
    piece["range"] = list_of(pieces);
    if (chunk > 0) {
        piece["chunks"] = {{"defaultTaskCount", chunk}};
        piece["chunks"]["rangeConstraint"] = "CONTIGUOUS";
        const int task_time_s = number_option(job, "task-time");
        if (task_time_s > 0) piece["chunks"]["targetRuntimeSeconds"] = task_time_s;
    }
    if (!pieces.empty()) {
        render["parameterSpace"] = {{"taskParameterDefinitions", json::array({piece})}};
        render["script"] = openjd_action(
            {"farm", "run", "{{Param.Job}}", "{{Task.Param.Piece}}", "--progress", "openjd"});
        j["steps"].push_back(render);
    }
    json merge = {{"name", "Merge"}};
    if (!pieces.empty()) merge["dependencies"] = json::array({{{"dependsOn", "Render"}}});
    merge["script"] = openjd_action({"farm", "merge", "{{Param.Job}}", "--progress", "openjd"});
    j["steps"].push_back(merge);
    return j.dump(2, ' ', false, json::error_handler_t::replace) + "\n";
}

std::string opencue_job(const Job& job, const std::vector<size_t>& pieces) {
    const auto option = [&](const char* name, const char* otherwise) {
        const std::string value = engine_option(job, name);
        return escape_markup(value.empty() ? otherwise : value);
    };
    const char* const user = std::getenv("USER");
    const int threads = number_option(job, "threads");
    const int chunk = std::max(1, number_option(job, "chunk"));
    const std::string program = quoted(job.program), folder = quoted(job.folder);
    const std::string which = chunk > 1 ? "#FRAME_START#-#FRAME_END#" : "#IFRAME#";
    const std::string name = token(job.name);
    std::string text = fmt::format(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
        "<!DOCTYPE spec PUBLIC \"SPI Cue Specification Language\" "
        "\"http://localhost:8080/spcue/dtd/cjsl-1.15.dtd\">\n"
        "<spec>\n  <facility>{}</facility>\n  <show>{}</show>\n  <shot>{}</shot>\n"
        "  <user>{}</user>\n  <job name=\"{}\">\n    <paused>False</paused>\n"
        "    <maxretries>{}</maxretries>\n    <autoeat>False</autoeat>\n    <layers>\n",
        option("facility", "local"), option("show", "velatura"), option("shot", "shot"),
        escape_markup(user ? user : "velatura"), name, job.retries);
    if (!pieces.empty())
        text += opencue_layer("render", "Render",
                              fmt::format("{} farm run {} {}", program, folder, which),
                              list_of(pieces), chunk, threads);
    text += opencue_layer("merge", "Post", fmt::format("{} farm merge {}", program, folder), "0", 1,
                          threads);
    text += "    </layers>\n  </job>\n";
    if (!pieces.empty())
        text += fmt::format(
            "  <depends>\n    <depend type=\"LAYER_ON_LAYER\" anyframe=\"False\">\n"
            "      <depjob>{0}</depjob>\n      <deplayer>merge</deplayer>\n"
            "      <onjob>{0}</onjob>\n      <onlayer>render</onlayer>\n"
            "    </depend>\n  </depends>\n",
            name);
    return text + "</spec>\n";
}

Result<std::string> submit_pieces(const Job& job, const std::vector<size_t>& pieces) {
    switch (job.engine) {
        case Engine::Local:
            break;
        case Engine::Slurm:
            return submit_to_slurm(job, pieces);
        case Engine::OpenJobDescription:
            return write_for(job, "openjd/template.json", openjd_template(job, pieces),
                             ": template of Open Job Description; submit its folder to Deadline "
                             "Cloud, or run it with openjd");
        case Engine::OpenCue:
            return write_for(job, "opencue.xml", opencue_job(job, pieces),
                             ": job of OpenCue; launch it with opencue.api.launchSpec");
    }
    return std::string();
}

std::optional<std::set<size_t>> held_pieces(const Job& job) {
    return job.engine == Engine::Slurm ? held_by_slurm(job) : std::set<size_t>();
}

Result<void> cancel_tasks(const Job& job) {
    return job.engine == Engine::Slurm ? cancel_slurm(job) : Result<void>();
}

}  // namespace velatura::farm
