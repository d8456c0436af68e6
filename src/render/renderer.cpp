// SPDX-License-Identifier: Apache-2.0
#include "render/renderer.h"

#include "base/check.h"
#include "image/primaries.h"
#include "render/light_images.h"
#include "render/subdivider_choice.h"

#include <algorithm>
#include <utility>

namespace velatura::render {

namespace {

/// Pixels times samples times a ray to the next surface and one to a light at each of a few
/// scatterings.
double expected_rays(const integrator::RenderOptions& schedule, int width, int height) {
    constexpr int usual_depth = 4;
    // Of a render that something else ends nobody knows how many there will be
    constexpr double usual_samples = 64;
    const int depth =
        schedule.max_depth > 0 ? std::min(schedule.max_depth, usual_depth) : usual_depth;
    const double samples = schedule.is_open_ended
                               ? usual_samples
                               : double(schedule.end_sample - schedule.first_sample);
    return double(width) * double(height) * samples * double(1 + 2 * depth);
}

template <class Matrix>
image::Matrix44 to_floats(const Matrix& m) {
    image::Matrix44 out{};
    for (size_t r = 0; r < 4; ++r) {
        for (size_t c = 0; c < 4; ++c) out[4 * r + c] = float(m[int(r)][int(c)]);
    }
    return out;
}

}  // namespace

double PrepassResults::seconds() const {
    return guide.seconds + branches.seconds + (roulette ? roulette->seconds : 0.0) +
           (bounces ? bounces->seconds : 0.0) + (fireflies ? fireflies->seconds : 0.0) +
           (light ? light->seconds : 0.0) + (hidden ? hidden->seconds : 0.0) +
           (truncation ? truncation->seconds : 0.0);
}

Renderer::Renderer(const scene::Scene& scene, Settings settings)
    : scene_(&scene), settings_(std::move(settings)), layers_(settings_.layers) {}

Renderer::Renderer(scene::Scene&& scene, Settings settings)
    : own_scene_(std::make_unique<scene::Scene>(std::move(scene))),
      scene_(own_scene_.get()),
      settings_(std::move(settings)),
      layers_(settings_.layers) {}

Renderer::Renderer(std::shared_ptr<const integrator::World> world, Settings settings)
    : scene_(&world->scene),
      settings_(std::move(settings)),
      world_(std::move(world)),
      layers_(settings_.layers) {}

Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;

void Renderer::prepare(Diagnostics& diagnostics, const std::atomic<bool>* stop) {
    if (!world_ || change_.is_any()) build(diagnostics);
    if (!tracer_) learn(stop);
}

integrator::WorldOptions Renderer::world_options() const {
    integrator::WorldOptions options = settings_.world;
    if (options.width == 0) options.width = scene_->settings.width;
    if (options.height == 0) options.height = scene_->settings.height;
    if (options.expected_rays == 0)
        options.expected_rays = expected_rays(settings_.schedule, options.width, options.height);
    return options;
}

void Renderer::build(Diagnostics& diagnostics) {
    integrator::WorldOptions options = world_options();
    if (own_world_) {
        own_world_->update(std::exchange(change_, {}), options.width, options.height, diagnostics);
        return;
    }
    if (!options.subdivider) options.subdivider = find_subdivider(*scene_, diagnostics);
    world_ = own_world_ = std::make_shared<integrator::World>(
        *scene_, options, make_light_image_loader(), diagnostics);
    change_ = {};
}

scene::Scene& Renderer::edit() {
    VELATURA_CHECK(own_scene_ != nullptr, "only a scene of the renderer's own can be edited");
    film_.reset();
    tracer_.reset();
    return *own_scene_;
}

void Renderer::set_camera(const scene::Camera& camera) {
    scene::Scene& scene = edit();
    const Vec3d origin = scene.camera.world_position;
    scene.camera = camera;
    scene.camera.world_position = origin;
    change_.camera = true;
}

void Renderer::set_size(int width, int height, const std::optional<film::Window>& window) {
    VELATURA_CHECK(width >= 1 && height >= 1, "an image has at least one pixel");
    scene::Scene& scene = edit();
    scene.settings.width = width;
    scene.settings.height = height;
    settings_.world.width = settings_.world.height = 0;
    settings_.window = window;
    change_.camera = true;
}

void Renderer::set_light(size_t light, const scene::Light& value) {
    scene::Scene& scene = edit();
    VELATURA_CHECK(light < scene.lights.size(), "no such light");
    const scene::GroupId group = scene.lights[light].group;
    scene.lights[light] = value;
    scene.lights[light].group = group;
    // Parts of it, for geometry that its filters act on otherwise, keep what they differ by
    for (scene::Light& part : scene.lights) {
        if (!part.is_filter_copy || part.name != value.name || &part == &scene.lights[light])
            continue;
        scene::Light changed = value;
        changed.filters = std::move(part.filters);
        changed.links = part.links;
        changed.group = group;
        changed.is_camera_visible = false;
        changed.is_filter_copy = true;
        part = std::move(changed);
    }
    change_.lights = true;
}

void Renderer::set_material(scene::MaterialId material, const scene::Material& value) {
    scene::Scene& scene = edit();
    VELATURA_CHECK(material < scene.materials.size(), "no such material");
    scene::Material& old = scene.materials[material];
    change_.materials = true;
    if (scene::is_displacing(old) || scene::is_displacing(value)) change_.geometry = true;
    old = value;
}

void Renderer::set_instance(size_t instance, const Mat4& render_from_prototype) {
    scene::Scene& scene = edit();
    VELATURA_CHECK(instance < scene.instances.size(), "no such instance");
    const auto hidden = hidden_instances_.find(instance);
    scene::Instance& placed =
        hidden == hidden_instances_.end() ? scene.instances[instance] : hidden->second;
    placed.render_from_prototype = render_from_prototype;
    placed.later_render_from_prototype.clear();
    change_.placement = true;
}

void Renderer::set_instance_visible(size_t instance, bool is_visible) {
    scene::Scene& scene = edit();
    VELATURA_CHECK(instance < scene.instances.size(), "no such instance");
    scene::Instance& placed = scene.instances[instance];
    const auto hidden = hidden_instances_.find(instance);
    if (is_visible == (hidden == hidden_instances_.end())) return;
    change_.placement = true;
    if (is_visible) {
        placed = hidden->second;
        hidden_instances_.erase(hidden);
        return;
    }
    hidden_instances_.emplace(instance, placed);
    // What has no inverse is not met by rays
    Mat4 nowhere;
    nowhere.setScale(0.0f);
    placed.render_from_prototype = nowhere;
    placed.later_render_from_prototype.clear();
}

void Renderer::set_shape(size_t shape, const scene::Shape& value) {
    scene::Scene& scene = edit();
    VELATURA_CHECK(shape < scene.shapes.size(), "no such shape");
    const auto hidden = hidden_shapes_.find(shape);
    (hidden == hidden_shapes_.end() ? scene.shapes[shape] : hidden->second) = value;
    change_.geometry = true;
}

void Renderer::set_shape_visible(size_t shape, bool is_visible) {
    scene::Scene& scene = edit();
    VELATURA_CHECK(shape < scene.shapes.size(), "no such shape");
    const auto hidden = hidden_shapes_.find(shape);
    if (is_visible == (hidden == hidden_shapes_.end())) return;
    change_.geometry = true;
    if (is_visible) {
        scene.shapes[shape] = hidden->second;
        hidden_shapes_.erase(hidden);
        return;
    }
    hidden_shapes_.emplace(shape, scene.shapes[shape]);
    // A mesh without faces
    scene.shapes[shape].geometry = scene::Mesh();
}

/// Of what was learned, as far as it was by now.
integrator::PathTracerOptions Renderer::trial_options() const {
    integrator::PathTracerOptions options = settings_.tracer;
    if (prepass_->guide.is_used) options.guide = &prepass_->guide.field;
    if (prepass_->roulette) options.roulette = &prepass_->roulette->gains;
    options.caustics = caustics_.get();
    options.caustic_paths = caustic_paths_.get();
    options.disable_lens = scene_->settings.disable_depth_of_field;
    return options;
}

/// Those of the image, for which trial paths did without what is only written.
integrator::PathTracerOptions Renderer::image_options() const {
    integrator::PathTracerOptions options = trial_options();
    if (settings_.splits) options.branches = &prepass_->branches.map;
    options.mattes = mattes_.get();
    options.deep = settings_.deep.has_value();
    return options;
}

void Renderer::learn(const std::atomic<bool>* stop) {
    VELATURA_CHECK(world_ != nullptr, "build() comes before learn()");
    caustics_ = integrator::make_caustic_sampler(settings_.caustics, *world_);
    prepass_ = std::make_unique<PrepassResults>();
    learn_caustics(stop);
    prepass_->guide = integrator::train_guide(*world_, trial_options(), settings_.guiding, stop);
    if (settings_.tracer.estimator.roulette == integrator::Roulette::Efficiency)
        prepass_->roulette = integrator::try_roulette(*world_, trial_options(), stop);
    layers_ = settings_.layers;
    if (settings_.min_bounce_share) {
        prepass_->bounces =
            integrator::try_bounces(*world_, trial_options(), layers_.last_bounce, stop);
        layers_.last_bounce =
            prepass_->bounces->last_bounce(*settings_.min_bounce_share, layers_.last_bounce);
    }
    if (settings_.firefly_guard) {
        prepass_->fireflies =
            integrator::try_fireflies(*world_, trial_options(), *settings_.firefly_guard, stop);
        layers_.clamp_indirect = prepass_->fireflies->limit;
    }
    mattes_ =
        layers_.has_mattes() ? std::make_unique<const integrator::MatteIds>(*scene_) : nullptr;
    if (settings_.splits)
        prepass_->branches = integrator::try_splitting(*world_, trial_options(), window(), stop);
    tracer_ = std::make_unique<const integrator::PathTracer>(*world_, layers_, image_options());
    light_tracer_ = caustic_paths_
                        ? std::make_unique<const integrator::LightTracer>(
                              *world_, layers_, image_options(), prepass_->light->emission)
                        : nullptr;
}

void Renderer::measure_truncation(const std::atomic<bool>* stop) {
    VELATURA_CHECK(tracer_ != nullptr, "learn() comes before measure_truncation()");
    if (settings_.tracer.max_depth > 0)
        prepass_->truncation = integrator::try_truncation(*world_, trial_options(), stop);
}

/// Whether light tracing finds the caustics, and from where.
void Renderer::learn_caustics(const std::atomic<bool>* stop) {
    using integrator::Caustics;
    caustic_paths_.reset();
    const bool is_wanted =
        settings_.caustics == Caustics::Light || settings_.caustics == Caustics::Auto;
    if (!is_wanted || !integrator::CausticPaths::can_exist(*scene_) ||
        !integrator::CausticPaths::why_not(*world_, settings_.tracer).empty())
        return;
    auto paths = std::make_unique<const integrator::CausticPaths>(*world_);
    if (paths->is_empty()) return;
    caustic_paths_ = std::move(paths);
    prepass_->light = integrator::try_light_tracing(*world_, trial_options(), stop);
    if (settings_.caustics == Caustics::Auto && !prepass_->light->is_used) caustic_paths_.reset();
    if (caustic_paths_)
        prepass_->hidden = integrator::try_hidden_caustics(*world_, trial_options(), stop);
}

std::unique_ptr<const integrator::PathTracer> Renderer::make_tracer(uint64_t seed) const {
    integrator::PathTracerOptions options = image_options();
    options.seed = seed;
    return std::make_unique<const integrator::PathTracer>(*world_, layers_, options);
}

film::Window Renderer::window() const {
    const integrator::WorldOptions size = world_options();
    return settings_.window.value_or(film::Window{0, 0, size.width, size.height});
}

void Renderer::start_film(accumulate::SampleSums sums, std::vector<film::BadSample> bad) {
    film_ = std::make_unique<film::Film>(std::move(sums), std::move(bad));
    prepare_film();
}

void Renderer::start_film(const film::FilmOptions& options) {
    film_ = std::make_unique<film::Film>(window(), layers_, options);
    prepare_film();
}

void Renderer::prepare_film() {
    if (prepass_ && prepass_->hidden) film_->set_hidden_light(prepass_->hidden->light);
    if (settings_.deep) film_->make_deep(*settings_.deep);
}

film::Film Renderer::take_film() {
    VELATURA_CHECK(film_ != nullptr, "there is no film before the first advance()");
    const std::unique_ptr<film::Film> taken = std::move(film_);
    return std::move(*taken);
}

void state_color_space(const scene::RenderSettings& settings, layers::FileInfo& info) {
    const image::StandardSpace* space = image::standard_space(settings.working_space);
    VELATURA_CHECK(space != nullptr, "a working space that files cannot state");
    info.color_space = settings.working_space;
    info.chromaticities = space->primaries;
}

layers::FileInfo Renderer::file_info() const {
    const scene::RenderSettings& s = scene_->settings;
    const integrator::WorldOptions size = world_options();
    layers::FileInfo info;
    info.display = {0, 0, size.width, size.height};
    info.seed = settings_.tracer.seed;
    info.frames_per_second = scene_->frames_per_second;
    info.pixel_aspect_ratio = s.pixel_aspect_ratio;
    info.world_to_camera = to_floats(world_->camera.world_to_camera());
    info.world_to_ndc = to_floats(world_->camera.world_to_ndc());
    info.bad_samples = film_->bad_samples();
    if (mattes_) info.matte_names = mattes_->names();
    state_color_space(s, info);
    return info;
}

Result<layers::WriteReport> Renderer::write(const std::string& path) const {
    VELATURA_CHECK(film_ != nullptr, "advance() comes before write()");
    return film_->write(path, file_info());
}

integrator::RenderResult Renderer::advance(const integrator::RenderCallbacks& callbacks,
                                           const integrator::TopUpCounts* top_up) {
    VELATURA_CHECK(tracer_ != nullptr, "learn() comes before advance()");
    if (!film_) start_film(film::FilmOptions{});
    integrator::RenderOptions options = settings_.schedule;
    if (options.time_budget_s > 0)
        options.time_budget_s = std::max(options.time_budget_s - prepass_->seconds(), 1e-6);
    integrator::RenderResult result = integrator::run_schedule(
        *film_, options,
        [this](int x, int y, uint64_t sample, film::SampleRadiance& out,
               integrator::RayCounts& counts) { tracer_->trace(x, y, sample, out, counts); },
        callbacks, top_up, light_tracer_.get());
    // What building did is part of what the render did
    auto& counts = result.rays.effects.count;
    counts[size_t(scene::Effect::Subdivision)] += world_->refinement.meshes;
    counts[size_t(scene::Effect::Displacement)] += world_->refinement.displaced;
    return result;
}

integrator::RenderResult Renderer::advance_to(uint64_t end,
                                              const integrator::RenderCallbacks& callbacks) {
    settings_.schedule.end_sample = end;
    return advance(callbacks);
}

}  // namespace velatura::render
