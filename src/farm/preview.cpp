// SPDX-License-Identifier: Apache-2.0
#include "farm/preview.h"

#include "base/atomic_file.h"
#include "base/json_depth.h"
#include "base/json_numbers.h"
#include "base/output_lock.h"
#include "farm/piece_state.h"
#include "farm/process.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <exception>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace velatura::farm {

namespace {

using json = nlohmann::ordered_json;

constexpr const char* preview_schema = "velatura.farm.preview/1";

/// Pieces that are done, each behind the samples of the one before.
struct AdjacentPieces {
    std::vector<size_t> pieces;
    uint64_t first = 0, end = 0;

    uint64_t samples() const { return end - first; }
};

Result<AdjacentPieces> longest_run(const Job& job, const std::vector<size_t>& pieces) {
    AdjacentPieces longest, run;
    for (const size_t i : pieces) {
        const Result<PieceState> state = read_piece(job, i);
        if (!state) return state.error();
        const Piece& p = job.pieces[i];
        if (state->state != State::Done)
            run = {};
        else if (run.pieces.empty())
            run = {{i}, p.first, p.end};
        else {
            run.pieces.push_back(i);
            run.end = p.end;
        }
        if (run.samples() > longest.samples()) longest = run;
    }
    return longest;
}

bool run_quietly(const Job& job, size_t frame, std::vector<std::string> words) {
    ProcessRequest request;
    request.arguments = std::move(words);
    request.log = job.path(fmt::format("logs/preview.{:04}.log", frame));
    const Result<ProcessResult> ended = run_process(request);
    return ended && ended->code == 0;
}

bool write_png(const Job& job, size_t frame, const std::string& image) {
    std::vector<std::string> words = {compositor_program(), "mix", image, "-o",
                                      job.preview_file(frame, ".png")};
    if (!job.mix.empty()) words.insert(words.end(), {"--preset", job.mix});
    return run_quietly(job, frame, std::move(words));
}

/// What a preview leaves beside its PNG.
void remove_interim(const Job& job, size_t frame) {
    std::error_code ignored;
    std::filesystem::remove(job.preview_file(frame, ".exr"), ignored);
    std::filesystem::remove(job.preview_file(frame, ".json"), ignored);
}

}  // namespace

std::optional<Preview> read_preview(const Job& job, size_t frame) {
    std::error_code error;
    const std::string file = job.preview_file(frame, ".json");
    if (!std::filesystem::exists(file, error)) return std::nullopt;
    const Result<std::string> text = read_file(file);
    if (!text || is_json_too_deep(*text)) return std::nullopt;
    const json j = json::parse(*text, nullptr, false);
    if (!j.is_object() || j.value("schema", json()) != preview_schema) return std::nullopt;
    try {
        Preview p;
        p.first = whole_number<uint64_t>(j.at("samples").at(0));
        p.end = whole_number<uint64_t>(j.at("samples").at(1));
        p.has_png = j.at("png").get<bool>();
        if (j.contains("error"))
            p.error =
                ErrorAt{p.end - p.first, j.at("error").get<double>(), j.at("is_lower").get<bool>()};
        return p;
    } catch (const std::exception&) {
        return std::nullopt;
    }
}

Result<bool> renew_preview(const Job& job, size_t frame) {
    if (!job.has_previews) return false;
    const std::vector<size_t> pieces = job.pieces_of(frame);
    const auto is_worthwhile = [&](const AdjacentPieces& run) {
        // All that the frame is to have is merged into its output
        if (run.samples() == 0 || (run.pieces.size() == pieces.size() && run.end >= job.spp))
            return false;
        const auto result = stored_result(job, frame);
        const auto before = read_preview(job, frame);
        const uint64_t shown = std::max(before ? before->end - before->first : 0,
                                        result && *result ? (*result)->spp : 0);
        return run.samples() >= 2 * shown;
    };
    const Result<AdjacentPieces> first = longest_run(job, pieces);
    if (!first) return first.error();
    if (!is_worthwhile(*first)) return false;
    const std::string about = job.preview_file(frame, ".json"),
                      image = job.preview_file(frame, ".exr");
    if (const auto made = make_folder_of(about); !made) return made.error();
    const Result<OutputLock> lock = OutputLock::take(about);
    if (!lock) return false;
    // Another piece may have ended, and its preview be there, meanwhile
    const Result<AdjacentPieces> run = longest_run(job, pieces);
    if (!run) return run.error();
    if (!is_worthwhile(*run)) return false;
    std::vector<std::string> words = {compositor_program(), "merge"};
    for (const size_t i : run->pieces) words.push_back(job.part_file(i));
    words.insert(words.end(), {"-o", image});
    if (!run_quietly(job, frame, std::move(words))) return false;
    // While it was merged, the image of as many samples may have been
    if (!is_worthwhile(*run)) {
        remove_interim(job, frame);
        return false;
    }
    json j = {{"schema", preview_schema}, {"samples", {run->first, run->end}}};
    if (const auto error = stated_error(image, run->samples())) {
        j["error"] = error->error;
        j["is_lower"] = error->is_lower;
    }
    j["png"] = write_png(job, frame, image);
    if (const auto ok = write_file_atomically(about, j.dump(1) + "\n"); !ok) return ok.error();
    return true;
}

void finish_preview(const Job& job, size_t frame) {
    if (!job.has_previews || job.pieces_of(frame).size() < 2) return;
    // A preview that is made now is to come before the PNG of the image; without the lock that
    // of a machine that hangs may come later
    constexpr double longest_s = 600;
    const auto lock = OutputLock::wait_for(job.preview_file(frame, ".json"), longest_s);
    (void)write_png(job, frame, job.outputs[frame]);
    remove_interim(job, frame);
}

}  // namespace velatura::farm
