// SPDX-License-Identifier: Apache-2.0
#include "app/build_id.h"
#include "app/commands.h"
#include "app/exit_codes.h"
#include "app/failure_line.h"
#include "app/frame_settings.h"
#include "app/parse_values.h"
#include "app/prepare_frame.h"
#include "app/render_layers.h"
#include "app/stop_signals.h"
#include "app/study_renderer.h"
#include "base/atomic_file.h"
#include "base/tasks.h"
#include "study/compare.h"
#include "study/experiments.h"
#include "study/images.h"
#include "study/report.h"
#include "study/report_plots.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <memory>

namespace velatura::app {

namespace {

/// The command line beside the options of the render.
struct StudyArguments {
    RenderArguments render;
    std::string folder;
    double time_s = 180;
    int rounds = 16;
    std::vector<std::string> knobs;
    std::vector<std::string> compare;
    bool resume = false;
};

/// Options of a render that a study has no use for: it neither lists nor takes them.
constexpr std::array refused_options = {"--frames",
                                        "--samples",
                                        "--rates-from",
                                        "--resumable",
                                        "--for-mix",
                                        "--target-error",
                                        "--require-target",
                                        "--halves",
                                        "--deep",
                                        "--deep-samples",
                                        "--checkpoint",
                                        "--snapshot",
                                        "--stats",
                                        "--display",
                                        "--display-layers",
                                        "--preview",
                                        "--every",
                                        "--strict",
                                        "--replay",
                                        "--paths",
                                        "--cryptomatte",
                                        "--cryptomatte-levels",
                                        "--cryptomatte-through",
                                        "--clamp-direct",
                                        "--clamp-indirect",
                                        "--firefly-guard",
                                        "--exr-layout",
                                        "--mode",
                                        "--tile"};

/// The first of them that was given; empty: none.
std::string refused_option(const Command& command) {
    for (const char* name : refused_options)
        if (command.find_option(name).count() > 0) return name;
    return {};
}

std::string processor() {
    std::ifstream file("/proc/cpuinfo");
    for (std::string line; std::getline(file, line);)
        if (line.starts_with("model name"))
            return line.substr(std::min(line.find(": ") + 2, line.size()));
    return "unknown processor";
}

std::string today() {
    const std::time_t now = std::time(nullptr);
    std::tm utc{};
    gmtime_r(&now, &utc);
    char text[16];
    std::strftime(text, sizeof text, "%Y-%m-%d", &utc);
    return text;
}

/// Shows how far a study is: a line that is written over on a terminal, one every few seconds
/// elsewhere.
class StudyProgress {
  public:
    explicit StudyProgress(ProgressStyle style) : style_(style) {}

    void show(const study::StudyState& s) {
        if (style_ == ProgressStyle::None) return;
        const auto now = std::chrono::steady_clock::now();
        const double wait_s = style_ == ProgressStyle::Bar ? 0.1 : 5.0;
        if (std::chrono::duration<double>(now - last_).count() < wait_s) return;
        last_ = now;
        const double by_runs =
            (double(s.round) + double(s.run) / double(s.runs)) / double(s.rounds);
        const double fraction =
            std::min(1.0, std::max(by_runs, s.elapsed_s / std::max(s.time_s, 1e-9)));
        switch (style_) {
            case ProgressStyle::Json:
                fmt::print(
                    "{{\"fraction\":{:.4f},\"round\":{},\"elapsed_s\":{:.1f},\"setting\":\"{}\"}}"
                    "\n",
                    fraction, s.round + 1, s.elapsed_s, s.what);
                break;
            case ProgressStyle::OpenJobDescription:
                fmt::print("openjd_progress: {:.1f}\nopenjd_status: round {}, {}\n", fraction * 100,
                           s.round + 1, s.what);
                break;
            default: {
                const std::string text =
                    fmt::format("study {:3.0f} %  round {} of at most {}  {}/{}  {}",
                                fraction * 100, s.round + 1, s.rounds, s.run + 1, s.runs, s.what);
                if (style_ == ProgressStyle::Bar)
                    fmt::print("\r{:<100.100}", text);
                else
                    fmt::print("{}\n", text);
                is_open_ = style_ == ProgressStyle::Bar;
            }
        }
        std::fflush(stdout);
    }

    void finish() {
        if (is_open_) fmt::print("\r{:100}\r", "");
    }

  private:
    ProgressStyle style_;
    std::chrono::steady_clock::time_point last_ = {};
    bool is_open_ = false;
};

/// One study of one frame.
class FrameStudy {
  public:
    FrameStudy(const StudyArguments& arguments,
               const RenderJob& job,
               const FrameInput& input,
               Diagnostics& diagnostics)
        : arguments_(arguments),
          job_(job),
          input_(input),
          renderer_(job, input, diagnostics),
          progress_(job.progress) {}

    int run() {
        const auto start = std::chrono::steady_clock::now();
        if (renderer_.window().is_empty())
            return fail({"empty-window", "the crop or data window contains no pixel center"},
                        UsageError);
        std::error_code error;
        std::filesystem::create_directories(arguments_.folder, error);
        if (error)
            return fail(
                {"io-write", fmt::format("cannot make {}: {}", arguments_.folder, error.message())},
                RenderError);
        const Result<study::Facts> facts = renderer_.facts();
        if (!facts) return fail(facts.error(), stop_code(RenderError));
        facts_ = *facts;
        knobs_ = study::knobs_for(facts_, {arguments_.knobs.begin(), arguments_.knobs.end()});
        if (knobs_.empty() && !arguments_.knobs.empty())
            return fail(
                {"usage", fmt::format("--knobs: no setting in \"{}\" has an effect in this scene",
                                      fmt::join(arguments_.knobs, ","))},
                UsageError);
        warn_of_names_without_knobs();
        settings_ = study::settings_for(knobs_, facts_);
        describe();

        if (arguments_.resume) {
            if (const Result<void> found = resume_study(); !found)
                return fail(found.error(), Refused);
        }
        const auto render = [this](const study::RenderRequest& request) {
            return renderer_.render(request);
        };
        options_.time_s = arguments_.time_s - seconds_since(start);
        if (tallies_.grid.pixels() == 0) {
            const Result<study::Grid> grid = study::choose_grid(settings_, options_, render);
            if (!grid) return fail(grid.error(), stop_code(RenderError));
            tallies_.grid = *grid;
        }
        options_.time_s = (1 - time_for_images) * arguments_.time_s - seconds_since(start);
        const Result<void> done =
            study::run_experiments(settings_, options_, render, callbacks(), tallies_);
        progress_.finish();
        if (!done)
            return fail(done.error(),
                        done.error().code == "stopped" ? stop_code(TargetMissed) : RenderError);
        if (const Result<void> kept = keep(); !kept) return fail(kept.error(), RenderError);
        study::Report report = study::make_report(subject_, knobs_, facts_, settings_, tallies_);
        if (!StopSignals::stop_flag()) {
            study::add_images(report, tallies_, render,
                              0.75 * (arguments_.time_s - seconds_since(start)));
            add_files(report, arguments_.time_s - seconds_since(start));
        }
        return write(report);
    }

  private:
    /// Part of the study's time that is kept for images in equal time and for files of their size.
    static constexpr double time_for_images = 0.12;

    static double seconds_since(std::chrono::steady_clock::time_point start) {
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    }

    static int stop_code(int otherwise) {
        return StopSignals::stop_flag() ? SignalBase + StopSignals::signal_number() : otherwise;
    }

    std::string path(const char* name) const {
        return (std::filesystem::path(arguments_.folder) / name).string();
    }

    void warn_of_names_without_knobs() const {
        for (const std::string& name : arguments_.knobs) {
            const bool is_studied =
                std::any_of(knobs_.begin(), knobs_.end(),
                            [&](const study::Knob& knob) { return study::is_name_of(name, knob); });
            if (is_studied) continue;
            fmt::print(stderr,
                       "warning: --knobs: \"{}\" is skipped: it has no effect in this scene, or "
                       "`study` does not vary it [no-knob]\n",
                       name);
        }
    }

    void describe() {
        subject_.scene = input_.scene_name;
        subject_.build = std::string(build_id());
        subject_.machine = processor();
        subject_.date = today();
        subject_.width = renderer_.window().width();
        subject_.height = renderer_.window().height();
        subject_.spp = options_.spp = job_.settings.schedule.end_sample;
        subject_.seed = options_.seed = job_.settings.tracer.seed;
        subject_.threads = thread_count();
        options_.width = subject_.width;
        options_.height = subject_.height;
        options_.rounds = arguments_.rounds;
        // What a stored study must agree with: the image, the build, and what is tried
        const image::Window window = renderer_.window();
        std::string text =
            fmt::format("{} {},{} {},{} {:016x} {} {}",
                        settings_hash(frame_settings(job_, input_, scene_files(input_.scene)),
                                      layers_of(job_, input_.scene)),
                        window.x0, window.y0, window.x1, window.y1, input_.content_hash,
                        subject_.build, subject_.spp);
        for (const study::Setting& s : settings_) text += "|" + s.options;
        fingerprint_ = fmt::format("{:016x}", hash_string(text));
    }

    /// Takes up what the folder has.
    Result<void> resume_study() {
        if (!std::filesystem::exists(path("study.state"))) return {};
        const Result<std::string> bytes = read_file(path("study.state"));
        if (!bytes) return bytes.error();
        std::optional<study::Tallies> stored = study::from_bytes(*bytes, fingerprint_);
        if (!stored || stored->settings.size() != settings_.size())
            return Error{"resume-refused",
                         fmt::format("{} belongs to another scene, build, seed or other options, "
                                     "or is damaged; start anew without --resume",
                                     path("study.state"))};
        tallies_ = std::move(*stored);
        return {};
    }

    Result<void> keep() {
        return write_file_atomically(path("study.state"), study::to_bytes(tallies_, fingerprint_));
    }

    study::ExperimentCallbacks callbacks() {
        study::ExperimentCallbacks c;
        c.progress = [this](const study::StudyState& s) { progress_.show(s); };
        c.is_stopped = [] { return StopSignals::stop_flag().load(); };
        // After a crash of the machine no more is lost than half a minute
        c.round_done = [this](const study::Tallies&) {
            if (seconds_since(kept_) < 30) return;
            kept_ = std::chrono::steady_clock::now();
            const Result<void> told_at_the_end = keep();
            (void)told_at_the_end;
        };
        return c;
    }

    void add_files(study::Report& report, double time_s) {
        if (report.images.empty()) return;
        const int width = report.images[0].width, height = report.images[0].height;
        const auto deadline = std::chrono::steady_clock::now() +
                              std::chrono::duration_cast<std::chrono::steady_clock::duration>(
                                  std::chrono::duration<double>(time_s));
        // A few samples have the noise that packs badly
        const study::RenderRequest part{
            .options = {},
            .seed = subject_.seed,
            .grid = {width, height},
            .region = study::noisiest_region(report, tallies_, width, height),
            .spp = {std::min<uint64_t>(subject_.spp, 8)},
            .deadline = deadline};
        report.files = renderer_.measure_files(part, arguments_.folder);
    }

    int write(const study::Report& report) {
        std::vector<std::pair<std::string, std::string>> files = {
            {"report.html", study::to_html(report)},
            {"report.json", study::to_json(report)},
            {"report.csv", study::to_csv(report)}};
        for (const study::ReportPlot& plot : study::report_plots(report))
            files.emplace_back(fmt::format("plot-{}.png", plot.name), study::to_png(plot));
        for (const auto& [name, content] : files) {
            if (const Result<void> ok = write_file_atomically(path(name.c_str()), content); !ok)
                return fail(ok.error(), RenderError);
        }
        if (!job_.arguments.quiet) {
            fmt::print("{}", study::to_text(report));
            fmt::print("{}: {} settings, {} rounds of {} x {} pixels\n", path("report.html"),
                       settings_.size(), tallies_.rounds, tallies_.grid.width,
                       tallies_.grid.height);
        }
        return stop_code(tallies_.rounds >= 2 ? Done : TargetMissed);
    }

    const StudyArguments& arguments_;
    const RenderJob& job_;
    const FrameInput& input_;
    StudyRenderer renderer_;
    StudyProgress progress_;
    study::Facts facts_;
    std::vector<study::Knob> knobs_;
    std::vector<study::Setting> settings_;
    study::Subject subject_;
    study::ExperimentOptions options_;
    study::Tallies tallies_;
    std::string fingerprint_;
    std::chrono::steady_clock::time_point kept_ = std::chrono::steady_clock::now();
};

int compare_reports(const StudyArguments& arguments) {
    const Result<std::string> a = read_file(arguments.compare[0]),
                              b = read_file(arguments.compare[1]);
    if (!a) return fail(a.error(), RenderError);
    if (!b) return fail(b.error(), RenderError);
    const Result<std::string> text = study::compare_reports(*a, *b);
    if (!text) return fail(text.error(), RenderError);
    fmt::print("{}", *text);
    return Done;
}

int run_study(StudyArguments arguments, const Command& command) {
    if (!arguments.compare.empty())
        return arguments.render.scene.empty()
                   ? compare_reports(arguments)
                   : fail({"usage", "--compare reads two reports and takes no scene"}, UsageError);
    if (arguments.render.scene.empty())
        return fail({"usage", "expected a scene to study, or --compare with two reports"},
                    UsageError);
    if (arguments.render.output.empty())
        return fail({"usage", "-o FOLDER is required: the output folder of the report"},
                    UsageError);
    if (const std::string name = refused_option(command); !name.empty())
        return fail({"usage", name + " has no effect in a study"}, UsageError);
    if (!arguments.render.time.empty()) {
        const Result<double> time = parse_duration(arguments.render.time);
        if (!time) return fail({"usage", "--time: " + time.error().message}, UsageError);
        arguments.time_s = *time;
    }
    // These three are the study's; its renders end by their samples, and write nothing
    arguments.folder = arguments.render.output;
    arguments.resume = arguments.render.resume;
    arguments.render.output.clear();
    arguments.render.time.clear();
    arguments.render.resume = false;
    return for_each_frame(arguments.render, [&](const RenderJob& job, const FrameInput& input,
                                                Diagnostics& diagnostics) {
        return FrameStudy(arguments, job, input, diagnostics).run();
    });
}

}  // namespace

void add_study_command(Command& app, std::function<int()>& run) {
    Command command = app.add_subcommand(
        "study",
        "Measure what accuracy costs: error and time of the render's settings, and the gain or "
        "loss of others; takes the options of render that affect its error or time");
    auto arguments = std::make_shared<StudyArguments>();
    declare_render_options(command, arguments->render);
    command.find_option("scene").required(false);
    command.find_option("--output")
        .description(
            "Output folder of report.html, report.json, report.csv, plot-*.png, and the data of "
            "--resume")
        .type_name("FOLDER")
        .default_text("");
    command.find_option("--time")
        .description("Time limit of the study, e.g. 90s, 10m")
        .default_text("3m");
    command.find_option("--resume")
        .description("Add rounds to the study in the output folder, if there is one");
    for (const char* name : refused_options) command.find_option(name).hidden();
    Command what = command.add_group("Study");
    what.add_option("--knobs", arguments->knobs,
                    "Settings to study, by their names in the report or as options, e.g. "
                    "sampler,max-depth")
        .delimiter(',');
    what.add_option("--rounds", arguments->rounds,
                    "Maximum renders of each setting, each with its own seed")
        .range(1, 100000);
    what.add_option("--compare", arguments->compare, "Compare two report.json instead of rendering")
        .expected(2)
        .type_name("A.json B.json");
    command.example("velatura study shot.usda -o study --time 10m");
    command.callback([arguments, command, &run] {
        run = [arguments, command] { return run_study(*arguments, command); };
    });
}

}  // namespace velatura::app
