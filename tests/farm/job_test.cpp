// SPDX-License-Identifier: Apache-2.0
// Job folders without a render: how samples are split, and what files of the folder mean.
#include "farm/job.h"

#include "base/atomic_file.h"
#include "base/command_line.h"
#include "base/output_lock.h"
#include "farm/check.h"
#include "farm/cost.h"
#include "farm/merge_job.h"
#include "farm/piece_state.h"
#include "farm/preview.h"
#include "farm/process.h"
#include "farm/rounds.h"
#include "farm/run_piece.h"
#include "farm/status.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <numeric>
#include <optional>
#include <random>
#include <thread>

namespace velatura::farm {

namespace {

namespace fs = std::filesystem;

class FarmJob : public ::testing::Test {
  protected:
    FarmJob() {
        std::string pattern = (fs::temp_directory_path() / "velatura_farm_XXXXXX").string();
        EXPECT_NE(::mkdtemp(pattern.data()), nullptr);
        job.folder = pattern + "/job";
        job.name = "shot";
        job.program = "velatura";
        job.build = "0123";
        job.directory = pattern;
        job.scene = "a scene.usda";
        job.options = {"--res", "8", "8", "--set=/W.x=\"quoted\""};
        job.frames = {"1", "1.5"};
        job.outputs = {pattern + "/o.0001.exr", pattern + "/o.0001.500.exr"};
        job.spp = 8;
        for (size_t frame = 0; frame < 2; ++frame)
            for (Piece p : split_samples(0, 8, 2)) {
                p.frame = frame;
                job.pieces.push_back(p);
            }
    }

    /// Notes that a frame was merged, with what its image states.
    void write_result(size_t frame, uint64_t spp, const std::string& errors) const {
        ASSERT_TRUE(write_file_atomically(job.outputs[frame], "").has_value());
        const nlohmann::json j = {{"schema", "velatura.farm.frame/1"},
                                  {"output", job.outputs[frame]},
                                  {"sha256", ""},
                                  {"wall_s", 1.0},
                                  {"spp", spp},
                                  {"errors", nlohmann::json::parse(errors)}};
        ASSERT_TRUE(write_file_atomically(job.result_file(frame), j.dump()).has_value());
    }

    ~FarmJob() override {
        std::error_code ignored;
        fs::remove_all(job.directory, ignored);
    }

    /// A piece in a state, on a machine that is not this one.
    PieceState state_on(const std::string& node, State state) const {
        PieceState s;
        s.state = state;
        Attempt a;
        a.node = a.host = node;
        a.process = 1;
        a.start_s = now_s();
        a.log = "logs/x.log";
        s.attempts.push_back(a);
        if (state == State::Done) s.part = Part{3, "ab", "s", "t"};
        return s;
    }

    void write(size_t piece, const PieceState& s) const {
        ASSERT_TRUE(write_piece(job, piece, s).has_value());
    }

    State read(size_t piece) const {
        const auto s = read_piece(job, piece);
        EXPECT_TRUE(s.has_value()) << s.error().message;
        return s->state;
    }

    Job job;
};

TEST_F(FarmJob, SplitsAreAdjacentAndAboutEqual) {
    std::mt19937 random(7);
    for (int i = 0; i < 2000; ++i) {
        const uint64_t end = 1 + random() % 5000, count = 1 + random() % 64;
        const std::vector<Piece> pieces = split_samples(0, end, count);
        ASSERT_EQ(pieces.size(), std::min(end, count));
        uint64_t at = 0;
        for (const Piece& p : pieces) {
            ASSERT_EQ(p.first, at) << end << " in " << count;
            ASSERT_LT(p.first, p.end) << end << " in " << count;
            ASSERT_LE(double(p.end - p.first), 1.6 * double(end) / double(pieces.size()) + 1);
            at = p.end;
        }
        ASSERT_EQ(at, end);
    }
}

TEST_F(FarmJob, SplitsOfPowersOfTwoAreWholeBlocks) {
    for (const uint64_t end : {64u, 256u, 4096u})
        for (const uint64_t count : {2u, 4u, 16u})
            for (const Piece& p : split_samples(0, end, count)) {
                EXPECT_EQ(p.end - p.first, end / count);
                EXPECT_EQ(p.first % (end / count), 0u);
            }
    // 3 pieces of 256: bounds are multiples of 32, the largest power of two within half a piece
    for (const Piece& p : split_samples(0, 256, 3)) EXPECT_EQ(p.first % 32, 0u) << p.first;
}

/// Else the others would trace the pilot samples of adaptive sampling again.
TEST_F(FarmJob, TheFirstPieceHasMoreThanThePilotSamples) {
    for (const uint64_t spp : {48u, 64u, 600u})
        for (const uint64_t count : {4u, 16u, 32u}) {
            job.spp = spp;
            job.ranges = count;
            const std::vector<Piece> pieces = first_round(job);
            ASSERT_GE(pieces.size(), 2u);
            EXPECT_GT(pieces[0].end, pilot_samples) << spp << " in " << count;
            uint64_t at = 0;
            for (const Piece& p : pieces) {
                if (p.frame != 0) break;
                EXPECT_EQ(p.first, at);
                EXPECT_LT(p.first, p.end);
                at = p.end;
            }
            EXPECT_EQ(at, spp);
        }
}

TEST_F(FarmJob, IsReadAsItWasWritten) {
    ASSERT_TRUE(create_job(job).has_value());
    const auto found = read_job(job.folder + "/");
    ASSERT_TRUE(found.has_value()) << found.error().message;
    EXPECT_EQ(found->folder, job.folder);
    EXPECT_EQ(found->name, job.name);
    EXPECT_EQ(found->options, job.options);
    EXPECT_EQ(found->scene, job.scene);
    EXPECT_EQ(found->frames, job.frames);
    EXPECT_EQ(found->outputs, job.outputs);
    EXPECT_EQ(found->retries, job.retries);
    ASSERT_EQ(found->pieces.size(), job.pieces.size());
    for (size_t i = 0; i < job.pieces.size(); ++i) {
        EXPECT_EQ(found->pieces[i].frame, job.pieces[i].frame);
        EXPECT_EQ(found->pieces[i].first, job.pieces[i].first);
        EXPECT_EQ(found->pieces[i].end, job.pieces[i].end);
    }
    const auto again = create_job(job);
    ASSERT_FALSE(again.has_value());
    EXPECT_EQ(again.error().code, "farm-job");
}

TEST_F(FarmJob, DamagedFilesAreErrorsThatNameThem) {
    EXPECT_EQ(read_job(job.folder).error().code, "farm-job") << "there is none";
    ASSERT_TRUE(create_job(job).has_value());
    const std::string file = job.path("job.json");
    const std::string whole = *read_file(file);
    const auto refuses = [&](const std::string& text) {
        EXPECT_TRUE(write_file_atomically(file, text).has_value());
        const auto found = read_job(job.folder);
        if (found.has_value()) return false;
        EXPECT_EQ(found.error().code, "farm-job");
        EXPECT_NE(found.error().message.find("job.json"), std::string::npos);
        return true;
    };
    EXPECT_FALSE(refuses(whole));
    for (size_t cut = 0; cut + 2 < whole.size(); cut += 7)
        EXPECT_TRUE(refuses(whole.substr(0, cut))) << cut;
    for (const auto& [from, to] : std::vector<std::pair<std::string, std::string>>{
             {"[0, 0, 4]", "[0, 4, 4]"},
             {"[0, 0, 4]", "[9, 0, 4]"},
             {"[0, 0, 4]", "[0, 0, -4]"},
             {"[0, 0, 4]", "[0, 0]"},
             {"\"local\"", "\"moon\""},
             {"velatura.farm.job/1", "velatura.farm.job/9"},
             {"\"retries\": 2", "\"retries\": 1e39"},
             {"\"directory\"", "\"directories\""},
             {"\"1.5\"\n", "\"1.5\", \"2\"\n"}}) {
        std::string text = whole;
        ASSERT_NE(text.find(from), std::string::npos) << from;
        text.replace(text.find(from), from.size(), to);
        EXPECT_TRUE(refuses(text)) << to;
    }
    const std::string too_deep = std::string(100000, '[') + std::string(100000, ']');
    EXPECT_TRUE(refuses(too_deep));

    EXPECT_TRUE(write_file_atomically(job.state_file(1), "{}").has_value());
    EXPECT_EQ(read_piece(job, 1).error().code, "farm-piece");
    EXPECT_EQ(read_piece(job, 4).error().code, "farm-piece") << "there are four";
}

TEST_F(FarmJob, StatesFollowFromFilesAndTheirAge) {
    ASSERT_TRUE(create_job(job).has_value());
    EXPECT_EQ(read(0), State::Waiting);
    write(0, state_on("elsewhere", State::Running));
    EXPECT_EQ(read(0), State::Running);
    fs::last_write_time(job.state_file(0), fs::file_time_type::clock::now() -
                                               std::chrono::seconds(int(silence_s) + 5));
    EXPECT_EQ(read(0), State::Lost) << "its machine is silent";

    PieceState here = state_on(host_name(), State::Running);
    here.attempts.back().process = ::getpid();
    write(1, here);
    EXPECT_EQ(read(1), State::Running);
    // A child that has ended and is waited for is no process any more
    const pid_t child = ::fork();
    if (child == 0) ::_exit(0);
    ASSERT_EQ(::waitpid(child, nullptr, 0), child);
    here.attempts.back().process = child;
    write(1, here);
    EXPECT_EQ(read(1), State::Lost) << "its process ended without a word";

    write(2, state_on("a", State::Done));
    ASSERT_TRUE(write_file_atomically(job.cancel_file(), "").has_value());
    EXPECT_EQ(read(2), State::Done);
    EXPECT_EQ(read(3), State::Canceled);
    EXPECT_EQ(read(1), State::Canceled);
}

TEST_F(FarmJob, APieceIsTriedAsOftenAsTheJobAllows) {
    ASSERT_TRUE(create_job(job).has_value());
    job.retries = 2;
    PieceState s = state_on("a", State::Running);
    note_failure(s, job, "broke", false);
    EXPECT_EQ(s.state, State::Failed);
    note_failure(s, job, "broke", false);
    EXPECT_EQ(s.state, State::Failed);
    note_failure(s, job, "broke", false);
    EXPECT_EQ(s.state, State::GaveUp) << "one try and two more";
    PieceState usage = state_on("a", State::Running);
    note_failure(usage, job, "refused", true);
    EXPECT_EQ(usage.state, State::GaveUp) << "another try would fail the same";

    write(0, s);
    write(1, state_on("a", State::Done));
    ASSERT_TRUE(reset_failures(job).has_value());
    EXPECT_EQ(read(0), State::Waiting);
    EXPECT_EQ(read_piece(job, 0)->attempts.back().reason, "broke") << "what happened stays";
    EXPECT_EQ(read(1), State::Done);
}

TEST_F(FarmJob, StatusNamesWhatLacks) {
    ASSERT_TRUE(create_job(job).has_value());
    EXPECT_EQ(status_of(job)->state, JobState::Waiting);
    for (const size_t i : {0u, 1u, 2u}) {
        PieceState s = state_on("node" + std::to_string(i), State::Done);
        s.attempts.back().wall_s = 4;
        s.attempts.back().cpu_s = 1800;
        write(i, s);
    }
    PieceState bad = state_on("rust", State::Running);
    note_failure(bad, job, "exit code 2: error: no", true);
    write(3, bad);
    const auto status = status_of(job);
    ASSERT_TRUE(status.has_value());
    EXPECT_EQ(status->state, JobState::Incomplete);
    EXPECT_EQ(status->count(State::Done), 3u);
    EXPECT_DOUBLE_EQ(status->cpu_s, 5400);
    const std::string text = status_text(job, *status, false, 2.0);
    for (const char* part :
         {"3 of 4 pieces done", "1 gave-up", "1.500 CPU hours", "cost 3.00", "missing: pieces 3",
          "rust", "exit code 2: error: no", "frame 1.5", "velatura farm retry"})
        EXPECT_NE(text.find(part), std::string::npos) << part << " in\n" << text;
    EXPECT_EQ(text.find("node1"), std::string::npos) << "pieces that are done are not listed";
    EXPECT_NE(status_text(job, *status, true, 0).find("node1"), std::string::npos);

    const auto j = nlohmann::json::parse(status_json(job, *status, 2.0));
    EXPECT_EQ(j["state"], "incomplete");
    EXPECT_EQ(j["pieces"]["gave-up"], 1);
    EXPECT_EQ(j["list"].size(), 4u);
    EXPECT_EQ(j["list"][3]["node"], "rust");
    EXPECT_EQ(j["list"][2]["samples"], nlohmann::json({0, 4}));
    EXPECT_DOUBLE_EQ(j["cost"], 3.0);
}

TEST(FarmCost, RangesTakeThePieceTime) {
    // 1000 samples of 2 s and a start of 20 s: pieces of 600 s have 290 samples
    EXPECT_EQ(range_count({20, 2}, 1000, 600, 0.5), 4u);
    EXPECT_EQ(range_count({0, 2}, 1000, 500, 0.5), 4u);
    // A little more than a piece is no reason for another one
    EXPECT_EQ(range_count({0, 1}, 600, 500, 0.5), 1u);
    EXPECT_EQ(range_count({0, 1}, 700, 500, 0.5), 2u);
    // Pieces that are shorter than their start would render less than they read
    EXPECT_EQ(range_count({20, 2}, 1000, 1, 0.5), 100u);
    EXPECT_EQ(range_count({20, 2}, 1018, 1, 0.5), 101u) << "101.8 starts";
    // A start of 20 s is a fiftieth of 1000 s, of which 980 s are samples
    EXPECT_EQ(range_count({20, 2}, 980, 600, 0.02), 2u);
    EXPECT_EQ(range_count({20, 2}, 979, 600, 0.02), 1u);
    EXPECT_EQ(range_count({1, 2}, 980, 600, 0.02), 4u) << "a short start decides nothing";
    EXPECT_EQ(range_count({0, 1000}, 8, 1, 0.5), 8u) << "no more ranges than samples";
    EXPECT_EQ(range_count({}, 1000, 600, 0.5), 1u) << "nothing is known";
}

TEST_F(FarmJob, CostsAreThoseOfPiecesThatAreDone) {
    job.frames = {"1", "2", "3", "4", "5"};
    job.outputs.assign(5, "o.exr");
    job.pieces = {{0, 0, 32}, {4, 0, 32}};
    std::vector<PieceState> states = {state_on("a", State::Done), state_on("b", State::Done)};
    states[0].attempts[0].wall_s = 74;
    states[0].attempts[0].trace_s = 64;
    states[1].attempts[0].wall_s = 340;
    states[1].attempts[0].trace_s = 320;
    EXPECT_DOUBLE_EQ(measured_cost(job, states, 0)->sample_s, 2);
    EXPECT_DOUBLE_EQ(measured_cost(job, states, 0)->start_s, 10);
    EXPECT_FALSE(measured_cost(job, states, 2));
    EXPECT_DOUBLE_EQ(expected_cost(job, states, 2)->sample_s, 6) << "half way from 2 to 10";
    EXPECT_DOUBLE_EQ(expected_cost(job, states, 3)->start_s, 17.5);
    EXPECT_DOUBLE_EQ(expected_cost(job, states, 4)->sample_s, 10);
    // One that went on after a stop: all of it counts
    states[1].attempts.push_back(states[1].attempts[0]);
    EXPECT_DOUBLE_EQ(measured_cost(job, states, 4)->sample_s, 680.0 / 32);
    states[1].state = State::Failed;
    EXPECT_DOUBLE_EQ(expected_cost(job, states, 4)->sample_s, 2) << "the nearest that is known";
}

TEST_F(FarmJob, FramesThatTakeLongAreSplit) {
    job.frames = {"1", "2", "3", "4", "5"};
    job.outputs.clear();
    for (int i = 0; i < 5; ++i) job.outputs.push_back(job.directory + "/o.exr");
    job.spp = 128;
    job.piece_time_s = 100;
    job.pieces = first_round(job);
    job.first_pieces = job.pieces.size();
    const auto text = [](const std::vector<Piece>& pieces, size_t from) {
        std::string t;
        for (size_t i = from; i < pieces.size(); ++i)
            t += std::to_string(pieces[i].frame) + "=" + std::to_string(pieces[i].first) + ":" +
                 std::to_string(pieces[i].end) + " ";
        return t;
    };
    EXPECT_EQ(text(job.pieces, 0), "0=0:32 2=0:32 4=0:32 ");
    ASSERT_TRUE(create_job(job).has_value());
    EXPECT_TRUE(add_round(job)->empty()) << "nothing is measured";
    const auto finish = [&](size_t piece, double trace_s) {
        PieceState s = state_on("a", State::Done);
        s.attempts[0].wall_s = s.attempts[0].trace_s = trace_s;
        write(piece, s);
    };
    // 16 s for 32 samples: the frame is one piece, or one more; 320 s: 96 samples are ten pieces
    finish(0, 16);
    finish(1, 16);
    finish(2, 320);
    EXPECT_EQ(add_round(job)->size(), 14u);
    EXPECT_EQ(text(job.pieces, 3).substr(0, 40), "0=32:128 1=0:128 2=32:128 3=0:32 4=32:40");
    EXPECT_EQ(job.pieces.back().end, 128u);
    for (size_t i = 3; i < job.pieces.size(); ++i) finish(i, 168);
    // The rest of frame 3, whose first samples came alone and took 168 s: 504 s in five pieces
    const size_t had = job.pieces.size();
    EXPECT_EQ(add_round(job)->size(), 5u);
    EXPECT_EQ(text(job.pieces, had).substr(0, 4), "3=32");
    EXPECT_EQ(read_job(job.folder)->pieces.size(), job.pieces.size());
    EXPECT_EQ(job.spp_of(3), 128u);
    EXPECT_TRUE(add_round(job)->empty());
}

/// A sequence of which no frame can be rendered is not rendered to its end.
TEST_F(FarmJob, WithoutAMeasuredPieceNothingIsAdded) {
    job.frames = {"1", "2", "3", "4", "5"};
    job.outputs.assign(5, job.directory + "/o.exr");
    job.engine = Engine::Slurm;
    job.spp = 128;
    job.piece_time_s = 100;
    job.pieces = first_round(job);
    job.first_pieces = job.pieces.size();
    ASSERT_TRUE(create_job(job).has_value());
    for (const size_t i : {0u, 1u, 2u}) write(i, state_on("a", State::GaveUp));
    EXPECT_EQ(status_of(job)->state, JobState::Incomplete);
    EXPECT_TRUE(add_round(job)->empty());
    // One suffices, and until the merge adds the others the job goes on
    PieceState done = state_on("a", State::Done);
    done.attempts[0].wall_s = done.attempts[0].trace_s = 10;
    write(1, done);
    EXPECT_EQ(status_of(job)->state, JobState::Running);
    EXPECT_EQ(add_round(job)->size(), 3u) << "the rest of frame 3, and frames 2 and 4";
}

/// The PNG of the image comes behind that of a preview.
TEST_F(FarmJob, AFinishedPreviewWaitsForOneThatIsMade) {
    ASSERT_TRUE(create_job(job).has_value());
    const std::string about = job.preview_file(0, ".json");
    std::optional<OutputLock> lock = *OutputLock::take(about);
    ASSERT_TRUE(write_file_atomically(about, "{}").has_value());
    std::thread finish([&] { finish_preview(job, 0); });
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    EXPECT_TRUE(fs::exists(about)) << "another process makes a preview";
    lock.reset();
    finish.join();
    EXPECT_FALSE(fs::exists(about));
}

/// The image is written while a preview of fewer samples is merged.
TEST_F(FarmJob, ALatePreviewIsNotShown) {
    job.spp = 16;
    job.pieces = {{0, 0, 8}, {0, 8, 16}, {1, 0, 16}};
    ASSERT_TRUE(create_job(job).has_value());
    write(0, state_on("a", State::Done));
    // A compositor that merges nothing, and meanwhile another process writes the image
    write_result(0, 16, "[]");
    fs::rename(job.result_file(0), job.directory + "/result.json");
    const std::string program = job.directory + "/bin/velatura-comp";
    const auto with_program = [&](const std::string& meanwhile) {
        ASSERT_TRUE(write_file_atomically(
                        program, "#!/bin/sh\nfor w; do f=$w; done\n: > \"$f\"\n" + meanwhile + "\n")
                        .has_value());
        fs::permissions(program, fs::perms::owner_all);
    };
    const std::string path = std::getenv("PATH");
    ASSERT_EQ(::setenv("PATH", (job.directory + "/bin:" + path).c_str(), 1), 0);
    with_program("cp '" + job.directory + "/result.json' '" + job.result_file(0) + "'");
    EXPECT_FALSE(*renew_preview(job, 0));
    EXPECT_FALSE(fs::exists(job.preview_file(0, ".exr")));
    EXPECT_FALSE(fs::exists(job.preview_file(0, ".png")));
    EXPECT_FALSE(fs::exists(job.preview_file(0, ".json")));
    fs::remove(job.result_file(0));
    with_program("");
    EXPECT_TRUE(*renew_preview(job, 0)) << "no other process";
    EXPECT_TRUE(fs::exists(job.preview_file(0, ".png")));
    ::setenv("PATH", path.c_str(), 1);
}

TEST_F(FarmJob, LimitsShortenARound) {
    job.frames = {"1"};
    job.outputs.resize(1);
    job.pieces = {{0, 0, 64}};
    job.first_pieces = 1;
    job.spp = 64;
    job.ranges = 1;
    job.target_error = 0.01;
    job.max_spp = 100000;
    job.max_cpu_s = 150;
    ASSERT_TRUE(create_job(job).has_value());
    PieceState s = state_on("a", State::Done);
    s.attempts[0].cpu_s = 64;
    write(0, s);
    // 4 times the samples would take 192 CPU s more; 86 are left
    write_result(0, 64, R"([{"spp": 64, "error": 0.1, "is_lower": false}])");
    EXPECT_EQ(add_round(job)->size(), 1u);
    EXPECT_EQ(job.pieces.back().end, 64u + 86u);
    write(1, s);
    s.attempts[0].cpu_s = 85;
    write(1, s);
    write_result(0, 150, R"([{"spp": 150, "error": 0.07, "is_lower": false}])");
    EXPECT_TRUE(add_round(job)->empty()) << "1 CPU s is left";
    EXPECT_EQ((*read_result(job, 0))->limit, "--max-cpu");
    EXPECT_EQ(status_of(job)->state, JobState::Complete);
    EXPECT_EQ(nlohmann::json::parse(status_json(job, *status_of(job), 0))["outputs"][0]["limit"],
              "--max-cpu");
}

TEST(FarmCheck, NamesMachinesWithOtherPixelsOrFeatures) {
    Job job;
    job.build = "b";
    const MachineCheck usual = {"n1", "b", "Xeon", "avx avx2 avx512f", "s", "p", "{}", ""};
    std::vector<MachineCheck> checks(3, usual);
    checks[1].node = "n2";
    checks[2].node = "n3";
    checks[2].processor = "Atom";
    checks[2].features = "avx avx2";
    EXPECT_TRUE(differing_machines(job, checks).empty()) << "the same pixels";
    EXPECT_EQ(differing_processors(checks), std::vector<std::string>{"n3 (Atom) has no avx512f"});
    checks[2].pixels = "q";
    EXPECT_EQ(differing_machines(job, checks),
              std::vector<std::string>{"n3: pixels q, elsewhere p"});
    checks[1].build = "c";
    EXPECT_EQ(differing_machines(job, checks).size(), 2u);
    checks.assign(2, usual);
    for (MachineCheck& check : checks) check.pixels.clear();
    EXPECT_EQ(differing_machines(job, checks).size(), 2u) << "nothing was compared";
}

TEST_F(FarmJob, ARoundHasTheSamplesThatTheErrorAsksFor) {
    job.target_error = 0.01;
    job.max_spp = 100000;
    FrameResult r;
    EXPECT_FALSE(needs_samples(job, r)) << "its error is not known";
    r.errors = {{64, 0.01, false}};
    r.spp = 64;
    EXPECT_FALSE(needs_samples(job, r));
    // 2 % to 1 % by samples^-0.6: 64 x 2^(1/0.6) = 203.2, in steps of 128 / 16
    r.errors = {{64, 0.02, false}};
    EXPECT_TRUE(needs_samples(job, r));
    EXPECT_EQ(next_spp(job, r), 208u);
    // The last two rounds had -0.5, the steepest is -0.75: 256 x 1.5^(1/0.625) = 489.8, in steps of
    // 256 / 16
    r.errors = {{64, 0.03, false}, {256, 0.015, false}};
    EXPECT_EQ(next_spp(job, r), 496u);
    EXPECT_FALSE(needs_samples(job, r)) << "the error of the last image is not known";
    r.spp = 256;
    EXPECT_TRUE(needs_samples(job, r));
    // At most 4 times, at least a step, not beyond the limit
    r.errors = {{64, 0.9, false}};
    EXPECT_EQ(next_spp(job, r), 256u);
    r.errors = {{256, 0.010001, false}};
    EXPECT_EQ(next_spp(job, r), 288u);
    job.max_spp = 260;
    EXPECT_EQ(next_spp(job, r), 260u);
    r.errors = {{260, 0.02, false}};
    r.spp = 260;
    EXPECT_FALSE(needs_samples(job, r)) << "it has all samples";
}

TEST_F(FarmJob, RoundsJudgeAnErrorTogether) {
    // Of four images that fall by the usual power, the last one exaggerates by half
    const auto at = [](uint64_t spp, double error, double factor) {
        return ErrorAt{spp, error, false, error / factor, error * factor};
    };
    const double e = 0.3;
    const auto error_of = [&](uint64_t spp) { return e * std::pow(double(spp) / 32, -0.6); };
    std::vector<ErrorAt> errors = {at(32, e, 1.5), at(64, error_of(64), 1.5),
                                   at(128, error_of(128), 1.5), at(256, error_of(256), 1.5)};
    EXPECT_NEAR(error_by_rounds(errors), error_of(256), 1e-12);
    errors[3] = at(256, 1.5 * error_of(256), 1.5);
    // Deviations: ln(1.5) / 1.96, and 0.07 for each e-fold of samples to the last one
    double weights = 0;
    for (int i = 0; i < 4; ++i)
        weights += 1 / (std::pow(std::log(1.5) / 1.96, 2) + std::pow(0.07 * i * std::log(2), 2));
    const double share = std::pow(1.96 / std::log(1.5), 2) / weights;
    EXPECT_NEAR(error_by_rounds(errors), error_of(256) * std::pow(1.5, share), 1e-12);
    EXPECT_LT(error_by_rounds(errors), 1.15 * error_of(256));
    errors[3].low = errors[3].high = 0;
    EXPECT_DOUBLE_EQ(error_by_rounds(errors), errors[3].error) << "its interval is not known";
    // Images that share most of their samples count once
    errors[3] = at(256, 1.5 * error_of(256), 1.5);
    const double before = error_by_rounds(errors);
    errors.insert(errors.begin() + 3, at(240, 1.5 * error_of(240), 1.5));
    EXPECT_DOUBLE_EQ(error_by_rounds(errors), before);
    errors.erase(errors.begin() + 3);
    // One that is sure of itself decides
    errors[3] = at(256, 0.2, 1.0001);
    EXPECT_NEAR(error_by_rounds(errors), 0.2, 1e-4);
}

TEST_F(FarmJob, RoundsAreAddedToFramesThatNeedThem) {
    job.target_error = 0.01;
    job.max_spp = 1000;
    job.first_pieces = job.pieces.size();
    ASSERT_TRUE(create_job(job).has_value());
    for (const size_t i : {0u, 1u, 2u, 3u}) write(i, state_on("a", State::Done));
    EXPECT_TRUE(add_round(job)->empty()) << "nothing is merged";
    write_result(0, 8, R"([{"spp": 8, "error": 0.009, "is_lower": false}])");
    write_result(1, 8, R"([{"spp": 8, "error": 0.03, "is_lower": true}])");
    auto status = status_of(job);
    ASSERT_TRUE(status.has_value());
    EXPECT_EQ(status->is_merged, (std::vector<bool>{true, false}));
    EXPECT_NE(status_text(job, *status, false, 0)
                  .find("largest error at least 3 %, target 1 %, at "
                        "8 samples per pixel"),
              std::string::npos)
        << status_text(job, *status, false, 0);
    EXPECT_EQ(*add_round(job), (std::vector<size_t>{4}));
    const auto found = read_job(job.folder);
    ASSERT_TRUE(found.has_value()) << found.error().message;
    ASSERT_EQ(found->pieces.size(), 5u);
    EXPECT_EQ(found->first_pieces, 4u);
    EXPECT_EQ(found->pieces[4].frame, 1u);
    EXPECT_EQ(found->pieces[4].first, 8u);
    EXPECT_EQ(found->pieces[4].end, 32u);
    EXPECT_FALSE(read_result(*found, 1)->has_value()) << "that image is of the round before";
    EXPECT_TRUE(add_round(job)->empty()) << "the round is not merged yet";
    write(4, state_on("a", State::Done));
    write_result(1, 32, R"([{"spp": 8, "error": 0.03, "is_lower": true},
                            {"spp": 32, "error": 0.0099, "is_lower": false}])");
    EXPECT_EQ(status_of(*found)->state, JobState::Complete);

    // The merge of the second round found no error: nothing is added for that of the first
    write_result(1, 32, R"([{"spp": 8, "error": 0.03, "is_lower": true}])");
    EXPECT_TRUE(add_round(job)->empty());
    EXPECT_TRUE(read_job(job.folder).has_value());
    EXPECT_FALSE(status_of(job)->errors[1]);

    // Pieces behind each other, of frames that there are
    const std::string file = job.path("rounds.json");
    const std::string whole = *read_file(file);
    for (const char* piece : {"[1, 9, 32]", "[2, 8, 32]", "[1, 8, 8]", "[1, 8]"}) {
        std::string text = whole;
        const size_t at = text.find("[1, 8, 32]");
        ASSERT_NE(at, std::string::npos) << text;
        ASSERT_TRUE(write_file_atomically(file, text.replace(at, 10, piece)).has_value());
        const auto damaged = read_job(job.folder);
        ASSERT_FALSE(damaged.has_value()) << piece;
        EXPECT_EQ(damaged.error().code, "farm-job");
        EXPECT_NE(damaged.error().message.find("rounds.json"), std::string::npos);
    }
}

TEST_F(FarmJob, AProcessReportsItsEndAndItsLines) {
    std::vector<std::string> lines;
    ProcessRequest request;
    request.arguments = {"sh", "-c", "echo one; echo two >&2; printf three; exit 7"};
    request.on_line = [&](std::string_view line) { lines.emplace_back(line); };
    auto ended = run_process(request);
    ASSERT_TRUE(ended.has_value());
    EXPECT_EQ(ended->code, 7);
    EXPECT_FALSE(ended->is_killed);
    EXPECT_EQ(lines, (std::vector<std::string>{"one", "two", "three"}));

    request.arguments = {"sh", "-c", "kill -9 $$"};
    ended = run_process(request);
    EXPECT_EQ(ended->code, 128 + 9);
    EXPECT_TRUE(ended->is_killed);

    request.arguments = {"sh", "-c",
                         "trap 'echo stopping; exit 3' TERM; while :; do sleep 0.05; done"};
    int asked = 0;
    request.is_to_stop = [&] { return ++asked > 3; };
    lines.clear();
    ended = run_process(request);
    EXPECT_EQ(ended->code, 3);
    EXPECT_EQ(lines, std::vector<std::string>{"stopping"});

    request = {};
    request.arguments = {"/no/such/program"};
    lines.clear();
    request.on_line = [&](std::string_view line) { lines.emplace_back(line); };
    ended = run_process(request);
    EXPECT_EQ(ended->code, 127);
    ASSERT_EQ(lines.size(), 1u);
    EXPECT_EQ(lines[0], "error: cannot start /no/such/program [farm-process]");
}

/// What one command line holds, another one reads alike.
TEST(GivenWords, AreReadAlikeAgain) {
    struct Values {
        std::vector<int> size;
        std::vector<double> crop;
        std::vector<std::string> sets, names;
        std::string text;
        bool flag = false;
        int count = 0;

        bool operator==(const Values&) const = default;
    };

    const auto words_of = [](const std::vector<std::string>& typed, Values& v) {
        CommandLine line("", "x");
        Command command = line.add_subcommand("go", "");
        std::string scene, left;
        command.add_option("scene", scene, "");
        Command group = command.add_group("G");
        group.add_option("--res", v.size, "").size(100);
        group.add_option("--crop", v.crop, "").expected(4);
        group.add_option("--set", v.sets, "").expected(1).take_all();
        group.add_option("--names", v.names, "").delimiter(',');
        command.add_option("-t,--text", v.text, "");
        command.add_option("-o,--output", left, "");
        group.add_flag("--flag", v.flag, "");
        group.add_flag("-v,--verbose", v.count, "");
        const auto exit = line.parse(typed);
        EXPECT_FALSE(exit) << exit->text;
        return command.given_words({"--output"});
    };
    Values first, second;
    const std::vector<std::string> words = words_of(
        {"go",   "-o",      "out", "s.usda", "--res", "9x9",          "--res", "16x12", "--crop",
         "-0.5", "1",       "0",   "1",      "--set", "/A.x = -1",    "--set", "b\nc",  "--names",
         "p,q",  "--names", "r",   "--flag", "-v",    "--text=-5--1", "-v"},
        first);
    EXPECT_EQ(first.text, "-5--1");
    EXPECT_EQ(first.size, (std::vector<int>{16, 12}));
    std::vector<std::string> again = {"go", "s.usda"};
    again.insert(again.end(), words.begin(), words.end());
    EXPECT_EQ(words_of(again, second), words);
    EXPECT_TRUE(first == second);
    for (const std::string& word : words) EXPECT_EQ(word.find("out"), std::string::npos) << word;
}

}  // namespace

}  // namespace velatura::farm
