// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/diagnostics.h"
#include "base/result.h"
#include "film/film.h"
#include "integrator/bounce_trial.h"
#include "integrator/branch_trial.h"
#include "integrator/caustics.h"
#include "integrator/guide_training.h"
#include "integrator/matte_ids.h"
#include "integrator/path_tracer.h"
#include "integrator/roulette_trial.h"
#include "integrator/schedule.h"
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

/// What was found out before the first sample. All but the seconds is a function of scene and
/// settings alone.
struct Learned {
    integrator::GuideTraining guide;
    std::optional<integrator::RouletteTrial> roulette;  ///< of Roulette::Efficiency
    std::optional<integrator::BounceTrial> bounces;     ///< of Settings::least_bounce_share
    integrator::BranchTrial branches;

    double seconds() const;
};

/// Renders one frame of a scene into a film of light layers, step by step:
///
///     Renderer renderer(std::move(scene), settings);
///     renderer.prepare(diagnostics);
///     renderer.advance();
///     renderer.write("shot.exr");
///
/// What depends on what: the *world* (geometry, tree, tables of lights and materials) on the scene;
/// what is *learned* on the world and the settings; the *film* on all of them. An edit makes only
/// that anew which depends on it, and says what that is.
///
/// Nothing is printed, no exit code or signal is looked at, and several may live beside each other.
/// Threads: one at a time calls a Renderer, which uses all threads that ThreadLimit allows;
/// callbacks come from them.
class Renderer {
  public:
    /// The scene must outlive it, and cannot be edited.
    Renderer(const scene::Scene& scene, Settings settings);
    /// Its own scene, which can be edited.
    Renderer(scene::Scene&& scene, Settings settings);
    /// A world that was made by another one's build(), with settings that differ in what the world
    /// does not depend on: Settings::world and the scene's size are the other one's.
    Renderer(std::shared_ptr<const integrator::World> world, Settings settings);
    ~Renderer();
    Renderer(Renderer&&) noexcept;
    Renderer& operator=(Renderer&&) noexcept;

    /// All that comes before the first sample, as far as it is not there: build() and learn().
    void prepare(Diagnostics& diagnostics, const std::atomic<bool>* stop = nullptr);

    /// The world, or what of it depends on the edits since. What is wrong with the scene's data
    /// (textures, lights) is said by diagnostics.
    void build(Diagnostics& diagnostics);

    /// Trial paths, as far as the settings ask for them. stop: ends it early; what was learned is
    /// then not whole and no film may come from it.
    void learn(const std::atomic<bool>* stop = nullptr);

    /// A film that goes on from sums that were stored, in place of an empty one. Before the first
    /// advance().
    void start_film(accumulate::SampleSums sums, std::vector<film::BadSample> bad);
    /// An empty one. advance() does it where there is none.
    void start_film(const film::FilmOptions& options);

    /// Traces the samples that the film lacks, up to Settings::schedule. What learning took counts
    /// as part of the time budget. Can be called again, with a schedule that ends later.
    integrator::RenderResult advance(const integrator::RenderCallbacks& callbacks = {},
                                     const integrator::TopUpCounts* top_up = nullptr);

    /// The same up to sample `end` of every pixel, whatever schedule().end_sample is.
    integrator::RenderResult advance_to(uint64_t end,
                                        const integrator::RenderCallbacks& callbacks = {});

    /// Drops the film: the next advance() starts from the first sample.
    void clear_film() { film_.reset(); }

    // Edits of its own scene. Each drops the film and what was learned; prepare() follows the last
    // of them, and makes the parts of the world that are named anew. Numbers are those of the
    // scene; one that it does not have is a mistake of the caller's and ends the program.

    /// The camera: no tree and no tables. Its position is render_from_camera's translation, from
    /// the scene's world_position, which stays; meshes that were made as fine as the first camera
    /// asked for stay as they are.
    void set_camera(const scene::Camera& camera);

    /// Size of the picture, and the pixels of it that are rendered: no tree and no tables.
    void set_size(int width, int height, const std::optional<film::Window>& window = {});

    /// Tables of lights: no geometry. Its group is the old one's.
    void set_light(size_t light, const scene::Light& value);

    /// What materials come to, and tables of lights; the geometry only where it displaces. It may
    /// name the textures, patterns and primvars of the scene.
    void set_material(scene::MaterialId material, const scene::Material& value);

    /// What lies above prototypes in the tree, and tables of lights; the whole tree where an
    /// accelerator of a plugin cannot do that.
    void set_instance(size_t instance, const Mat4& render_from_prototype);

    /// As set_instance(). Shown again, it is where it was or was put since.
    void set_instance_visible(size_t instance, bool is_visible);

    /// The geometry, the tree and tables of lights. It may name the materials and primvars of the
    /// scene.
    void set_shape(size_t shape, const scene::Shape& value);

    /// As set_shape(). Shown again, it is what it was or was made since.
    void set_shape_visible(size_t shape, bool is_visible);

    const scene::Scene& scene() const { return *scene_; }

    const Settings& settings() const { return settings_; }

    /// May be changed between calls of advance().
    integrator::RenderOptions& schedule() { return settings_.schedule; }

    /// Of what is rendered, pixels.
    film::Window window() const;

    /// After build(). It follows this one's edits.
    std::shared_ptr<const integrator::World> shared_world() const { return world_; }

    const integrator::World& world() const { return *world_; }

    /// After learn(): those of the film.
    const film::LayerSet& layers() const { return layers_; }

    const Learned& learned() const { return *learned_; }

    const integrator::PathTracer& tracer() const { return *tracer_; }

    /// The same with the random numbers of another seed.
    std::unique_ptr<const integrator::PathTracer> make_tracer(uint64_t seed) const;

    const integrator::CausticSampler* caustics() const { return caustics_.get(); }

    /// Null without Cryptomattes.
    const integrator::MatteIds* mattes() const { return mattes_.get(); }

    /// After start_film() or advance().
    const film::Film& film() const { return *film_; }

    /// Hands it over; the next advance() starts a new one.
    film::Film take_film();

    /// What the renderer knows of a file of its film: picture, camera, seed, what was left out, and
    /// names of mattes. Names and hashes of scene and settings are the caller's to add.
    layers::FileInfo file_info() const;

    /// The film as EXR of light layers (docs/reference/layers.md), written to a temporary name,
    /// verified and renamed. Errors: those of layers::write_layer_file.
    Result<layers::WriteReport> write(const std::string& path) const;

  private:
    integrator::WorldOptions world_options() const;
    integrator::PathTracerOptions trial_options() const;
    integrator::PathTracerOptions picture_options() const;

    scene::Scene& edit();

    std::unique_ptr<scene::Scene> own_scene_;
    const scene::Scene* scene_;
    Settings settings_;
    std::shared_ptr<integrator::World> own_world_;  ///< null = somebody else's
    std::shared_ptr<const integrator::World> world_;
    integrator::WorldChange change_;  ///< since build()
    /// Those that are hidden, by number, as they are when they are shown.
    std::map<size_t, scene::Instance> hidden_instances_;
    std::map<size_t, scene::Shape> hidden_shapes_;
    std::unique_ptr<const integrator::CausticSampler> caustics_;  ///< null = by paths
    std::unique_ptr<Learned> learned_;
    film::LayerSet layers_;
    std::unique_ptr<const integrator::MatteIds> mattes_;
    std::unique_ptr<const integrator::PathTracer> tracer_;
    std::unique_ptr<film::Film> film_;
};

}  // namespace velatura::render
