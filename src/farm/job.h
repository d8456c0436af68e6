// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace velatura::farm {

/// Who starts the pieces of a job.
enum class Engine : uint8_t { Local, Slurm, OpenJobDescription, OpenCue };

/// "local", "slurm", "openjd", "opencue": as typed and stored.
std::string_view name_of(Engine engine);
/// Errors: "usage".
Result<Engine> engine_of(std::string_view name);

/// Samples [first, end) of each pixel of one frame.
struct Piece {
    size_t frame = 0;  ///< index of Job::frames
    uint64_t first = 0, end = 0;
};

/// A render that is split into pieces. Everything else about it, which is in further files of its
/// folder, is written by the pieces themselves.
struct Job {
    std::string folder;  ///< absolute; not stored, since machines can mount it elsewhere
    std::string name;
    Engine engine = Engine::Local;
    std::vector<std::string> engine_options;  ///< "--name=value": of Slurm words of sbatch
    std::string program;                      ///< `velatura` on the machines that render
    std::string build;                        ///< build id of the program that submitted
    std::string directory;                    ///< working directory of the pieces
    std::string scene;                        ///< as typed: relative to the directory
    std::vector<std::string> options;         ///< of render, the same for all pieces
    std::string checkpoint = "5m";            ///< empty: pieces write none
    std::vector<std::string> frames;   ///< of --frames, one each; "" is the scene's own frame
    std::vector<std::string> outputs;  ///< absolute, one per frame
    int retries = 2;                   ///< of a piece that failed
    int slots = 1;                     ///< pieces at a time, 0: as the engine decides
    uint64_t spp = 0;         ///< samples of each pixel; with a target: those of the first round
    uint64_t ranges = 0;      ///< pieces of a frame and round; 0: default_pieces()
    double piece_time_s = 0;  ///< wall time of a piece, to which further ones are split by what
                              ///< the first ones took; 0: all pieces are known from the start
    double max_start_share = 0.5;  ///< pieces take longer where their start would be a larger part
    double target_error = 0;       ///< relative error that ends a frame; 0: `spp` does
    uint64_t max_spp = 0;          ///< with a target: no round of pieces goes beyond it
    double max_wall_s = 0;      ///< with a target: no round is expected to end later; 0: no limit
    double max_cpu_s = 0;       ///< the same of the CPU time of all attempts
    std::string mix;            ///< with a target: preset whose mix must have it; empty: the image
    bool has_previews = true;   ///< an interim image of each frame, renewed as pieces arrive
    std::vector<Piece> pieces;  ///< by round, then by frame, then by sample
    size_t first_pieces = 0;    ///< those of the first round; the others are in `rounds.json`

    std::string path(std::string_view file) const { return folder + "/" + std::string(file); }

    std::string state_file(size_t piece) const;   ///< what became of a piece (piece_state.h)
    std::string work_file(size_t piece) const;    ///< the part while it is rendered
    std::string part_file(size_t piece) const;    ///< the finished part
    std::string result_file(size_t frame) const;  ///< what became of a frame
    /// The interim image of a frame; `extension`: ".exr", ".png", ".json" (what it shows).
    std::string preview_file(size_t frame, const char* extension) const;

    /// Its existence cancels the job.
    std::string cancel_file() const { return path("cancel"); }

    /// "piece 3 (samples 48:64)", with the frame where there are several.
    std::string title(size_t piece) const;
    /// The pieces of a frame.
    std::vector<size_t> pieces_of(size_t frame) const;
    /// Samples of each pixel of a frame that its pieces have; 0: it has none yet.
    uint64_t spp_of(size_t frame) const;
};

/// Splits samples [first, end) into at most `count` ranges of about the same length; an empty one
/// into none. Bounds are multiples of a power of two as large as is possible: sums of such ranges
/// are small.
std::vector<Piece> split_samples(uint64_t first, uint64_t end, uint64_t count);

/// Number of pieces of a frame where none is requested: one where there are several frames, else
/// up to 16 of 32 samples or more.
uint64_t default_pieces(uint64_t samples, size_t frames);

/// Makes the folder of a job with its file. The preset of Job::mix is copied into it, which then
/// names the copy: rounds of another day have the goal that was submitted. Errors: "farm-job"
/// (there is one already), "io-write", those of read_file.
Result<void> create_job(Job& job);

/// Adds pieces to a job that exists, behind those that it has: another round. Errors: "io-write".
Result<void> add_pieces(Job& job, const std::vector<Piece>& pieces);

/// Reads the job of a folder. Errors: "farm-job" (missing, damaged, of a later version).
Result<Job> read_job(const std::string& folder);

}  // namespace velatura::farm
