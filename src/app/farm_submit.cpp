// SPDX-License-Identifier: Apache-2.0
#include "app/farm_submit.h"

#include "app/build_id.h"
#include "app/exit_codes.h"
#include "app/failure_line.h"
#include "app/parse_values.h"
#include "app/render_job.h"
#include "base/frames.h"
#include "base/package_path.h"
#include "farm/engine.h"
#include "farm/process.h"
#include "farm/rounds.h"
#include "farm/run_piece.h"
#include "integrator/sample_placement.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace velatura::app {

namespace {

namespace fs = std::filesystem;

static_assert(farm::pilot_samples == integrator::pilot_samples &&
                  farm::first_samples > integrator::pilot_samples,
              "a part without rates of adaptive sampling would be refused");

/// The command line of `farm submit` beside the options of the render.
struct SubmitArguments {
    RenderArguments render;
    std::string engine = "local", job, name, program;
    std::string pieces = "auto";
    int retries = 2, slots = 0, chunk = 0;
    std::string account, partition, constraint, show, shot, facility;
    std::vector<std::string> sbatch;
    std::string piece_time = "10m", max_time, max_cpu;
    bool is_dry_run = false, has_no_previews = false;
};

/// Options of a render that pieces have no use for, or whose files do not merge.
constexpr std::array refused_options = {
    "--samples",    "--resumable", "--resume",        "--snapshot",       "--time",
    "--rates-from", "--forecast",  "--deep",          "--require-target", "--deep-samples",
    "--crop",       "--replay",    "--paths",         "--preview",        "--every",
    "--stats",      "--display",   "--display-layers"};

/// Options that a job stores in another form.
constexpr std::array own_options = {
    "--output",       "--frames",          "--spp",     "--checkpoint", "--progress",
    "--target-error", "--quiet",           "--verbose", "--engine",     "--job",
    "--name",         "--program",         "--pieces",  "--retries",    "--slots",
    "--dry-run",      "--overwrite-input", "--account", "--partition",  "--constraint",
    "--sbatch",       "--chunk",           "--show",    "--shot",       "--facility",
    "--piece-time",   "--max-time",        "--max-cpu", "--for-mix",    "--no-preview"};

/// Of --pieces; 0: auto.
Result<uint64_t> piece_count(const SubmitArguments& a, uint64_t spp) {
    if (a.pieces == "auto") return 0;
    const auto refuse = [&] {
        return Error{
            "usage",
            fmt::format("--pieces: expected auto or 1 to {} (--spp), found \"{}\"", spp, a.pieces)};
    };
    const bool is_number = !a.pieces.empty() && a.pieces.size() < 10 &&
                           a.pieces.find_first_not_of("0123456789") == std::string::npos;
    if (!is_number) return refuse();
    const uint64_t count = std::stoull(a.pieces);
    if (count < 1 || count > spp) return refuse();
    return count;
}

/// Seconds of an option; 0: not given. Errors: "usage".
Result<double> seconds_of(const char* option, const std::string& text) {
    if (text.empty()) return 0.0;
    const Result<double> s = parse_duration(text);
    if (!s) return Error{"usage", fmt::format("{}: {}", option, s.error().message)};
    return s;
}

/// The options of the engine, each of which belongs to one. Errors: "usage".
Result<std::vector<std::string>> engine_options(const SubmitArguments& a, farm::Engine engine) {
    using farm::Engine;

    struct Row {
        const char* name;
        const std::string& value;
        std::vector<Engine> engines;
    };

    const std::string chunk = a.chunk > 0 ? std::to_string(a.chunk) : "";
    const std::string threads = a.render.threads > 0 ? std::to_string(a.render.threads) : "";
    const Row rows[] = {{"account", a.account, {Engine::Slurm}},
                        {"partition", a.partition, {Engine::Slurm}},
                        {"constraint", a.constraint, {Engine::Slurm}},
                        {"show", a.show, {Engine::OpenCue}},
                        {"shot", a.shot, {Engine::OpenCue}},
                        {"facility", a.facility, {Engine::OpenCue}},
                        {"chunk", chunk, {Engine::OpenCue, Engine::OpenJobDescription}}};
    std::vector<std::string> words;
    for (const Row& row : rows) {
        if (row.value.empty()) continue;
        if (std::find(row.engines.begin(), row.engines.end(), engine) == row.engines.end())
            return Error{"usage", fmt::format("--{} has no effect with --engine {}", row.name,
                                              farm::name_of(engine))};
        words.push_back(fmt::format("--{}={}", row.name, row.value));
    }
    if (a.chunk > 0 && engine == Engine::OpenJobDescription) {
        // Workers make chunks of pieces that take about this long
        const auto piece_time = seconds_of("--piece-time", a.piece_time);
        if (!piece_time) return piece_time.error();
        words.push_back(
            fmt::format("--task-time={}", std::max<int64_t>(1, std::llround(*piece_time))));
    }
    if (!a.sbatch.empty() && engine != Engine::Slurm)
        return Error{"usage", "--sbatch needs --engine slurm"};
    if (!threads.empty() && engine == Engine::Slurm) words.push_back("--cpus-per-task=" + threads);
    if (!threads.empty() && engine == Engine::OpenCue) words.push_back("--threads=" + threads);
    words.insert(words.end(), a.sbatch.begin(), a.sbatch.end());
    return words;
}

/// Errors: "bad-preset".
Result<void> check_preset(const std::string& file) {
    std::string why;
    farm::ProcessRequest request;
    // The compositor reads presets; this program includes nothing of it
    request.arguments = {farm::compositor_program(), "preset", "diff", file, file};
    request.on_line = [&](std::string_view line) {
        constexpr std::string_view begin = "error: ", end = " [bad-preset]";
        if (!why.empty() || !line.starts_with(begin)) return;
        why = line.substr(begin.size());
        if (why.ends_with(end)) why.resize(why.size() - end.size());
    };
    const Result<farm::ProcessResult> ended = farm::run_process(request);
    if (!ended) return ended.error();
    if (ended->code == 0) return {};
    return Error{"bad-preset", why.empty() ? fmt::format("{} cannot be read", file) : why};
}

/// Errors: "usage", where --piece-time was typed and nothing is split by it.
Result<void> check_piece_time(const SubmitArguments& a,
                              const Command& command,
                              farm::Engine engine) {
    using farm::Engine;
    const bool is_split =
        a.pieces == "auto" && (engine == Engine::Local || engine == Engine::Slurm);
    const bool has_chunks = a.chunk > 0 && engine == Engine::OpenJobDescription;
    if (is_split || has_chunks || command.find_option("--piece-time").count() == 0) return {};
    return Error{"usage",
                 "--piece-time has no effect: it needs --pieces auto and --engine local or slurm, "
                 "or --chunk and --engine openjd"};
}

/// When a frame is done and how it is split. Errors: "usage", "file-not-found", "bad-preset".
Result<void> choose_rounds(const SubmitArguments& a,
                           const integrator::RenderOptions& schedule,
                           farm::Job& job) {
    const bool can_add = job.engine == farm::Engine::Local || job.engine == farm::Engine::Slurm;
    const auto piece_time = seconds_of("--piece-time", a.piece_time);
    if (!piece_time) return piece_time.error();
    const auto max_time = seconds_of("--max-time", a.max_time);
    if (!max_time) return max_time.error();
    const auto max_cpu = seconds_of("--max-cpu", a.max_cpu);
    if (!max_cpu) return max_cpu.error();
    job.spp = a.render.spp.value_or(default_spp);
    job.target_error = schedule.target_error;
    job.max_wall_s = *max_time;
    job.max_cpu_s = *max_cpu;
    const bool has_auto_pieces = a.pieces == "auto";
    if (job.target_error > 0) {
        if (!can_add)
            return Error{"usage", fmt::format("--target-error needs --engine local or slurm: the "
                                              "tasks of {} cannot be added to",
                                              farm::name_of(job.engine))};
        job.max_spp = schedule.end_sample;
        job.spp =
            std::min<uint64_t>(job.max_spp, has_auto_pieces ? farm::first_samples : default_spp);
    } else if (job.max_wall_s > 0 || job.max_cpu_s > 0 || !a.render.for_mix.empty()) {
        return Error{"usage",
                     "--max-time, --max-cpu and --for-mix are limits and the goal of rounds: they "
                     "need --target-error"};
    }
    if (!a.render.for_mix.empty()) {
        if (!a.render.halves)
            return Error{"usage",
                         "--for-mix needs --halves: the error of a mix is measured by "
                         "half images"};
        job.mix = fs::absolute(a.render.for_mix).lexically_normal().string();
        if (!fs::is_regular_file(job.mix))
            return Error{"file-not-found", fmt::format("{} not found", job.mix)};
        if (const auto ok = check_preset(job.mix); !ok) return ok.error();
    }
    if (has_auto_pieces && can_add) job.piece_time_s = *piece_time;
    const auto ranges = piece_count(a, job.spp);
    if (!ranges) return ranges.error();
    job.ranges = *ranges;
    return {};
}

/// The output without extension and frame number, as a folder.
std::string default_folder(const std::string& output) {
    const fs::path path = with_hashes(output);
    std::string stem = path.stem().string();
    while (!stem.empty() && std::string_view("#._-").find(stem.back()) != std::string_view::npos)
        stem.pop_back();
    return (path.parent_path() / (stem + ".farm")).string();
}

/// As `velatura render` names the file of a frame.
std::string output_of(const std::string& pattern, const std::string& frame, bool has_many) {
    const fs::path path = pattern;
    const std::string name =
        has_many && !is_sequence(pattern)
            ? (path.parent_path() / (path.stem().string() + ".####" + path.extension().string()))
                  .string()
            : pattern;
    return fs::absolute(frame.empty() ? name : frame_path(name, std::stod(frame)))
        .lexically_normal()
        .string();
}

Result<std::vector<std::string>> frames_of(const RenderArguments& a) {
    if (a.frames.empty() || a.frames == "default") return std::vector<std::string>{a.frames};
    const auto parsed = parse_frames(a.frames);
    if (!parsed) return Error{"usage", "--frames: " + parsed.error().message};
    std::vector<std::string> frames;
    for (const double frame : *parsed) frames.push_back(fmt::format("{}", frame));
    return frames;
}

/// Errors: "usage", "file-not-found", "bad-preset".
Result<farm::Job> make_job(const SubmitArguments& a, const Command& command) {
    for (const char* name : refused_options)
        if (command.find_option(name).count() > 0)
            return Error{"usage", fmt::format("{} cannot be used in a farm job", name)};
    if (a.render.output.empty()) return Error{"usage", "-o FILE is required: the final image"};
    if (a.render.exr_layout == "split")
        return Error{"usage", "--exr-layout split cannot be used in a farm job"};
    if (a.render.firefly_guard == "auto")
        return Error{
            "usage",
            "--firefly-guard auto cannot be used in a farm job, whose pieces have a part of the "
            "samples; --firefly-guard N: the samples per pixel of the whole image"};
    RenderArguments render = a.render;
    render.for_mix.clear();  // of a job it is a preset
    const Result<RenderJob> checked = make_render_job(render);
    if (!checked) return checked.error();
    if (!fs::exists(split_package_path(a.render.scene).front()))
        return Error{"file-not-found", fmt::format("{} not found", a.render.scene)};
    const auto engine = farm::engine_of(a.engine);
    if (!engine) return engine.error();
    if (const auto ok = check_piece_time(a, command, *engine); !ok) return ok.error();
    const auto for_engine = engine_options(a, *engine);
    if (!for_engine) return for_engine.error();
    const auto frames = frames_of(a.render);
    if (!frames) return frames.error();

    farm::Job job;
    job.engine = *engine;
    job.engine_options = *for_engine;
    const std::string folder = a.job.empty() ? default_folder(a.render.output) : a.job;
    job.folder = fs::absolute(folder).lexically_normal().string();
    while (job.folder.size() > 1 && job.folder.back() == '/') job.folder.pop_back();
    job.name = a.name.empty() ? fs::path(job.folder).stem().string() : a.name;
    job.program = a.program.empty() ? farm::own_program() : a.program;
    job.build = std::string(build_id());
    job.directory = fs::current_path().string();
    job.scene = a.render.scene;
    std::vector<std::string> except(refused_options.begin(), refused_options.end());
    except.insert(except.end(), own_options.begin(), own_options.end());
    job.options = command.given_words(except);
    if (!a.render.checkpoint.empty()) job.checkpoint = a.render.checkpoint;
    if (a.render.mode == "tile") job.checkpoint.clear();  // which writes none before its end
    job.retries = a.retries;
    job.slots = a.slots;
    job.frames = *frames;
    if (a.render.frames == "default") {
        job.options.emplace_back("--frames=default");
        job.frames = {""};
    }
    for (const std::string& frame : job.frames)
        job.outputs.push_back(output_of(a.render.output, frame, job.frames.size() > 1));
    job.has_previews = !a.has_no_previews;
    if (const auto ok = choose_rounds(a, checked->settings.schedule, job); !ok) return ok.error();
    // Merges and previews cost as much again: about 3 % of the CPU time of a job
    constexpr double usual_start_share = 0.015;
    if (command.find_option("--piece-time").count() == 0) job.max_start_share = usual_start_share;
    job.pieces = farm::first_round(job);
    job.first_pieces = job.pieces.size();
    return job;
}

int run_submit(const SubmitArguments& a,
               const Command& command,
               const std::function<int(const farm::Job&, bool)>& start) {
    Result<farm::Job> job = make_job(a, command);
    if (!job) return fail(job.error());
    if (const Result<void> made = farm::create_job(*job); !made) return fail(made.error());
    if (!a.render.quiet) {
        fmt::print("{}: {} pieces of {} frame{}\n", job->folder, job->pieces.size(),
                   job->frames.size(), job->frames.size() == 1 ? "" : "s");
        std::fflush(stdout);
    }
    return a.is_dry_run ? int(Done) : start(*job, a.render.quiet);
}

}  // namespace

void add_farm_submit(Command farm,
                     std::function<int()>& run,
                     const std::function<int(const farm::Job&, bool)>& start) {
    Command command = farm.add_subcommand(
        "submit",
        "Split a render into pieces, render them on several machines or on this one, and merge "
        "them; takes the options of render");
    const auto a = std::make_shared<SubmitArguments>();
    declare_render_options(command, a->render);
    for (const char* name : refused_options) command.find_option(name).hidden();
    command.find_option("--output").default_text("");
    command.find_option("--target-error")
        .description(
            "Relative error at which a frame is done: rounds of pieces are added until the merged "
            "image states it, or up to --spp; engines local and slurm");
    command.find_option("--for-mix")
        .description(
            "With --target-error and --halves: preset of `velatura-comp` whose mix must have the "
            "error, instead of the image");
    command.find_option("--checkpoint")
        .description("Checkpoint interval of a piece: what it keeps when its machine fails")
        .default_text("5m");
    Command group = command.add_group("Farm");
    group
        .add_option("--engine", a->engine,
                    "Engine that runs the pieces: local (this machine; returns when all is done), "
                    "slurm (sbatch), openjd (writes a template of Open Job Description), opencue "
                    "(writes a job of OpenCue)")
        .one_of({"local", "slurm", "openjd", "opencue"})
        .common();
    group.add_option("--job", a->job, "Job folder, which all machines can write")
        .type_name("DIR")
        .default_text("the output's name with .farm")
        .not_empty()
        .common();
    group
        .add_option("--pieces", a->pieces,
                    "Sample ranges of a frame; auto: whole frames, and ranges of frames that take "
                    "longer than --piece-time by what their first samples took (engines local and "
                    "slurm; else 1 of several frames, or up to 16 of 32 spp or more)")
        .type_name("N|auto")
        .common();
    group
        .add_option("--piece-time", a->piece_time,
                    "Wall time of a piece that --pieces auto aims at; with --chunk that of a task "
                    "of openjd")
        .type_name("TIME")
        .not_empty();
    group
        .add_option("--max-time", a->max_time,
                    "With --target-error: no round of pieces that is expected to end later after "
                    "the first start")
        .type_name("TIME")
        .not_empty()
        .default_text("none");
    group
        .add_option("--max-cpu", a->max_cpu,
                    "With --target-error: CPU time, e.g. 40h, that no round of pieces is expected "
                    "to exceed")
        .type_name("TIME")
        .not_empty()
        .default_text("none");
    group.add_flag("--no-preview", a->has_no_previews,
                   "Write no interim EXR and PNG of a frame while its pieces arrive");
    group.add_option("--slots", a->slots, "Maximum pieces at a time; 0: local 1")
        .range(0, 100000)
        .common();
    group
        .add_option("--retries", a->retries,
                    "Maximum further tries of a piece that failed; pieces stopped by a signal do "
                    "not count")
        .range(0, 100)
        .common();
    group.add_option("--name", a->name, "Name of the job")
        .default_text("that of the folder")
        .not_empty();
    group.add_option("--program", a->program, "velatura on the machines that render")
        .type_name("PATH")
        .default_text("this program")
        .not_empty();
    group.add_option("--account", a->account, "Slurm account").not_empty();
    group.add_option("--partition", a->partition, "Slurm partition").not_empty();
    group.add_option("--constraint", a->constraint, "Slurm constraint: features of nodes")
        .type_name("LIST")
        .not_empty();
    group
        .add_option("--sbatch", a->sbatch,
                    "Option of sbatch for pieces and merge, e.g. --sbatch=--mem=8G")
        .type_name("WORD")
        .expected(1)
        .take_all();
    group
        .add_option("--chunk", a->chunk,
                    "Pieces of a task: openjd (extension TASK_CHUNKING) and opencue")
        .range(1, 10000)
        .default_text("1");
    group.add_option("--show", a->show, "OpenCue show").default_text("velatura").not_empty();
    group.add_option("--shot", a->shot, "OpenCue shot").default_text("shot").not_empty();
    group.add_option("--facility", a->facility, "OpenCue facility")
        .default_text("local")
        .not_empty();
    group.add_flag("--dry-run", a->is_dry_run, "Write the job folder, and start nothing");
    command.example(
        "velatura farm submit shot.usda -o shot.exr --spp 256 --pieces 8 --job shot.farm");
    command.callback([a, command, start, &run] {
        run = [a, command, start] { return run_submit(*a, command, start); };
    });
}

}  // namespace velatura::app
