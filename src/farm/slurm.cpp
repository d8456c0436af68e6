// SPDX-License-Identifier: Apache-2.0
#include "base/atomic_file.h"
#include "base/frames.h"
#include "farm/engine.h"
#include "farm/process.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <utility>

namespace velatura::farm {

namespace {

/// Slurm's MaxArraySize is 1001 by default: numbers of tasks are below.
constexpr size_t tasks_of_array = 1000;

/// As one word of a shell.
std::string quoted(const std::string& word) {
    std::string text = "'";
    for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return text + "'";
}

/// In names of log files, % begins a replacement.
std::string escaped(const std::string& path) {
    std::string text;
    for (const char c : path) text += c == '%' ? std::string("%%") : std::string(1, c);
    return text;
}

/// Runs a command of Slurm. Returns: what it printed. Errors: "farm-engine".
Result<std::string> call(std::vector<std::string> words) {
    std::string text;
    ProcessRequest request;
    request.arguments = std::move(words);
    request.on_line = [&](std::string_view line) {
        text += (text.empty() ? "" : "\n") + std::string(line);
    };
    const Result<ProcessResult> ended = run_process(request);
    if (!ended) return ended.error();
    if (ended->code == 127)
        return Error{"farm-engine", fmt::format("{} not found: is Slurm installed on this machine?",
                                                request.arguments[0])};
    if (ended->code != 0)
        return Error{"farm-engine", fmt::format("{} refused, exit code {}: {}",
                                                request.arguments[0], ended->code, text)};
    return text;
}

/// The number of `sbatch --parsable`: "17" or "17;cluster", behind warnings.
Result<std::string> submit(std::vector<std::string> words) {
    const Result<std::string> printed = call(std::move(words));
    if (!printed) return printed.error();
    const size_t line = printed->rfind('\n');
    std::string number = line == std::string::npos ? *printed : printed->substr(line + 1);
    number.resize(std::min(number.size(), number.find(';')));
    if (number.empty() || number.find_first_not_of("0123456789") != std::string::npos)
        return Error{"farm-engine", fmt::format("sbatch printed no number: {}", *printed)};
    return number;
}

std::vector<std::string> common_words(const Job& job, const std::string& kind) {
    std::vector<std::string> words = {"sbatch",
                                      "--parsable",
                                      "--requeue",
                                      "--open-mode=append",
                                      "--job-name=" + job.name + "-" + kind,
                                      "--chdir=" + job.directory};
    words.insert(words.end(), job.engine_options.begin(), job.engine_options.end());
    return words;
}

std::string tasks_file(const Job& job) {
    return job.path("slurm/tasks");
}

/// What was given to Slurm: an array of pieces, or a merge.
struct Submission {
    std::string number;
    std::optional<size_t> first;  ///< the piece that is task 0 of the array; nothing: a merge
};

/// All that was submitted: "17 1000" is an array, "18" a merge.
std::vector<Submission> submitted(const Job& job) {
    std::vector<Submission> all;
    std::ifstream file(tasks_file(job));
    for (std::string line; std::getline(file, line);) {
        std::istringstream words(line);
        Submission s;
        if (!(words >> s.number)) continue;
        if (size_t first = 0; words >> first) s.first = first;
        all.push_back(std::move(s));
    }
    return all;
}

Result<void> note(const Job& job, const Submission& added) {
    std::vector<Submission> all = submitted(job);
    all.push_back(added);
    std::string text;
    for (const Submission& s : all)
        text += s.number + (s.first ? fmt::format(" {}", *s.first) : "") + "\n";
    return write_file_atomically(tasks_file(job), text);
}

}  // namespace

std::string slurm_piece_script(const Job& job) {
    // The program takes the place of the shell, to which --signal=B: sends its warning
    return fmt::format("#!/bin/sh\nexec {} farm run {} \"$(($1 + SLURM_ARRAY_TASK_ID))\"\n",
                       quoted(job.program), quoted(job.folder));
}

std::string slurm_merge_script(const Job& job) {
    return fmt::format("#!/bin/sh\nexec {} farm merge {} --resubmit\n", quoted(job.program),
                       quoted(job.folder));
}

std::vector<std::string> slurm_array_command(const Job& job,
                                             const std::vector<size_t>& pieces,
                                             size_t first) {
    std::vector<int> tasks;
    for (const size_t piece : pieces)
        if (piece >= first && piece < first + tasks_of_array) tasks.push_back(int(piece - first));
    std::sort(tasks.begin(), tasks.end());
    std::vector<std::string> words = common_words(job, "pieces");
    words.push_back("--array=" + frame_list(tasks) +
                    (job.slots > 0 ? fmt::format("%{}", job.slots) : ""));
    words.emplace_back("--signal=B:USR2@60");
    words.push_back("--output=" + escaped(job.path("logs/")) + "slurm-%A_%a.log");
    words.push_back(job.path("slurm/piece.sh"));
    words.push_back(std::to_string(first));
    return words;
}

std::vector<std::string> slurm_merge_command(const Job& job,
                                             const std::vector<std::string>& tasks) {
    std::vector<std::string> words = common_words(job, "merge");
    // Behind their end, good or bad: after the first failure afterok never holds again, even if the
    // task is repeated and succeeds. The merge looks at the files
    words.push_back("--dependency=afterany:" + fmt::format("{}", fmt::join(tasks, ":")));
    words.push_back("--output=" + escaped(job.path("logs/")) + "slurm-merge-%j.log");
    words.push_back(job.path("slurm/merge.sh"));
    return words;
}

Result<std::string> submit_to_slurm(const Job& job, const std::vector<size_t>& pieces) {
    for (const auto& [name, text] :
         std::map<std::string, std::string>{{"slurm/piece.sh", slurm_piece_script(job)},
                                            {"slurm/merge.sh", slurm_merge_script(job)}})
        if (const auto ok = write_file_atomically(job.path(name), text); !ok) return ok.error();
    std::vector<std::string> tasks;
    for (size_t first = 0; first < job.pieces.size(); first += tasks_of_array) {
        const bool has_any = std::any_of(pieces.begin(), pieces.end(), [&](size_t piece) {
            return piece >= first && piece < first + tasks_of_array;
        });
        if (!has_any) continue;
        const Result<std::string> number = submit(slurm_array_command(job, pieces, first));
        if (!number) return number.error();
        tasks.push_back(*number);
        if (const auto ok = note(job, {*number, first}); !ok) return ok.error();
    }
    std::vector<std::string> words = slurm_merge_command(job, tasks);
    if (tasks.empty())
        std::erase_if(words, [](const auto& w) { return w.starts_with("--depend"); });
    const Result<std::string> merge = submit(words);
    if (!merge) return merge.error();
    if (const auto ok = note(job, {*merge, std::nullopt}); !ok) return ok.error();
    return fmt::format("Slurm: pieces {}, merge {}",
                       tasks.empty() ? "none" : fmt::format("{}", fmt::join(tasks, ",")), *merge);
}

Result<void> cancel_slurm(const Job& job) {
    std::vector<std::string> words = {"scancel"};
    for (const Submission& s : submitted(job)) words.push_back(s.number);
    if (words.size() == 1) return {};
    const Result<std::string> printed = call(std::move(words));
    return printed ? Result<void>() : Result<void>(printed.error());
}

std::optional<std::set<size_t>> held_by_slurm(const Job& job) {
    std::map<std::string, size_t> arrays;
    for (const Submission& s : submitted(job))
        if (s.first) arrays[s.number] = *s.first;
    std::set<size_t> held;
    if (arrays.empty()) return held;
    // A line per task: the number of its array and its own
    const Result<std::string> printed =
        call({"squeue", "--noheader", "--array", fmt::format("--user={}", ::getuid()),
              "--states=PENDING,RUNNING,CONFIGURING,SUSPENDED", "--format=%F %K"});
    if (!printed) return std::nullopt;
    std::istringstream lines(*printed);
    for (std::string line; std::getline(lines, line);) {
        std::istringstream words(line);
        std::string number;
        size_t task = 0;
        if (!(words >> number >> task)) continue;  // no task of an array
        if (const auto array = arrays.find(number); array != arrays.end())
            held.insert(array->second + task);
    }
    return held;
}

bool requeue_this_task() {
    const char* const array = std::getenv("SLURM_ARRAY_JOB_ID");
    const char* const task = std::getenv("SLURM_ARRAY_TASK_ID");
    if (!array || !task) return false;
    // Not $SLURM_JOB_ID: of the last task that is the whole array
    return call({"scontrol", "requeue", fmt::format("{}_{}", array, task)}).has_value();
}

}  // namespace velatura::farm
