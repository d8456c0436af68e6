// SPDX-License-Identifier: Apache-2.0
#include "farm/piece_state.h"

#include "base/atomic_file.h"
#include "base/json_depth.h"
#include "base/json_numbers.h"
#include "farm/process.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <sys/stat.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <exception>
#include <filesystem>

namespace velatura::farm {

namespace fs = std::filesystem;

namespace {

using json = nlohmann::ordered_json;

constexpr const char* piece_schema = "velatura.farm.piece/1";

struct StateName {
    State state;
    std::string_view name;
};

constexpr StateName state_names[] = {{State::Waiting, "waiting"},  {State::Running, "running"},
                                     {State::Lost, "lost"},        {State::Done, "done"},
                                     {State::Failed, "failed"},    {State::GaveUp, "gave-up"},
                                     {State::Canceled, "canceled"}};

State state_of(const std::string& name) {
    for (const StateName& s : state_names)
        if (s.name == name) return s.state;
    throw std::out_of_range("unknown state \"" + name + "\"");
}

json to_json(const Attempt& a) {
    json j;
    j["node"] = a.node;
    j["host"] = a.host;
    j["process"] = a.process;
    if (!a.task.empty()) j["task"] = a.task;
    j["start_s"] = a.start_s;
    j["wall_s"] = a.wall_s;
    j["cpu_s"] = a.cpu_s;
    if (a.trace_s > 0) j["trace_s"] = a.trace_s;
    j["peak_bytes"] = a.peak_bytes;
    j["code"] = a.code;
    if (!a.reason.empty()) j["reason"] = a.reason;
    j["log"] = a.log;
    return j;
}

Attempt attempt_of(const json& j) {
    return {.node = j.at("node").get<std::string>(),
            .host = j.at("host").get<std::string>(),
            .task = j.value("task", ""),
            .process = whole_number<int>(j.at("process")),
            .start_s = j.at("start_s").get<double>(),
            .wall_s = j.at("wall_s").get<double>(),
            .cpu_s = j.at("cpu_s").get<double>(),
            .trace_s = j.value("trace_s", 0.0),
            .peak_bytes = whole_number<uint64_t>(j.at("peak_bytes")),
            .code = whole_number<int>(j.at("code")),
            .reason = j.value("reason", ""),
            .log = j.at("log").get<std::string>()};
}

PieceState state_from(const json& j) {
    PieceState s;
    s.state = state_of(j.at("state").get<std::string>());
    s.failures = whole_number<int>(j.at("failures"));
    s.percent = j.at("percent").get<double>();
    for (const json& a : j.at("attempts")) s.attempts.push_back(attempt_of(a));
    if (s.attempts.empty() && s.state != State::Waiting)
        throw std::out_of_range("a state without an attempt");
    if (s.state != State::Done) return s;
    const json& part = j.at("part");
    s.part = Part{.bytes = whole_number<uint64_t>(part.at("bytes")),
                  .sha256 = part.at("sha256").get<std::string>(),
                  .scene = part.at("scene").get<std::string>(),
                  .settings = part.at("settings").get<std::string>()};
    return s;
}

/// Whether the machine of a running piece is silent. `file_s`: when it wrote last.
bool is_lost(const Attempt& attempt, double file_s) {
    if (now_s() - file_s > silence_s) return true;
    return attempt.host == host_name() && ::kill(attempt.process, 0) != 0 && errno == ESRCH;
}

Result<PieceState> read_piece(const Job& job, size_t piece, bool is_job_canceled) {
    const std::string file = job.state_file(piece);
    PieceState state;

    struct stat about {};

    if (::stat(file.c_str(), &about) == 0) {
        const Result<std::string> text = read_file(file);
        if (!text) return text.error();
        const json j = is_json_too_deep(*text) ? json() : json::parse(*text, nullptr, false);
        if (!j.is_object() || j.value("schema", json()) != piece_schema)
            return Error{"farm-piece",
                         fmt::format("{} is damaged; remove it to render the piece again", file)};
        try {
            state = state_from(j);
        } catch (const std::exception& e) {
            return Error{"farm-piece",
                         fmt::format("{} is damaged: {}; remove it to render the piece again", file,
                                     e.what())};
        }
        const double file_s = double(about.st_mtim.tv_sec) + double(about.st_mtim.tv_nsec) * 1e-9;
        if (state.state == State::Running && is_lost(state.attempts.back(), file_s))
            state.state = State::Lost;
    }
    if (is_job_canceled && state.state != State::Done && state.state != State::Running)
        state.state = State::Canceled;
    return state;
}

}  // namespace

std::string_view name_of(State state) {
    for (const StateName& s : state_names)
        if (s.state == state) return s.name;
    return "";
}

Result<PieceState> read_piece(const Job& job, size_t piece) {
    if (piece >= job.pieces.size())
        return Error{"farm-piece", fmt::format("{} has no piece {}; its last one is {}", job.folder,
                                               piece, job.pieces.size() - 1)};
    return read_piece(job, piece, is_canceled(job));
}

Result<std::vector<PieceState>> read_pieces(const Job& job) {
    const bool is_job_canceled = is_canceled(job);
    std::vector<PieceState> states;
    states.reserve(job.pieces.size());
    for (size_t i = 0; i < job.pieces.size(); ++i) {
        Result<PieceState> state = read_piece(job, i, is_job_canceled);
        if (!state) return state.error();
        states.push_back(std::move(*state));
    }
    return states;
}

Result<void> write_piece(const Job& job, size_t piece, const PieceState& s) {
    json j;
    j["schema"] = piece_schema;
    j["state"] = name_of(s.state);
    j["failures"] = s.failures;
    j["percent"] = s.percent;
    j["attempts"] = json::array();
    for (const Attempt& a : s.attempts) j["attempts"].push_back(to_json(a));
    if (s.part)
        j["part"] = {{"bytes", s.part->bytes},
                     {"sha256", s.part->sha256},
                     {"scene", s.part->scene},
                     {"settings", s.part->settings}};
    return write_file_atomically(job.state_file(piece),
                                 j.dump(1, ' ', false, json::error_handler_t::replace) + "\n");
}

bool is_canceled(const Job& job) {
    std::error_code ignored;
    return fs::exists(job.cancel_file(), ignored);
}

void note_failure(PieceState& state, const Job& job, const std::string& reason, bool repeats) {
    state.attempts.back().reason = reason;
    state.part.reset();
    state.percent = 0;
    ++state.failures;
    state.state = repeats || state.failures > job.retries ? State::GaveUp : State::Failed;
}

Result<void> reset_failures(const Job& job) {
    std::error_code error;
    fs::remove(job.cancel_file(), error);
    if (error)
        return Error{"io-write",
                     fmt::format("cannot remove {}: {}", job.cancel_file(), error.message())};
    Result<std::vector<PieceState>> states = read_pieces(job);
    if (!states) return states.error();
    for (size_t i = 0; i < states->size(); ++i) {
        PieceState& s = (*states)[i];
        if (s.state == State::Done || s.state == State::Running) continue;
        fs::remove(job.result_file(job.pieces[i].frame), error);
        if (s.attempts.empty()) continue;
        s.failures = 0;
        s.state = State::Waiting;
        if (const Result<void> ok = write_piece(job, i, s); !ok) return ok.error();
    }
    return {};
}

double now_s() {
    return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch())
        .count();
}

}  // namespace velatura::farm
