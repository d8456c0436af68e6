// SPDX-License-Identifier: Apache-2.0
#include "farm/job.h"

#include "base/atomic_file.h"
#include "base/json_depth.h"
#include "base/json_numbers.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <bit>
#include <exception>
#include <filesystem>
#include <iterator>

namespace velatura::farm {

namespace fs = std::filesystem;

namespace {

using json = nlohmann::ordered_json;

constexpr const char* job_schema = "velatura.farm.job/1";
constexpr const char* rounds_schema = "velatura.farm.rounds/1";
constexpr const char* preset_name =
    "preset.json";  // in the folder: machines can mount it elsewhere

struct EngineName {
    Engine engine;
    std::string_view name;
};

constexpr EngineName engine_names[] = {{Engine::Local, "local"},
                                       {Engine::Slurm, "slurm"},
                                       {Engine::OpenJobDescription, "openjd"},
                                       {Engine::OpenCue, "opencue"}};

/// An object with its pieces, a line each, for people.
std::string with_pieces(const json& j, const std::vector<Piece>& pieces) {
    std::string lines;
    for (const Piece& p : pieces)
        lines +=
            fmt::format("{}[{}, {}, {}]", lines.empty() ? "" : ",\n    ", p.frame, p.first, p.end);
    std::string text = j.dump(2);
    text.resize(text.rfind('\n'));
    return text + ",\n  \"pieces\": [\n    " + lines + "\n  ]\n}\n";
}

std::string to_json(const Job& job) {
    json j;
    j["schema"] = job_schema;
    j["name"] = job.name;
    j["engine"] = name_of(job.engine);
    j["engine_options"] = job.engine_options;
    j["program"] = job.program;
    j["build"] = job.build;
    j["directory"] = job.directory;
    j["scene"] = job.scene;
    j["options"] = job.options;
    j["checkpoint"] = job.checkpoint;
    j["retries"] = job.retries;
    j["slots"] = job.slots;
    j["frames"] = job.frames;
    j["outputs"] = job.outputs;
    j["spp"] = job.spp;
    j["ranges"] = job.ranges;
    j["piece_time_s"] = job.piece_time_s;
    j["max_start_share"] = job.max_start_share;
    j["previews"] = job.has_previews;
    if (job.target_error > 0) {
        j["target_error"] = job.target_error;
        j["max_spp"] = job.max_spp;
        j["max_wall_s"] = job.max_wall_s;
        j["max_cpu_s"] = job.max_cpu_s;
        j["mix"] = job.mix.empty() ? "" : preset_name;
    }
    return with_pieces(j, job.pieces);
}

std::vector<Piece> pieces_from(const json& j) {
    std::vector<Piece> pieces;
    for (const json& p : j.at("pieces"))
        pieces.push_back({whole_number<size_t>(p.at(0)), whole_number<uint64_t>(p.at(1)),
                          whole_number<uint64_t>(p.at(2))});
    return pieces;
}

/// Whether the pieces are of frames of the job, each behind the samples of those before it.
bool has_frames(const Job& job) {
    std::vector<uint64_t> ends(job.frames.size());
    for (const Piece& p : job.pieces) {
        if (p.frame >= ends.size() || p.first != ends[p.frame] || p.end <= p.first) return false;
        ends[p.frame] = p.end;
    }
    return true;
}

/// Throws std::exception where a member is missing or of another type.
Job from_json(const json& j) {
    Job job;
    job.name = j.at("name").get<std::string>();
    const auto engine = engine_of(j.at("engine").get<std::string>());
    if (!engine) throw std::out_of_range(engine.error().message);
    job.engine = *engine;
    job.engine_options = j.at("engine_options").get<std::vector<std::string>>();
    job.program = j.at("program").get<std::string>();
    job.build = j.at("build").get<std::string>();
    job.directory = j.at("directory").get<std::string>();
    job.scene = j.at("scene").get<std::string>();
    job.options = j.at("options").get<std::vector<std::string>>();
    job.checkpoint = j.at("checkpoint").get<std::string>();
    job.retries = whole_number<int>(j.at("retries"));
    job.slots = whole_number<int>(j.at("slots"));
    job.frames = j.at("frames").get<std::vector<std::string>>();
    job.outputs = j.at("outputs").get<std::vector<std::string>>();
    job.spp = whole_number<uint64_t>(j.at("spp"));
    job.ranges = whole_number<uint64_t>(j.at("ranges"));
    job.piece_time_s = j.at("piece_time_s").get<double>();
    job.max_start_share = j.at("max_start_share").get<double>();
    job.has_previews = j.at("previews").get<bool>();
    if (j.contains("target_error")) {
        job.target_error = j.at("target_error").get<double>();
        job.max_spp = whole_number<uint64_t>(j.at("max_spp"));
        job.max_wall_s = j.at("max_wall_s").get<double>();
        job.max_cpu_s = j.at("max_cpu_s").get<double>();
        job.mix = j.at("mix").get<std::string>();
    }
    job.pieces = pieces_from(j);
    job.first_pieces = job.pieces.size();
    const bool is_whole =
        !job.pieces.empty() && job.frames.size() == job.outputs.size() && has_frames(job);
    if (!is_whole) throw std::out_of_range("pieces and frames do not fit");
    return job;
}

/// `rounds.json`. Throws std::exception.
void add_rounds(const json& j, Job& job) {
    if (!j.is_object() || j.value("schema", json()) != rounds_schema)
        throw std::out_of_range(fmt::format("expected schema {}", rounds_schema));
    for (const Piece& p : pieces_from(j)) job.pieces.push_back(p);
    if (!has_frames(job)) throw std::out_of_range("pieces and frames do not fit");
}

json parsed(const std::string& text) {
    return is_json_too_deep(text) ? json() : json::parse(text, nullptr, false);
}

std::string numbered(size_t index, const char* extension) {
    return fmt::format("{:04}{}", index, extension);
}

}  // namespace

std::string_view name_of(Engine engine) {
    for (const EngineName& e : engine_names)
        if (e.engine == engine) return e.name;
    return "";
}

Result<Engine> engine_of(std::string_view name) {
    for (const EngineName& e : engine_names)
        if (e.name == name) return e.engine;
    return Error{"usage", fmt::format("unknown engine \"{}\"", name)};
}

std::string Job::state_file(size_t piece) const {
    return path("pieces/" + numbered(piece, ".json"));
}

std::string Job::work_file(size_t piece) const {
    return path("work/" + numbered(piece, ".exr"));
}

std::string Job::part_file(size_t piece) const {
    return path("parts/" + numbered(piece, ".exr"));
}

std::string Job::result_file(size_t frame) const {
    return path("frames/" + numbered(frame, ".json"));
}

std::string Job::preview_file(size_t frame, const char* extension) const {
    return path("preview/" + numbered(frame, extension));
}

std::string Job::title(size_t piece) const {
    const Piece& p = pieces[piece];
    return fmt::format("piece {} ({}samples {}:{})", piece,
                       frames.size() > 1 ? "frame " + frames[p.frame] + ", " : "", p.first, p.end);
}

std::vector<size_t> Job::pieces_of(size_t frame) const {
    std::vector<size_t> found;
    for (size_t i = 0; i < pieces.size(); ++i)
        if (pieces[i].frame == frame) found.push_back(i);
    return found;
}

uint64_t Job::spp_of(size_t frame) const {
    uint64_t end = 0;
    for (const Piece& p : pieces)
        if (p.frame == frame) end = std::max(end, p.end);
    return end;
}

std::vector<Piece> split_samples(uint64_t start, uint64_t last, uint64_t count) {
    const uint64_t end = std::max(start, last) - start;
    count = std::clamp<uint64_t>(count, 1, std::max<uint64_t>(end, 1));
    const uint64_t step = std::max<uint64_t>(1, std::bit_floor(std::max<uint64_t>(end / count, 1)));
    std::vector<Piece> pieces;
    if (end == 0) return pieces;
    uint64_t first = 0;
    for (uint64_t i = 1; i <= count; ++i) {
        // The multiple of the largest power of two that is at most half a piece away
        uint64_t bound = end;
        if (i < count) {
            const uint64_t unit =
                end % (count * step) == 0 ? step : std::max<uint64_t>(step / 2, 1);
            const double ideal = double(end) * double(i) / double(count);
            bound = uint64_t(ideal / double(unit) + 0.5) * unit;
        }
        bound = std::clamp(bound, first + 1, end - (count - i));
        pieces.push_back({0, start + first, start + bound});
        first = bound;
    }
    return pieces;
}

uint64_t default_pieces(uint64_t samples, size_t frames) {
    // The first one is to have more than the pilot samples of adaptive sampling: with its rates the
    // others need not trace them
    return frames > 1 ? 1 : std::clamp<uint64_t>(samples / 32, 1, 16);
}

Result<void> create_job(Job& job) {
    std::error_code error;
    if (fs::exists(job.path("job.json"), error))
        return Error{
            "farm-job",
            fmt::format("{} is a job already; `velatura farm retry` continues it, or choose "
                        "another folder with --job",
                        job.folder)};
    for (const char* folder : {"pieces", "work", "parts", "frames", "logs", "preview"}) {
        fs::create_directories(job.path(folder), error);
        if (error)
            return Error{"io-write",
                         fmt::format("cannot make {}: {}", job.path(folder), error.message())};
    }
    if (!job.mix.empty()) {
        const Result<std::string> preset = read_file(job.mix);
        if (!preset) return preset.error();
        if (const auto ok = write_file_atomically(job.path(preset_name), *preset); !ok)
            return ok.error();
        job.mix = job.path(preset_name);
    }
    return write_file_atomically(job.path("job.json"), to_json(job));
}

Result<void> add_pieces(Job& job, const std::vector<Piece>& pieces) {
    std::vector<Piece> added(job.pieces.begin() + std::ptrdiff_t(job.first_pieces),
                             job.pieces.end());
    added.insert(added.end(), pieces.begin(), pieces.end());
    const json j = {{"schema", rounds_schema}};
    if (const auto ok = write_file_atomically(job.path("rounds.json"), with_pieces(j, added)); !ok)
        return ok.error();
    job.pieces.insert(job.pieces.end(), pieces.begin(), pieces.end());
    return {};
}

Result<Job> read_job(const std::string& folder) {
    std::error_code error;
    const std::string file = folder + "/job.json";
    if (!fs::is_regular_file(file, error))
        return Error{"farm-job", fmt::format("{} is not a job folder: no job.json", folder)};
    const Result<std::string> text = read_file(file);
    if (!text) return text.error();
    const json j = parsed(*text);
    if (!j.is_object() || j.value("schema", json()) != job_schema)
        return Error{"farm-job", fmt::format("{}: expected schema {}", file, job_schema)};
    std::string damaged = file;
    try {
        Job job = from_json(j);
        if (const std::string rounds = folder + "/rounds.json"; fs::exists(rounds, error)) {
            const Result<std::string> more = read_file(rounds);
            if (!more) return more.error();
            damaged = rounds;
            add_rounds(parsed(*more), job);
        }
        job.folder = fs::absolute(folder).lexically_normal().string();
        while (job.folder.size() > 1 && job.folder.back() == '/') job.folder.pop_back();
        if (!job.mix.empty()) job.mix = job.path(job.mix);
        return job;
    } catch (const std::exception& e) {
        return Error{"farm-job", fmt::format("{} is damaged: {}", damaged, e.what())};
    }
}

}  // namespace velatura::farm
