// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "farm/job.h"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace velatura::farm {

enum class State : uint8_t {
    Waiting,   ///< not started, or stopped by a signal with its samples kept
    Running,   ///< its machine writes so at least every `heartbeat_s`
    Lost,      ///< was running, and its machine writes nothing any more; never stored
    Done,      ///< the part is there
    Failed,    ///< is tried again
    GaveUp,    ///< failed too often, or in a way that another try repeats
    Canceled,  ///< not done, and the job is canceled; never stored
};

/// "waiting", "running", "lost", "done", "failed", "gave-up", "canceled": of files and --json.
std::string_view name_of(State state);

/// One start of a piece.
struct Attempt {
    std::string node;  ///< of the engine, else the host
    std::string host;  ///< where `process` is a process
    std::string task;  ///< what the engine calls it; empty: nothing
    int process = 0;
    double start_s = 0;  ///< Unix time
    double wall_s = 0;   ///< 0 while it runs
    double cpu_s = 0;    ///< user and system
    double trace_s = 0;  ///< of wall_s: its samples, without what every start costs; 0: unknown
    uint64_t peak_bytes = 0;
    int code = 0;        ///< exit code, 128 + signal
    std::string reason;  ///< why it is not done; empty: it is, or runs
    std::string log;     ///< relative to the job
};

/// The file that a piece leaves.
struct Part {
    uint64_t bytes = 0;
    std::string sha256;           ///< of the file
    std::string scene, settings;  ///< hashes of the header
};

/// What became of a piece: its state file.
struct PieceState {
    State state = State::Waiting;
    int failures = 0;  ///< since the job was submitted, or since `farm retry`
    std::vector<Attempt> attempts;
    std::optional<Part> part;  ///< of Done
    double percent = 0;        ///< of Running
};

/// Interval at which a running piece writes its state, and the silence after which it is lost.
inline constexpr double heartbeat_s = 10, silence_s = 90;

/// A piece without a file is Waiting. A running piece whose process is gone, or whose file is older
/// than `silence_s`, is Lost; one that is not done in a canceled job is Canceled. Errors:
/// "farm-piece" (no such piece, damaged file).
Result<PieceState> read_piece(const Job& job, size_t piece);

/// The same of all.
Result<std::vector<PieceState>> read_pieces(const Job& job);

Result<void> write_piece(const Job& job, size_t piece, const PieceState& state);

bool is_canceled(const Job& job);

/// Notes that the last attempt failed. Whether the piece is tried again follows from the job's
/// retries; `repeats`: another try would fail the same.
void note_failure(PieceState& state, const Job& job, const std::string& reason, bool repeats);

/// Failed pieces and canceled ones may be tried again, as often as in a new job; frames of pieces
/// that are not done are merged again.
Result<void> reset_failures(const Job& job);

/// Seconds since 1970.
double now_s();

}  // namespace velatura::farm
