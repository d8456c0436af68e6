// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "farm/job.h"

#include <cstddef>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace velatura::farm {

/// Gives pieces of a job to its engine, with the merge behind them; Engine::Local has none.
/// Returns: what became of them, for people. Errors: "farm-engine" (the engine refuses, or is not
/// installed), "io-write".
Result<std::string> submit_pieces(const Job& job, const std::vector<size_t>& pieces);

/// Pieces that wait or run in an engine by an earlier submit_pieces(); nothing: the engine does not
/// say so. Of engines that are given files none are known.
std::optional<std::set<size_t>> held_pieces(const Job& job);

/// Takes what is left of a job from its engine. Errors: "farm-engine".
Result<void> cancel_tasks(const Job& job);

/// Inside a task of Slurm: lets it start again. Returns: whether Slurm does so; it then ends this
/// process.
bool requeue_this_task();

/// Of one engine each: Slurm's commands, and files to hand to Open Job Description and OpenCue.
Result<std::string> submit_to_slurm(const Job& job, const std::vector<size_t>& pieces);
std::optional<std::set<size_t>> held_by_slurm(const Job& job);
Result<void> cancel_slurm(const Job& job);

/// What these write.

/// A job template of Open Job Description 2023-09, as JSON: a task per piece, or per chunk of
/// pieces with the option --chunk, and a step for the merge.
std::string openjd_template(const Job& job, const std::vector<size_t>& pieces);
/// A job of OpenCue in its XML (cjsl 1.15): a frame per piece, and a layer for the merge.
std::string opencue_job(const Job& job, const std::vector<size_t>& pieces);

/// The value of --name=value among the options of the engine; empty: not given.
std::string engine_option(const Job& job, std::string_view name);

/// `piece.sh` and `merge.sh` of Slurm; the first argument of `piece.sh` is added to the number of
/// the task.
std::string slurm_piece_script(const Job& job);
std::string slurm_merge_script(const Job& job);
/// Words of `sbatch` for pieces [first, first + 1000), and for the merge behind tasks.
std::vector<std::string> slurm_array_command(const Job& job,
                                             const std::vector<size_t>& pieces,
                                             size_t first);
std::vector<std::string> slurm_merge_command(const Job& job, const std::vector<std::string>& tasks);

}  // namespace velatura::farm
