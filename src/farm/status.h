// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "farm/job.h"
#include "farm/merge_job.h"
#include "farm/piece_state.h"
#include "farm/preview.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace velatura::farm {

enum class JobState : uint8_t {
    Waiting,     ///< no piece has started
    Running,     ///< pieces run, wait or are tried again
    Complete,    ///< every frame is written
    Incomplete,  ///< pieces gave up: nothing more happens without `farm retry`
    Canceled,
};

/// "waiting", "running", "complete", "incomplete", "canceled".
std::string_view name_of(JobState state);

/// A job as its files tell it.
struct JobStatus {
    JobState state = JobState::Waiting;
    std::vector<PieceState> pieces;
    std::vector<bool> is_merged;  ///< by frame: its image is written, and no round follows
    std::vector<std::optional<ErrorAt>> errors;  ///< by frame: error_by_rounds(); nothing: unknown
    std::vector<double> stated;       ///< by frame: the error in the header of that image; 0: none
    std::vector<std::string> limits;  ///< by frame: which limit ended its rounds; empty: none
    std::vector<std::optional<Preview>> previews;  ///< by frame: its interim image
    std::vector<std::string> problems;             ///< of merges that failed
    std::array<size_t, 7> counts = {};             ///< of pieces by State
    double cpu_s = 0;                              ///< of all attempts
    double wall_s = 0;                             ///< since the first one started
    std::optional<double> left_s;  ///< of all samples that are known to be needed; nothing:
                                   ///< unknown, or nothing runs
    double samples_done = 0, samples_wanted = 0;  ///< per pixel, over all frames

    size_t count(State s) const { return counts[size_t(s)]; }

    size_t merged_count() const;
};

/// Errors: "farm-piece" (damaged file).
Result<JobStatus> status_of(const Job& job);

/// A few lines, with a table of the pieces that run or failed; with `all` of every piece.
/// `price_per_hour`: of a CPU; 0: no cost is stated.
std::string status_text(const Job& job, const JobStatus& status, bool all, double price_per_hour);

/// Schema velatura.farm.status/1 (docs/reference/farm.md).
std::string status_json(const Job& job, const JobStatus& status, double price_per_hour);

/// What lacks of a job that ended without all of its frames, and what to type: lines for people.
std::string incomplete_text(const Job& job, const JobStatus& status);

}  // namespace velatura::farm
