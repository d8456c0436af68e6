// SPDX-License-Identifier: Apache-2.0
#include "view/live_frame.h"

#include "app/accuracy.h"
#include "app/exit_codes.h"
#include "app/frame_writer.h"
#include "app/missing_assets.h"
#include "app/output_files.h"
#include "app/render_settings.h"
#include "app/resume.h"
#include "app/scene_loader.h"
#include "app/stop_signals.h"
#include "base/box.h"
#include "base/package_path.h"
#include "base/process/memory_limit.h"
#include "geometry/surface_point.h"
#include "integrator/effect_plan.h"
#include "integrator/schedule.h"
#include "layers/layer_image.h"
#include "render/draft_tracer.h"
#include "render/scene_update.h"
#include "view/camera_edits.h"
#include "view/film_levels.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <utility>

namespace velatura::view {

namespace {

using compositor::window::RenewedLayers;
using Phase = LiveStatus::Phase;

/// Passes take about so long once the image has a few samples, and are shown after each [s].
constexpr double pass_s = 1;
/// A first draft that took longer makes the next one coarser, one that took less finer [s].
constexpr double longest_draft_s = 0.12, shortest_draft_s = 0.03;
constexpr int coarsest = 32, finest = 2;

double seconds_since(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

int floor_div(int a, int b) {
    return a >= 0 ? a / b : -((b - 1 - a) / b);
}

int ceil_div(int a, int b) {
    return -floor_div(-a, b);
}

/// Pixels of a draft that cover a window of the image.
film::Window draft_window(const film::Window& w, int reduction) {
    return {floor_div(w.x0, reduction), floor_div(w.y0, reduction), ceil_div(w.x1, reduction),
            ceil_div(w.y1, reduction)};
}

/// With its place; empty: there is none.
std::string first_error(const Diagnostics& diagnostics) {
    for (const Diagnostic& d : diagnostics.all())
        if (d.severity == Severity::Error) return diagnostics.format(d);
    return {};
}

/// What can be edited.
LiveScene live_scene(const app::FrameInput& input, const scene::Scene& scene) {
    LiveScene out;
    out.origin = scene.camera.world_position;
    out.cameras = input.cameras;
    for (const layers::LightValues& values : input.light_values) {
        LiveLight light;
        light.values = values;
        for (const scene::LightGroup& group : scene.groups) {
            if (std::find(group.prims.begin(), group.prims.end(), values.path) != group.prims.end())
                light.group = group.name;
        }
        const auto at = std::find_if(scene.lights.begin(), scene.lights.end(),
                                     [&](const scene::Light& l) { return l.name == values.path; });
        if (at != scene.lights.end()) {
            light.render_from_light = at->render_from_light;
            light.has_place =
                at->kind != scene::LightKind::Dome && at->kind != scene::LightKind::Distant;
        }
        out.lights.push_back(std::move(light));
    }
    return out;
}

/// Of layers that could not be read.
size_t count_syntax_errors(const Diagnostics& diagnostics) {
    const auto& all = diagnostics.all();
    return size_t(std::count_if(all.begin(), all.end(), [](const Diagnostic& d) {
        return d.code == "usd-syntax" || d.code == "usd-parse";
    }));
}

}  // namespace

LiveFrame::LiveFrame(const app::RenderJob& job,
                     const app::FrameInput& input,
                     bool writes_output,
                     LiveControl& control,
                     Diagnostics& diagnostics)
    : job_(job),
      first_prim_(job.arguments.camera),
      input_(&input),
      camera_prim_(job.arguments.camera),
      syntax_errors_(count_syntax_errors(diagnostics)),
      writes_output_(writes_output),
      control_(control),
      diagnostics_(diagnostics),
      watch_([&control] { control.request([](LiveRequests& r) { r.reloads = true; }); }),
      renderer_(scene::Scene(input.scene), app::render_settings(job, input)),
      first_camera_(input.scene.camera),
      edited_(Clock::now()) {
    integrator::RenderOptions& schedule = renderer_.schedule();
    schedule.snapshot_interval_s = pass_s;
    if (!schedule.is_open_ended)
        control_.set_status([&](LiveStatus& s) {
            s.last_sample = double(schedule.end_sample - schedule.first_sample);
        });
    if (job.settings.layers.has_mattes())
        mattes_ = std::make_unique<const integrator::MatteIds>(renderer_.scene());
    note_problems(diagnostics);
}

bool LiveFrame::is_ended() const {
    return control_.ends() || app::StopSignals::stop_flag();
}

image::Window LiveFrame::image_frame() const {
    const scene::RenderSettings& settings = renderer_.scene().settings;
    return {0, 0, settings.width, settings.height};
}

void LiveFrame::set_phase(Phase phase) {
    control_.set_status([&](LiveStatus& s) { s.phase = phase; });
}

int LiveFrame::run() {
    set_phase(Phase::Building);
    renderer_.build(diagnostics_);
    needs_ =
        app::allot_memory(job_, *input_, renderer_.world().materials.textures(), 0, diagnostics_);
    if (!app::fits_limit(needs_, diagnostics_)) return app::MemoryReached;
    begin_anew();
    note_world();
    watch_files();
    while (true) {
        const LiveRequests asked = control_.take_requests();
        if (is_ended()) return app::Done;
        look_at_requests(asked);
        const bool is_finished = progress().is_finished;
        if (const int reduction = next_reduction(); reduction > 0) {
            draw_draft(reduction);
        } else if (is_moving_ || asked.is_paused || is_finished) {
            set_phase(is_finished ? Phase::Finished : is_moving_ ? Phase::Drafting : Phase::Paused);
            control_.wait_for_request();
        } else if (!progress().is_learned) {
            learn();
        } else {
            advance();
        }
    }
}

void LiveFrame::look_at_requests(const LiveRequests& asked) {
    const LiveEdits& edits = asked.edits;
    is_moving_ = edits.is_moving;
    if (asked.region) set_region(*asked.region);
    if (edits.values || edits.camera_prim || asked.reloads) reload(edits);
    if (edits.camera)
        set_camera(*edits.camera);
    else if (edits.is_camera_reset)
        set_camera(first_camera_);
    if (asked.pick) pick(*asked.pick);
    if (asked.save_as) {
        set_phase(Phase::Writing);
        write(*asked.save_as, false);
    }
}

/// After the scene was read.
void LiveFrame::note_world() {
    const Box3 bounds = renderer_.world().accelerator->bounds();
    const auto offered = std::make_shared<LiveScene>(live_scene(*input_, renderer_.scene()));
    control_.set_status([&](LiveStatus& s) {
        s.bounds = bounds.isEmpty() ? Box3d() : Box3d(Vec3d(bounds.min), Vec3d(bounds.max));
        s.camera = renderer_.scene().camera;
        s.scene_camera = first_camera_;
        s.scene = offered;
        ++s.loads;
    });
}

void LiveFrame::watch_files() {
    std::vector<std::string> files;
    for (const std::string& layer : input_->layer_files)
        files.push_back(split_package_path(layer).front());
    for (const std::string& path : app::scene_file_paths(input_->scene))
        files.push_back(split_package_path(path).front());
    watch_.watch(files);
}

void LiveFrame::note_problems(const Diagnostics& diagnostics) {
    constexpr size_t most = 200;
    std::vector<std::string> lines;
    for (const Diagnostic& d : diagnostics.all()) {
        if (d.severity != Severity::Error && d.severity != Severity::Warning) continue;
        if (lines.size() < most) lines.push_back(diagnostics.format(d));
    }
    const auto problems = std::make_shared<const std::vector<std::string>>(std::move(lines));
    control_.set_status([&](LiveStatus& s) { s.problems = problems; });
}

/// Composes and translates the scene as it is now, with the edits. A scene that cannot be read
/// leaves the image as it was; the next one that can has these edits.
void LiveFrame::reload(const LiveEdits& edits) {
    set_phase(Phase::Loading);
    if (edits.values) values_ = *edits.values;
    if (edits.camera_prim)
        camera_prim_ = edits.camera_prim->empty() ? first_prim_ : *edits.camera_prim;
    const std::string prim_before = std::exchange(job_.arguments.camera, camera_prim_);
    const std::vector<std::string> changed = watch_.changed_files();
    const auto is_layer = [&](const std::string& file) {
        return std::any_of(
            input_->layer_files.begin(), input_->layer_files.end(),
            [&](const std::string& layer) { return split_package_path(layer).front() == file; });
    };
    const bool has_other_files = !std::all_of(changed.begin(), changed.end(), is_layer);
    app::MissingAssetsOfReload missing;
    Diagnostics diagnostics;
    app::print_diagnostics(diagnostics, job_.arguments.quiet, job_.arguments.verbosity > 0);
    app::AssetOptions assets = job_.arguments.assets;
    assets.overrides.values.insert(assets.overrides.values.end(), values_.begin(), values_.end());
    const auto keep_image = [&](const Error& error) {
        // The first error has the place
        std::string why = first_error(diagnostics);
        if (why.empty()) why = error.message;
        diagnostics.error(error.code, {}, {}, error.message);
        note_problems(diagnostics);
        job_.arguments.camera = prim_before;
        control_.report(why + "; the image is that of before", true);
    };
    const auto loaded = app::load_stage(job_.arguments.scene, diagnostics, assets);
    if (!loaded) return keep_image(loaded.error());
    // While a layer is edited it may be incomplete
    const size_t syntax_errors = count_syntax_errors(diagnostics);
    if (syntax_errors > syntax_errors_)
        return keep_image({"usd-parse", "a layer of the scene cannot be read"});
    const auto frames = app::frames_of(job_.arguments);
    const double frame =
        frames && !frames->empty() ? frames->front() : loaded->stage.start_time_code();
    Result<app::PreparedFrame> prepared =
        app::prepare_frame(job_, *loaded, frame, false, diagnostics);
    if (!prepared) return keep_image(prepared.error());
    syntax_errors_ = syntax_errors;
    missing.accept();
    take_scene(std::move(*prepared), has_other_files, edits);
    note_problems(diagnostics);
    if (const std::string error = first_error(diagnostics); !error.empty())
        control_.report(error, true);
}

/// has_other_files: textures and the like have changed, which the scene does not show.
void LiveFrame::take_scene(app::PreparedFrame frame, bool has_other_files, const LiveEdits& edits) {
    // It refers to the world as it was
    region_.reset();
    reloaded_.emplace(std::move(frame));
    input_ = &reloaded_->input;
    const scene::Scene& scene = *reloaded_->scene;
    const scene::Camera seen = renderer_.scene().camera;
    const bool is_moved = !edits.camera_prim && !is_same_pose(seen, first_camera_);
    // With the lens that the scene has now
    const auto moved = [&](const Vec3d& origin) {
        return with_pose(render::rebased(scene.camera, origin), render::rebased(seen, origin));
    };
    // Messages are for what nobody in this window did
    const bool is_of_files = !edits.values && !edits.camera_prim;
    first_camera_ = scene.camera;
    const render::Settings wanted = app::render_settings(job_, *input_);
    std::string what = "files of the scene";
    if (has_other_files || wanted.layers != renderer_.settings().layers ||
        wanted.omitted != renderer_.settings().omitted) {
        renderer_ = render::Renderer(scene::Scene(scene), wanted);
    } else {
        scene::Scene next = scene;
        if (is_moved) next.camera = moved(scene.camera.world_position);
        const render::UpdateReport report = render::update(renderer_, std::move(next));
        what = report.text();
        if (report.is_unchanged()) {
            if (is_of_files) control_.report("read again: nothing has changed");
            if (region_window_ != image::Window()) begin_region();
            note_world();
            return watch_files();
        }
    }
    if (is_moved) renderer_.set_camera(moved(renderer_.scene().camera.world_position));
    renderer_.schedule().snapshot_interval_s = pass_s;
    facts_.reset();
    mattes_ = job_.settings.layers.has_mattes()
                  ? std::make_unique<const integrator::MatteIds>(renderer_.scene())
                  : nullptr;
    renderer_.build(diagnostics_);
    needs_ =
        app::allot_memory(job_, *input_, renderer_.world().materials.textures(), 0, diagnostics_);
    begin_anew();
    note_world();
    watch_files();
    if (is_of_files) control_.report("read again: " + what);
}

/// Nothing of the image is there.
void LiveFrame::begin_anew() {
    of_whole_ = {};
    region_.reset();
    behind_.reset();
    if (!region_window_.is_empty()) begin_region();
    is_other_image_ = true;
    shown_reduction_ = 0;
    edited_ = Clock::now();
    control_.set_status([this](LiveStatus& s) {
        s.camera = renderer_.scene().camera;
        s.samples = s.elapsed_s = s.rays_per_s = 0;
        s.error.reset();
        s.left_s.reset();
    });
}

/// An empty one: the whole image, which goes on where it was.
void LiveFrame::set_region(const image::Window& region) {
    const bool had_region = region_ != nullptr;
    region_window_ = region;
    region_.reset();
    if (!region.is_empty()) {
        if (!behind_ && of_whole_.has_film && renderer_.film().noise().samples_min > 0) {
            film::FileInfo info = renderer_.file_info();
            info.light_values = input_->light_values;
            auto whole = layers::make_layer_image(renderer_.film().sums(), info, false);
            if (whole) behind_ = std::move(whole->image);
        }
        begin_region();
        // What is shown there is no worse than a draft
        if (shown_reduction_ > 0 && behind_) shown_reduction_ = finest;
        return;
    }
    behind_.reset();
    const bool has_image = of_whole_.has_film && renderer_.film().noise().samples_min > 0;
    if (had_region && has_image) publish(true);
    if (!has_image) shown_reduction_ = 0;
    control_.set_status([&](LiveStatus& s) {
        s.region.reset();
        s.samples = has_image ? renderer_.film().noise().samples_mean : 0;
        s.elapsed_s = of_whole_.rendered_s;
        s.error.reset();
    });
}

void LiveFrame::begin_region() {
    const film::Window whole = renderer_.window();
    const film::Window window = {
        std::max(region_window_.x0, whole.x0), std::max(region_window_.y0, whole.y0),
        std::min(region_window_.x1, whole.x1), std::min(region_window_.y1, whole.y1)};
    of_region_ = {};
    control_.set_status([&](LiveStatus& s) {
        s.region = window.is_empty() ? std::nullopt : std::optional<image::Window>(window);
        s.phase = Phase::Learning;
        s.samples = s.elapsed_s = 0;
        s.error.reset();
        s.left_s.reset();
    });
    if (window.is_empty()) return;
    render::Settings settings = renderer_.settings();
    settings.window = window;
    region_ = std::make_unique<render::Renderer>(renderer_.shared_world(), std::move(settings));
    region_->schedule().snapshot_interval_s = pass_s;
}

/// The surface that the ray through the pixel's center meets first.
void LiveFrame::pick(const std::array<int, 2>& pixel) {
    const integrator::World& world = renderer_.world();
    const scene::Scene& scene = renderer_.scene();
    const camera::CameraRay from =
        world.camera.generate_ray({float(pixel[0]) + 0.5f, float(pixel[1]) + 0.5f}, {0.5f, 0.5f});
    const geometry::Ray ray{from.o, from.d, from.t_max};
    const geometry::Hit hit = world.intersect(ray, scene::RayKind::Camera);
    LivePick picked;
    picked.pixel = pixel;
    if (hit.is_valid()) {
        const geometry::SurfacePoint at =
            geometry::make_surface_point(scene, world.geometry, ray, hit);
        if (at.provenance < scene.provenance.size())
            picked.prim = scene.provenance[at.provenance].prim_path;
        if (at.material < scene.materials.size())
            picked.material = scene.materials[at.material].name;
        picked.depth = double(world.camera.depth(at.p));
        picked.point = Vec3d(at.p);
        const Box3& box = at.mesh->bounds();
        picked.bounds = Box3d(Vec3d(box.min), Vec3d(box.max));
        if (at.instance < scene.instances.size())
            picked.bounds = transformed(picked.bounds,
                                        Mat4d(scene.instances[at.instance].render_from_prototype));
    }
    control_.set_status([&](LiveStatus& s) {
        s.pick = std::move(picked);
        ++s.picks;
    });
    control_.wake();
}

/// Where a camera is, with the lens of the scene's.
void LiveFrame::set_camera(const scene::Camera& camera) {
    region_.reset();
    const Vec3d origin = renderer_.scene().camera.world_position;
    renderer_.set_camera(
        with_pose(render::rebased(first_camera_, origin), render::rebased(camera, origin)));
    renderer_.build(diagnostics_);
    begin_anew();
}

/// Of the next draft; 0: none, the image itself is next.
int LiveFrame::next_reduction() const {
    if (shown_reduction_ == 0) return first_reduction_;
    if (is_moving_ || shown_reduction_ <= finest) return 0;
    return shown_reduction_ / 2;
}

/// One sample for every `reduction` x `reduction` pixels, by paths without prepass.
void LiveFrame::draw_draft(int reduction) {
    set_phase(Phase::Drafting);
    const bool is_first = shown_reduction_ == 0;
    const auto start = Clock::now();
    const film::Window whole = image().window();
    const film::LayerSet& layers = renderer_.settings().layers;
    const auto tracer = render::make_draft_tracer(renderer_, mattes_.get());
    film::Film film(draft_window(whole, reduction), layers, {.final_sample_end = 1});
    integrator::RenderOptions schedule;
    schedule.seed = renderer_.settings().tracer.seed;
    schedule.end_sample = 1;
    schedule.tile_size = film::Film::tile_size;
    integrator::RenderCallbacks callbacks;
    // Of cameras that come faster than drafts, some are seen
    callbacks.stop = is_first ? &control_.ends() : &control_.interrupts();
    const auto result = integrator::run_schedule(
        film, schedule,
        [&](int x, int y, uint64_t sample, film::SampleRadiance& out,
            integrator::RayCounts& counts) {
            const int middle = reduction / 2;
            tracer->trace(std::clamp(x * reduction + middle, whole.x0, whole.x1 - 1),
                          std::clamp(y * reduction + middle, whole.y0, whole.y1 - 1), sample, out,
                          counts);
        },
        callbacks);
    if (result.reason == integrator::StopReason::Interrupted) return;
    film::FileInfo info;
    info.display = draft_window(image_frame(), reduction);
    info.pixel_aspect_ratio = renderer_.scene().settings.pixel_aspect_ratio;
    if (mattes_) info.matte_names = mattes_->names();
    info.light_values = input_->light_values;
    render::state_color_space(renderer_.scene().settings, info);
    publish_levels(film, info, reduction);
    shown_reduction_ = reduction;
    if (!is_first) return;
    const double took = seconds_since(start);
    control_.set_status([&](LiveStatus& s) {
        s.draft_s = seconds_since(edited_);
        s.draft_reduction = reduction;
        if (s.drafts == 0) s.first_image_s = s.draft_s;
        ++s.drafts;
    });
    if (took > longest_draft_s) first_reduction_ = std::min(2 * reduction, coarsest);
    if (took < shortest_draft_s) first_reduction_ = std::max(reduction / 2, finest);
}

void LiveFrame::learn() {
    set_phase(Phase::Learning);
    image().learn(&control_.interrupts());
    // What was learned until then is not whole
    progress().is_learned = !control_.interrupts();
}

void LiveFrame::advance() {
    set_phase(Phase::Rendering);
    // All nodes of the sums are kept, which changes no bit: any file of it can be gone on from
    render::Renderer& renderer = image();
    Progress& so_far = progress();
    if (!so_far.has_film) renderer.start_film(film::FilmOptions{.final_sample_end = 0});
    so_far.has_film = true;
    renderer.schedule().curve = so_far.curve;
    integrator::RenderCallbacks callbacks;
    callbacks.progress = [this](const integrator::RenderState& state) { note_progress(state); };
    callbacks.snapshot = [this](const film::Film&, const statistics::ErrorCurve&) {
        publish(false);
    };
    // The first passes are short
    callbacks.snapshot_requested = [] { return true; };
    callbacks.stop = &control_.interrupts();
    callbacks.give_up = &app::StopSignals::stop_flag();
    const integrator::RenderResult result = renderer.advance(callbacks);
    so_far.curve = result.curve;
    so_far.rays += result.rays;
    so_far.rendered_s += result.seconds;
    so_far.is_finished = result.reason != integrator::StopReason::Interrupted;
    if (!so_far.is_finished) return;
    so_far.finished_part = app::Continuation().part_of(job_, result);
    publish(true);
    const film::NoiseEstimate noise = renderer.film().noise();
    const auto error = app::image_error(job_, renderer.film(), noise, so_far.curve);
    control_.set_status([&](LiveStatus& s) {
        s.samples = noise.samples_mean;
        s.elapsed_s = so_far.rendered_s;
        if (!error) return;
        s.error = error->error.value;
        s.is_upper_error = error->is_upper;
        s.is_lower_error = error->is_lower;
    });
    if (writes_output_ && !region_) {
        set_phase(Phase::Writing);
        write(input_->output, true);
    }
    set_phase(Phase::Finished);
}

void LiveFrame::note_progress(const integrator::RenderState& state) {
    const size_t memory_bytes = resident_bytes();
    control_.set_status([&](LiveStatus& s) {
        s.samples = state.samples_per_pixel;
        s.elapsed_s = progress().rendered_s + state.elapsed_s;
        s.memory_bytes = memory_bytes;
        s.left_s = state.left_s;
        if (state.elapsed_s > 0) s.rays_per_s = double(state.rays.total()) / state.elapsed_s;
        if (!state.error) return;
        s.error = state.error;
        s.is_upper_error = state.is_upper_error;
        s.is_lower_error = state.is_lower_error;
    });
}

/// The film so far, which is at rest. What was shown just now can wait where making layers takes
/// long.
void LiveFrame::publish(bool is_final) {
    constexpr double longest_share = 0.2;
    const bool is_first = shown_reduction_ != 1;
    if (!is_final && !is_first && seconds_since(published_) < publish_s_ / longest_share) return;
    const auto start = Clock::now();
    film::FileInfo info = image().file_info();
    info.light_values = input_->light_values;
    publish_levels(image().film(), info, 1);
    shown_reduction_ = 1;
    published_ = Clock::now();
    publish_s_ = seconds_since(start);
}

void LiveFrame::publish_levels(const film::Film& film, const film::FileInfo& info, int reduction) {
    auto levels = film_levels(film, info, reduction, image_frame(),
                              region_ && reduction == 1 && behind_ ? &*behind_ : nullptr);
    if (!levels) return control_.report(levels.error().message, true);
    control_.set_status([&](LiveStatus& s) { s.reduction = reduction; });
    control_.publish(RenewedLayers{std::move(*levels), std::exchange(is_other_image_, false)});
}

/// What beside the render's own settings made the image.
app::FrameFacts LiveFrame::facts_of_file() {
    if (!facts_) {
        facts_.emplace();
        facts_->files = app::scene_files(input_->scene);
        facts_->settings = app::frame_settings(job_, *input_, facts_->files);
    }
    app::FrameFacts facts = *facts_;
    const integrator::RenderOptions& schedule = job_.settings.schedule;
    facts.part = {schedule.first_sample, schedule.end_sample, false};
    if (schedule.is_open_ended) facts.part.end.reset();
    if (progress().is_finished) facts.part = progress().finished_part;
    facts.settings.emplace_back("--guiding", image().prepass().guide.is_used ? "on" : "off");
    const scene::Camera& camera = renderer_.scene().camera;
    if (camera.render_from_camera == first_camera_.render_from_camera) return facts;
    // The scene's own camera is another one: such files do not merge
    std::string matrix;
    for (int row = 0; row < 4; ++row) {
        for (int column = 0; column < 4; ++column)
            matrix += fmt::format(" {}", camera.render_from_camera[row][column]);
    }
    facts.settings.emplace_back("camera edit", matrix.substr(1));
    return facts;
}

/// is_output: as `velatura render` leaves it; else with the sums, to go on from.
void LiveFrame::write(const std::string& path, bool is_output) {
    if (!progress().has_film || image().film().noise().samples_max == 0)
        return control_.report("no samples yet: nothing to write", true);
    app::FrameInput input = *input_;
    // A region replaces no whole image
    const bool is_beside = path.empty() && !region_window_.is_empty();
    if (is_beside)
        input.output =
            std::filesystem::path(input.output).replace_extension(".region.exr").string();
    if (!path.empty()) input.output = path;
    if (is_beside || !path.empty()) input.other_outputs.clear();
    app::RenderJob job = job_;
    if (!is_output) job.arguments.is_resumable = true;
    const app::FrameFacts facts = facts_of_file();
    std::vector<OutputLock> locks;
    if (app::take_outputs(input, locks, diagnostics_) != app::Done)
        return control_.report(input.output + " cannot be written: see the terminal", true);
    if (const Result<void> ok = app::check_outputs(input); !ok)
        return control_.report(ok.error().message, true);
    image().measure_truncation();
    app::MemoryWatch memory(renderer_.world().materials.textures(), needs_.writing);
    std::vector<std::string> files = {input.output};
    files.insert(files.end(), input.other_outputs.begin(), input.other_outputs.end());
    for (const std::string& file : files) {
        input.output = file;
        app::FrameWriter writer(job, input, image(), facts, memory);
        if (progress().is_finished) writer.set_finished();
        const auto written = writer.write(
            progress().curve, integrator::broken_promises(input.plan, progress().rays.effects));
        if (!written) return control_.report(written.error().message, true);
    }
    control_.report(fmt::format("wrote {}{}", fmt::join(files, ", "),
                                is_output ? "" : "; `velatura render --resume` continues it"));
}

}  // namespace velatura::view
