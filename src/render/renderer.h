// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/diagnostics.h"
#include "base/result.h"
#include "film/film.h"
#include "integrator/bounce_trial.h"
#include "integrator/caustics.h"
#include "integrator/firefly_trial.h"
#include "integrator/guide_training.h"
#include "integrator/hidden_caustics.h"
#include "integrator/light_trial.h"
#include "integrator/matte_ids.h"
#include "integrator/path_tracer.h"
#include "integrator/roulette_trial.h"
#include "integrator/schedule.h"
#include "integrator/splitting_trial.h"
#include "integrator/truncation_trial.h"
#include "integrator/world.h"
#include "render/settings.h"
#include "scene/scene.h"

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace velatura::render {

/// Results of the prepass: what trial paths found before the first sample. All but the seconds is a
/// function of scene and settings alone.
struct PrepassResults {
    integrator::GuideTraining guide;                        ///< path guiding
    std::optional<integrator::RouletteTrial> roulette;      ///< of Roulette::Efficiency
    std::optional<integrator::BounceTrial> bounces;         ///< of Settings::min_bounce_share
    std::optional<integrator::FireflyTrial> fireflies;      ///< of Settings::firefly_guard
    std::optional<integrator::LightTrial> light;            ///< light tracing; none: not tried
    std::optional<integrator::HiddenCaustics> hidden;       ///< with light tracing
    integrator::SplittingTrial branches;                    ///< path splitting
    std::optional<integrator::TruncationTrial> truncation;  ///< of measure_truncation()

    double seconds() const;  ///< wall-clock time of all trials [s]
};

/// Renders one frame of a scene into a film of light layers, step by step:
///
///     Renderer renderer(std::move(scene), settings);
///     renderer.prepare(diagnostics);
///     renderer.advance();
///     renderer.write("shot.exr");
///
/// Dependencies: the *world* (geometry, BVH, tables of lights and materials) depends on the scene;
/// the *prepass* on world and settings; the *film* on all of them. An edit rebuilds only what
/// depends on it; its docstring names that.
///
/// Threads: one thread at a time calls a Renderer, which uses all threads that ThreadLimit allows;
/// callbacks come from them. Several Renderers can exist at the same time. Nothing is printed; no
/// signal is handled.
class Renderer {
  public:
    // Construction

    /// Renders a scene that must outlive the Renderer and cannot be edited.
    Renderer(const scene::Scene& scene, Settings settings);

    /// Renders a scene that it owns and that can be edited.
    Renderer(scene::Scene&& scene, Settings settings);

    /// Shares the world of another Renderer's build(). Settings::world and the resolution must be
    /// the other one's.
    Renderer(std::shared_ptr<const integrator::World> world, Settings settings);

    ~Renderer();
    Renderer(Renderer&&) noexcept;
    Renderer& operator=(Renderer&&) noexcept;

    // Preparation

    /// build() and learn(), as far as their results are missing.
    void prepare(Diagnostics& diagnostics, const std::atomic<bool>* stop = nullptr);

    /// Builds the world, or what of it depends on edits since the last build().
    /// Errors: none; errors of the scene's data (textures, lights) go to `diagnostics`.
    void build(Diagnostics& diagnostics);

    /// Runs the prepass that the settings request.
    /// Args: stop: ends it early when true; its results are then incomplete, and no film can be
    ///       made from them.
    void learn(const std::atomic<bool>* stop = nullptr);

    /// Measures what the maximum depth of the settings cuts off, into prepass().truncation. After
    /// learn(), for those who state it; without a maximum nothing happens.
    void measure_truncation(const std::atomic<bool>* stop = nullptr);

    // Rendering

    /// Resumes from stored sums instead of an empty film. Before the first advance().
    void start_film(accumulate::SampleSums sums, std::vector<film::BadSample> bad);

    /// Starts an empty film. advance() does this when there is none.
    void start_film(const film::FilmOptions& options);

    /// Traces the samples that the film lacks, up to schedule(). The time of the prepass is part of
    /// the time budget. Can be repeated with a schedule that ends later.
    /// Args:    top_up: samples per pixel to add; null: uniform or adaptive, by the schedule.
    /// Returns: why it stopped, and counts.
    integrator::RenderResult advance(const integrator::RenderCallbacks& callbacks = {},
                                     const integrator::TopUpCounts* top_up = nullptr);

    /// The same up to sample `end` (exclusive) of every pixel instead of schedule().end_sample.
    integrator::RenderResult advance_to(uint64_t end,
                                        const integrator::RenderCallbacks& callbacks = {});

    /// Discards the film: the next advance() starts from the first sample.
    void clear_film() { film_.reset(); }

    // Edits of its own scene. Each discards the film and the prepass; call prepare() after the last
    // edit. Indices are those of the scene; an index out of range is a bug of the caller and ends
    // the program.

    /// Replaces the camera. Rebuilds: nothing. Its position is the translation of
    /// render_from_camera, relative to the scene's world_position, which does not change. Diced
    /// meshes keep the rates of the first camera.
    void set_camera(const scene::Camera& camera);

    /// Replaces the resolution and the data window [px]. Rebuilds: nothing.
    void set_size(int width, int height, const std::optional<film::Window>& window = {});

    /// Replaces a light, which keeps its light group, and its parts where filters with a filterLink
    /// divide it. Rebuilds: tables of lights.
    void set_light(size_t light, const scene::Light& value);

    /// Replaces a material; it can refer to textures, patterns and primvars of the scene. Rebuilds:
    /// materials, tables of lights; geometry where it displaces.
    void set_material(scene::MaterialId material, const scene::Material& value);

    /// Moves an instance. Rebuilds: the top level of the BVH, tables of lights; the whole BVH of a
    /// plugin that cannot update.
    void set_instance(size_t instance, const Mat4& render_from_prototype);

    /// Shows or hides an instance. Rebuilds: as set_instance(). Shown again, it has its last
    /// transform.
    void set_instance_visible(size_t instance, bool is_visible);

    /// Replaces a shape; it can refer to materials and primvars of the scene. Rebuilds: geometry,
    /// BVH, tables of lights.
    void set_shape(size_t shape, const scene::Shape& value);

    /// Shows or hides a shape. Rebuilds: as set_shape(). Shown again, it is its last value.
    void set_shape_visible(size_t shape, bool is_visible);

    // Inputs

    const scene::Scene& scene() const { return *scene_; }

    const Settings& settings() const { return settings_; }

    /// Can be changed between calls of advance().
    integrator::RenderOptions& schedule() { return settings_.schedule; }

    /// Data window [px].
    film::Window window() const;

    // Results of build(): the world, which follows edits

    std::shared_ptr<const integrator::World> shared_world() const { return world_; }

    const integrator::World& world() const { return *world_; }

    // Results of learn()

    /// Layers of the film.
    const film::LayerSet& layers() const { return layers_; }

    const PrepassResults& prepass() const { return *prepass_; }

    const integrator::PathTracer& tracer() const { return *tracer_; }

    /// A tracer with the random numbers of another seed.
    std::unique_ptr<const integrator::PathTracer> make_tracer(uint64_t seed) const;

    /// Light tracer; null: caustics by path tracing or by the caustic sampler.
    const integrator::LightTracer* light_tracer() const { return light_tracer_.get(); }

    /// Caustic sampler; null: caustics by path tracing or by light tracing.
    const integrator::CausticSampler* caustics() const { return caustics_.get(); }

    /// Ids of Cryptomattes; null without Cryptomattes.
    const integrator::MatteIds* mattes() const { return mattes_.get(); }

    // Results of start_film() and advance()

    const film::Film& film() const { return *film_; }

    /// Moves the film out; the next advance() starts a new one.
    film::Film take_film();

    /// Metadata of the film's file: window, camera, frame rate, seed, names of mattes. The
    /// caller adds names and hashes of scene and settings.
    layers::FileInfo file_info() const;

    /// Writes the film as EXR of light layers (docs/reference/layers.md): to a temporary name,
    /// verified, then renamed. Errors: those of layers::write_layer_file.
    Result<layers::WriteReport> write(const std::string& path) const;

  private:
    integrator::WorldOptions world_options() const;
    integrator::PathTracerOptions trial_options() const;
    integrator::PathTracerOptions image_options() const;

    void learn_caustics(const std::atomic<bool>* stop);
    void prepare_film();

    scene::Scene& edit();

    std::unique_ptr<scene::Scene> own_scene_;
    const scene::Scene* scene_;
    Settings settings_;
    std::shared_ptr<integrator::World> own_world_;  ///< null: shared with another Renderer
    std::shared_ptr<const integrator::World> world_;
    integrator::WorldChange change_;  ///< since build()
    /// Hidden ones by index, with the values that they have when shown again.
    std::map<size_t, scene::Instance> hidden_instances_;
    std::map<size_t, scene::Shape> hidden_shapes_;
    std::unique_ptr<const integrator::CausticSampler> caustics_;     ///< null = by paths
    std::unique_ptr<const integrator::CausticPaths> caustic_paths_;  ///< null = no light tracing
    std::unique_ptr<PrepassResults> prepass_;
    film::LayerSet layers_;
    std::unique_ptr<const integrator::MatteIds> mattes_;
    std::unique_ptr<const integrator::PathTracer> tracer_;
    std::unique_ptr<const integrator::LightTracer> light_tracer_;  ///< with caustic_paths_
    std::unique_ptr<film::Film> film_;
};

/// Says in the metadata of a file in which color space its colors are.
void state_color_space(const scene::RenderSettings& settings, layers::FileInfo& info);

}  // namespace velatura::render
