// SPDX-License-Identifier: Apache-2.0
#include "app/prepare_frame.h"

#include "app/exit_codes.h"
#include "app/failure_line.h"
#include "app/memory_options.h"
#include "app/parse_values.h"
#include "app/products.h"
#include "app/progress.h"
#include "app/render_layers.h"
#include "app/scene_loader.h"
#include "app/stop_signals.h"
#include "base/frames.h"
#include "base/process/mapping_guard.h"
#include "base/process/memory_limit.h"
#include "base/tasks.h"
#include "render/accelerator_choice.h"
#include "render/volume_loading.h"
#include "translate/authored_names.h"
#include "translate/camera_values.h"
#include "translate/light_values.h"
#include "translate/moments.h"
#include "translate/translate.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace velatura::app {

namespace {

/// The file of a frame; of several frames each needs one of its own.
std::string file_of_frame(const std::string& name, double frame, bool has_many) {
    if (name.empty()) return name;
    if (std::isnan(frame)) frame = 0.0;  // the default time
    if (!has_many || is_sequence(name)) return frame_path(name, frame);
    const std::filesystem::path path(name);
    return frame_path(
        (path.parent_path() / (path.stem().string() + ".####" + path.extension().string()))
            .string(),
        frame);
}

/// A file of one product among several.
std::string beside(const std::string& name, const std::string& suffix) {
    if (name.empty() || suffix.empty()) return name;
    const std::filesystem::path path(name);
    return (path.parent_path() / (path.stem().string() + "." + suffix + path.extension().string()))
        .string();
}

/// Millions as asked for, else what half of the machine's memory holds, and not more than the
/// usual.
size_t instance_limit(std::optional<double> millions) {
    if (millions) return size_t(std::llround(*millions * 1e6));
    constexpr size_t bytes_of_one = 1000;  // with its part of the tree, and while that is built
    return std::min(translate::TranslateOptions().max_instances,
                    MemoryLimit::allowed() / 2 / bytes_of_one);
}

/// What a quarter of the machine's memory holds, and not more than the usual.
size_t copy_limit() {
    constexpr size_t bytes_of_one = 2000;
    return std::min(translate::TranslateOptions().max_copies,
                    MemoryLimit::allowed() / 4 / bytes_of_one);
}

translate::TranslateOptions translate_options(const RenderJob& job, double frame, size_t product) {
    const RenderArguments& a = job.arguments;
    translate::TranslateOptions options;
    options.camera = a.camera;
    options.settings = a.settings;
    options.pass = a.pass;
    options.time = frame;
    options.product = product;
    if (a.resolution.size() == 2)
        options.resolution = std::array<int, 2>{a.resolution[0], a.resolution[1]};
    else if (a.image_width > 0)
        options.resolution = std::array<int, 2>{a.image_width, 0};
    options.material_purpose = a.material_purpose;
    options.working_space = a.working_space;
    if (!a.purposes.empty()) {
        options.purposes = a.purposes;
        options.purposes.emplace_back("default");
    }
    options.max_instances = instance_limit(a.instance_limit);
    options.max_copies = copy_limit();
    for (const DataRequest& request : job.data)
        if (!request.primvar.empty()) options.primvars.push_back(request.primvar);
    options.finds_casters = job.settings.layers.caster_layers;
    options.casters = a.casters;
    options.light_grouping = a.lights == "off"      ? translate::LightGrouping::Off
                             : a.lights == "groups" ? translate::LightGrouping::Groups
                                                    : translate::LightGrouping::PerLight;
    return options;
}

/// Before the plan: only then is it known whether grids hold anything.
void read_volumes(const RenderJob& job, scene::Scene& scene, Diagnostics& diagnostics) {
    // What is left out is not read; surfaces of level sets are no volumes
    std::vector<scene::Volume> unread;
    if (job.settings.omitted.has(scene::Effect::Volumes)) {
        std::erase_if(scene.volumes, [&](scene::Volume& v) {
            if (scene::is_level_set(v, scene.volume_fields)) return false;
            unread.push_back(std::move(v));
            return true;
        });
    }
    render::load_volumes(scene, job.arguments.volume_memory_gb, diagnostics);
    for (scene::Volume& v : unread) scene.volumes.push_back(std::move(v));
}

std::vector<layers::LightValues> light_values(const LoadedStage& loaded,
                                              const scene::Scene& scene,
                                              double frame) {
    std::vector<layers::LightValues> out;
    for (const translate::LightPrimValues& v :
         translate::light_prim_values(loaded.stage, scene, frame))
        out.push_back({v.path, v.type, v.intensity, v.exposure, v.color, v.uses_color_temperature,
                       v.color_temperature, v.varying, v.connected, v.has_color_space,
                       v.is_in_instance, v.shows_material});
    return out;
}

/// Of what prepare_frame() says.
int exit_code_of(const Error& error) {
    const bool is_of_option = error.code == "lpe" || error.code == "unknown-working-space";
    return is_of_option ? UsageError : RenderError;
}

int prepare_all(const RenderArguments& arguments, const FrameFunction& use) {
    if (arguments.progress == "openjd") keep_failures();
    Result<RenderJob> job = make_render_job(arguments);
    if (!job) return fail(job.error(), UsageError);
    const Result<std::vector<double>> asked = frames_of(arguments);
    if (!asked) return fail(asked.error(), UsageError);

    const ThreadLimit threads(arguments.threads);
    if (MemoryLimit::is_set()) {
        const MemoryLimit::Suspension for_their_stacks;
        start_threads();
    }
    const StopSignals signals;
    Diagnostics diagnostics;
    print_diagnostics(diagnostics, arguments.quiet, arguments.verbosity > 0);
    const auto accelerator = render::find_accelerator(arguments.accel, diagnostics);
    if (!accelerator) return RenderError;
    job->settings.world.accelerator = *accelerator;
    MemoryLimit::enforce("while reading the scene");
    const Result<LoadedStage> loaded = load_stage(arguments.scene, diagnostics, arguments.assets);
    if (!loaded)
        return fail(loaded.error(), loaded.error().code == "usage" ? UsageError : RenderError);
    translate::report_authored_names(loaded->stage, diagnostics);
    // As usdrecord does: the start of the stage, which is time 0 where none is authored
    const std::vector<double> frames =
        asked->empty() ? std::vector<double>{loaded->stage.start_time_code()} : *asked;

    if (frames.size() > 1 && !arguments.paths.empty())
        return fail({"usage", "--paths writes the paths of one frame; name it with --frames"},
                    UsageError);

    int worst = Done;
    // One file, or one sample, is of one view
    const bool has_one_view = !arguments.output.empty() || !arguments.replay.empty();
    for (const double frame : frames) {
        size_t product = 0;
        bool has_more = true;
        while (has_more) {
            const Result<PreparedFrame> ready =
                prepare_frame(*job, *loaded, frame, frames.size() > 1, diagnostics, product);
            const std::optional<size_t> next =
                ready && !has_one_view ? next_view(ready->scene->settings) : std::nullopt;
            has_more = next.has_value();
            product = next.value_or(0);
            const int code = ready ? use(*job, ready->input, diagnostics)
                                   : fail(ready.error(), exit_code_of(ready.error()));
            if (code == UsageError || code >= SignalBase) return code;
            worst = worse_exit_code(worst, code);
        }
    }
    return worst;
}

}  // namespace

Result<std::vector<double>> frames_of(const RenderArguments& arguments) {
    if (arguments.frames.empty()) return std::vector<double>();
    if (arguments.frames == "default")
        return std::vector<double>{usd::stage::TimeCode::default_time().value()};
    Result<std::vector<double>> parsed = parse_frames(arguments.frames);
    if (!parsed) return Error{parsed.error().code, "--frames: " + parsed.error().message};
    return parsed;
}

Result<PreparedFrame> prepare_frame(const RenderJob& job,
                                    const LoadedStage& loaded,
                                    double frame,
                                    bool has_many,
                                    Diagnostics& diagnostics,
                                    size_t product) {
    MemoryLimit::enforce("while translating the scene");
    const auto start = std::chrono::steady_clock::now();
    Result<scene::Scene> translated = translate::translate_stage(
        loaded.stage, translate_options(job, frame, product), diagnostics);
    if (!translated) return translated.error();
    // main() says which
    if (!truncated_files().empty())
        return Error{
            "file-lost",
            "files of the scene changed while they were read; nothing is rendered; render again"};
    auto scene = std::make_unique<scene::Scene>(std::move(*translated));
    if (const Result<void> ok = check_render_vars(job, *scene, diagnostics); !ok) return ok.error();
    if (const size_t errors = diagnostics.error_count(); job.arguments.strict && errors > 0)
        return Error{"strict",
                     format_count(errors, "error") + " in the scene; --strict renders nothing"};
    MemoryLimit::enforce("while reading volume grids");
    read_volumes(job, *scene, diagnostics);
    render::Settings settings = job.settings;
    settings.layers = layers_of(job, *scene);
    translate::add_moments(loaded.stage, translate_options(job, frame, product),
                           moments_of(settings.layers), *scene, diagnostics);
    integrator::EffectPlan plan = render::plan_effects(settings, *scene);
    FrameInput input(*scene);
    input.plan = std::move(plan);
    const OutputNames names = output_names(job.arguments, *scene, diagnostics);
    input.output = file_of_frame(names.first, frame, has_many);
    for (const std::string& other : names.others)
        input.other_outputs.push_back(file_of_frame(other, frame, has_many));
    input.stats_file = file_of_frame(beside(job.arguments.stats, names.suffix), frame, has_many);
    input.up_axis = loaded.stage.up_axis();
    input.scene_name = std::filesystem::path(job.arguments.scene).filename().string();
    input.content_hash = loaded.content_hash;
    input.layer_names = loaded.layer_names;
    input.layer_files = loaded.stage.layer_files();
    input.light_values = light_values(loaded, *scene, frame);
    for (const translate::CameraPrimValues& v : translate::camera_prim_values(loaded.stage, frame))
        input.cameras.push_back({v.path, v.focal_length, v.f_stop, v.focus_distance});
    if (!std::isnan(frame)) input.frame = frame;
    input.open_s = loaded.seconds;
    input.translate_s =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    MemoryLimit::enforce("while building the acceleration structures");
    return PreparedFrame{std::move(scene), std::move(input)};
}

int for_each_frame(const RenderArguments& arguments, const FrameFunction& use) {
    return run_in_memory(arguments.memory_limit, [&] { return prepare_all(arguments, use); });
}

}  // namespace velatura::app
