// SPDX-License-Identifier: Apache-2.0
#include "integrator/world.h"

#include "scene/effect_calls.h"
#include "scene/plate.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <iterator>
#include <memory>
#include <utility>
#include <vector>

namespace velatura::integrator {

namespace {

/// Runs `make` and adds up how long it took.
template <class Make>
auto timed(double& seconds, Make make) {
    struct Stopwatch {
        double& seconds;
        std::chrono::steady_clock::time_point start = std::chrono::steady_clock::now();

        ~Stopwatch() {
            seconds +=
                std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        }
    };

    const Stopwatch stopwatch{seconds};
    return make();
}

std::unique_ptr<accel::Accelerator> make_accelerator(const scene::Scene& scene,
                                                     const geometry::GeometrySet& geometry,
                                                     const WorldOptions& options,
                                                     Diagnostics& diagnostics) {
    const accel::SoupScene soup = accel::make_soup(scene, geometry);
    if (options.accelerator) {
        Result<std::unique_ptr<accel::Accelerator>> built = options.accelerator->build(soup);
        if (built) return std::move(*built);
        diagnostics.error(built.error().code, {}, {},
                          built.error().message + "; the built-in BVH is used instead");
    }
    const accel::BvhQuality quality =
        options.bvh_quality
            ? *options.bvh_quality
            : accel::choose_quality(options.expected_rays, accel::triangle_count(soup));
    return accel::build_bvh(soup, accel::options_of(quality));
}

/// Once for all of them: what lies exactly on something else is an error of the scene, and only one
/// can be seen.
void warn_of_duplicates(const scene::Scene& scene,
                        const accel::Duplicates& duplicates,
                        Diagnostics& diagnostics) {
    if (duplicates.count == 0) return;
    const auto& shapes = duplicates.prototype == scene::none
                             ? scene.shapes
                             : scene.prototypes[duplicates.prototype].shapes;
    const scene::ProvenanceId provenance = shapes[duplicates.shape].provenance;
    const std::string prim = provenance < scene.provenance.size()
                                 ? scene.provenance[provenance].prim_path
                                 : std::string();
    diagnostics.warn("duplicate-triangles", {}, prim,
                     fmt::format("{} duplicate triangles, exactly on top of others, are skipped; "
                                 "the first is triangle {} of this prim",
                                 duplicates.count, duplicates.triangle));
}

geometry::GeometrySet make_geometry(const scene::Scene& scene,
                                    const shading::MaterialEvaluator& materials,
                                    const WorldOptions& options,
                                    geometry::RefinementStats& stats,
                                    Diagnostics& diagnostics) {
    const bool is_displaced =
        std::any_of(scene.materials.begin(), scene.materials.end(), scene::is_displacing);
    if (!options.subdivider && !is_displaced) return geometry::GeometrySet(scene);
    const geometry::RefinementTools tools{options.subdivider, is_displaced ? &materials : nullptr};
    const geometry::DicingView view(scene.camera, options.width, options.height);
    geometry::Refinement refinement =
        geometry::refine(scene, tools, options.dicing, view, diagnostics);
    stats = refinement.stats;
    return geometry::GeometrySet(scene, {}, std::move(refinement));
}

/// Null where there is nothing in it that light could meet, unless it is forced.
std::unique_ptr<media::VolumeSet> make_volumes(const scene::Scene& scene,
                                               const WorldOptions& options) {
    const bool is_any =
        std::any_of(scene.volumes.begin(), scene.volumes.end(), [&](const scene::Volume& v) {
            return scene::has_extinction(v, scene.volume_fields) ||
                   scene::has_emission(v, scene.volume_fields);
        });
    if (!is_any && !options.forced.has(scene::Effect::Volumes)) return nullptr;
    return std::make_unique<media::VolumeSet>(scene, options.media);
}

/// Of everything that light can meet.
Box3 content_bounds(const accel::Accelerator& accelerator, const media::VolumeSet* volumes) {
    Box3 bounds = accelerator.bounds();
    if (volumes) bounds.extendBy(volumes->bounds());
    return bounds;
}

lights::LightSet make_lights(const scene::Scene& scene,
                             const WorldOptions& options,
                             const lights::ImageLoader& load_image,
                             const geometry::GeometrySet& geometry,
                             const shading::MaterialEvaluator& materials,
                             Diagnostics& diagnostics) {
    return lights::LightSet(scene, load_image, diagnostics,
                            {.compensate_mis = options.compensate_mis,
                             .by_area = options.samples_light_area,
                             .geometry = &geometry,
                             .materials = &materials});
}

std::unique_ptr<lights::LightSelector> make_selector(const lights::LightSet& lights,
                                                     const accel::Accelerator& accelerator,
                                                     const media::VolumeSet* volumes,
                                                     const WorldOptions& options) {
    return lights::make_light_selector(lights, content_bounds(accelerator, volumes),
                                       {.kind = options.light_selection});
}

/// Surfaces that the camera's surroundings are searched through.
constexpr int max_surfaces = 1024;

/// Solids that a ray from the camera leaves without having entered them, the innermost first.
std::vector<scene::MaterialId> bodies_left(const World& world,
                                           const Vec3& o,
                                           const Vec3& d,
                                           float time) {
    std::vector<scene::MaterialId> left, entered;
    geometry::Ray ray{o, d};
    ray.time = time;
    for (int i = 0; i < max_surfaces; ++i) {
        const geometry::Hit hit = world.intersect(ray, scene::RayKind::Camera);
        if (!hit.is_valid()) break;
        const geometry::SurfacePoint point =
            geometry::make_surface_point(world.scene, world.geometry, ray, hit);
        const auto pass = [&](const geometry::SurfacePoint& face) {
            const auto match = std::find(entered.rbegin(), entered.rend(), face.material);
            if (face.ng.dot(d) < 0.0f)
                entered.push_back(face.material);
            else if (match != entered.rend())
                entered.erase(std::next(match).base());
            else
                left.push_back(face.material);
        };
        const bool is_body = world.materials.bounds_solid(point.material);
        if (is_body && world.nested) {
            for (const geometry::SurfacePoint& face : world.nested->faces_at(point)) pass(face);
            ray = geometry::spawn_ray(NestedDielectrics::clear_of_faces(point), d);
            ray.time = time;
            continue;
        }
        if (is_body) pass(point);
        ray = geometry::spawn_ray(point, d);
    }
    return left;
}

/// Calls visit(class, shape, instance or null) for every shape that is placed.
template <class Visit>
void for_each_placed_shape(const scene::Scene& scene, const Visit& visit) {
    for (uint32_t i = 0; i < scene.shapes.size(); ++i)
        visit(scene.shapes[i].link, scene.shapes[i], nullptr);
    for (uint32_t i = 0; i < scene.instances.size(); ++i) {
        const std::vector<scene::Shape>& shapes =
            scene.prototypes[scene.instances[i].prototype].shapes;
        for (uint32_t s = 0; s < shapes.size(); ++s)
            visit(scene::link_class(scene, i, s), shapes[s], &scene.instances[i]);
    }
}

std::vector<CustomShadowSurfaces> list_own_shadow_surfaces(const scene::Scene& scene) {
    std::vector<CustomShadowSurfaces> all;
    // Where rays differ in what they meet, materials that emit have shadows by shadow rays
    const bool has_emissive = std::any_of(scene.materials.begin(), scene.materials.end(),
                                          [](const auto& m) { return scene::is_emissive(m); });
    if (has_emissive && scene::plain_links(scene).has_custom_shadows())
        all.push_back({scene::plain_links(scene), std::nullopt});
    for (const scene::MeshLight& light : scene.mesh_lights) {
        if (!light.links.has_custom_shadows() ||
            std::any_of(all.begin(), all.end(),
                        [&](const auto& known) { return known.is_of(light.links); }))
            continue;
        CustomShadowSurfaces surfaces{light.links, std::nullopt};
        surfaces.links.lit = scene::none;
        if (const scene::LinkSet* casters = scene::find_link_set(scene, light.links.casters))
            surfaces.met = *casters;
        all.push_back(std::move(surfaces));
    }
    if (all.empty()) return all;
    for_each_placed_shape(
        scene, [&](scene::LinkClass c, const scene::Shape& shape, const scene::Instance*) {
            if (shape.light == scene::none) return;
            for (CustomShadowSurfaces& surfaces : all)
                if (surfaces.met && surfaces.is_of(scene.mesh_lights[shape.light].links))
                    surfaces.met->add(c);
        });
    return all;
}

/// [set][material]: whether the set holds anything of the material.
std::vector<std::vector<bool>> list_caster_materials(const scene::Scene& scene) {
    std::vector<std::vector<bool>> materials(scene.linking.sets.size(),
                                             std::vector<bool>(scene.materials.size()));
    for_each_placed_shape(
        scene, [&](scene::LinkClass c, const scene::Shape& shape, const scene::Instance* instance) {
            std::vector<scene::MaterialId> found = {shape.material};
            if (const auto* mesh = std::get_if<scene::Mesh>(&shape.geometry))
                found.insert(found.end(), mesh->face_materials.begin(), mesh->face_materials.end());
            if (instance) found.push_back(instance->material_override);
            for (size_t set = 0; set < materials.size(); ++set) {
                if (!scene.linking.sets[set].holds(c)) continue;
                for (const scene::MaterialId m : found)
                    if (m < scene.materials.size()) materials[set][m] = true;
            }
        });
    return materials;
}

/// Of light that shines.
template <class Light>
bool has_multiplier(const Light& l) {
    if (is_black(l.Le)) return false;
    return l.diffuse_multiplier != 1.0f || l.specular_multiplier != 1.0f;
}

}  // namespace

World::World(const scene::Scene& s,
             const WorldOptions& options,
             const lights::ImageLoader& load_image,
             Diagnostics& diagnostics)
    : scene(s),
      materials(s, diagnostics, options.forced, options.texture_bias, options.texture_bytes),
      geometry(
          timed(times.tessellate_s,
                [&] { return make_geometry(s, materials, options, refinement, diagnostics); })),
      accelerator(timed(times.accelerator_s,
                        [&] { return make_accelerator(s, geometry, options, diagnostics); })),
      volumes(make_volumes(s, options)),
      lights(timed(
          times.lights_s,
          [&] { return make_lights(s, options, load_image, geometry, materials, diagnostics); })),
      selector(timed(times.lights_s,
                     [&] { return make_selector(lights, *accelerator, volumes.get(), options); })),
      camera(s.camera, options.width, options.height),
      options_(options),
      load_image_(load_image) {
    warn_of_duplicates(s, accelerator->stats().duplicates, diagnostics);
    make_dielectrics();
    set_facts();
    make_plate();
}

World::World(std::unique_ptr<scene::Scene> plate_scene,
             const WorldOptions& options,
             const lights::ImageLoader& load_image,
             Diagnostics& diagnostics)
    : World(*plate_scene, options, load_image, diagnostics) {
    plate_scene_ = std::move(plate_scene);
}

/// What there is to say of it was said of the whole scene.
void World::make_plate() {
    plate.reset();
    if (!catchers) return;
    Diagnostics ignored;
    plate.reset(new World(std::make_unique<scene::Scene>(scene::plate_of(scene)), options_,
                          load_image_, ignored));
}

void World::update_plate(const WorldChange& change) {
    if (change.geometry || change.placement || change.materials || change.lights)
        return make_plate();
    if (!plate || !change.camera) return;
    plate->plate_scene_->camera = scene.camera;
    Diagnostics ignored;
    plate->update(change, options_.width, options_.height, ignored);
}

void World::update(const WorldChange& change, int width, int height, Diagnostics& diagnostics) {
    options_.width = width;
    options_.height = height;
    if (change.materials) materials.update(diagnostics);
    if (change.geometry) {
        refinement = {};
        geometry = make_geometry(scene, materials, options_, refinement, diagnostics);
    } else if (change.placement) {
        geometry.place_instances(scene);
    }
    const bool can_move = !change.geometry && change.placement &&
                          accelerator->move_instances(accel::make_soup(scene, geometry));
    if (!can_move && (change.geometry || change.placement))
        accelerator = make_accelerator(scene, geometry, options_, diagnostics);
    if (change.geometry || change.placement || change.materials || change.lights) {
        selector.reset();
        lights = make_lights(scene, options_, load_image_, geometry, materials, diagnostics);
        selector = make_selector(lights, *accelerator, volumes.get(), options_);
    }
    if (change.geometry || change.placement || change.materials) make_dielectrics();
    if (change.camera) camera = camera::CameraModel(scene.camera, width, height);
    set_facts();
    update_plate(change);
}

/// What is inside of solids, and the trees that tell.
void World::make_dielectrics() {
    interior_media =
        materials.has_interior_media() ? std::make_unique<InteriorMedia>(scene) : nullptr;
    subsurface = materials.has_subsurface()
                     ? std::make_unique<SubsurfaceWalk>(scene, geometry, materials)
                     : nullptr;
    nested = materials.has_priorities()
                 ? std::make_unique<NestedDielectrics>(scene, geometry, materials)
                 : nullptr;
}

/// What follows from the other parts at the cost of a look.
void World::set_facts() {
    const auto is_forced = [this](scene::Effect e) { return options_.forced.has(e); };
    uses_lens = camera.has_lens() || is_forced(scene::Effect::DepthOfField);
    has_motion = geometry.has_motion() || camera.has_motion() || lights.has_motion() ||
                 (volumes && volumes->has_motion()) || is_forced(scene::Effect::DeformationBlur);
    chooses_lights = !selector->is_single() || is_forced(scene::Effect::LightSelection);
    has_very_many_lights = lights::wants_fine_numbers(lights);
    has_light_links = lights.has_light_links() || is_forced(scene::Effect::LightLinking);
    has_custom_shadows = lights.has_custom_shadows();
    custom_shadow_surfaces = list_own_shadow_surfaces(scene);
    has_ray_visibility = scene.linking.has_ray_visibility();
    for (size_t kind = 0; kind < visible.size(); ++kind)
        visible[kind] = scene::find_link_set(scene, scene.linking.visible[kind]);
    mattes = scene::find_link_set(scene, scene.linking.mattes);
    catchers = scene::find_link_set(scene, scene.linking.catchers);
    tells_rays_apart = has_ray_visibility || mattes || catchers;
    has_lobe_multipliers =
        is_forced(scene::Effect::LobeMultipliers) ||
        std::any_of(scene.lights.begin(), scene.lights.end(), has_multiplier<scene::Light>) ||
        std::any_of(scene.mesh_lights.begin(), scene.mesh_lights.end(),
                    has_multiplier<scene::MeshLight>);
    caster_materials.clear();
    if (materials.has_absorption() && has_custom_shadows)
        caster_materials = list_caster_materials(scene);
    interior_changes = materials.has_absorption() && (geometry.has_motion() || camera.has_motion());
    camera_interior = Interior();
    if (materials.has_absorption() && !interior_changes)
        camera_interior = interior_at(
            camera
                .generate_ray(Vec2(0.5f * float(options_.width), 0.5f * float(options_.height)),
                              Vec2(0.5f))
                .o,
            0.0f);
}

geometry::Hit World::intersect(const geometry::Ray& ray, scene::RayKind kind) const {
    const scene::LinkSet* const met = visible_to(kind);
    if (!met) return accelerator->intersect(ray);
    scene::count_call(scene::Effect::RayVisibility);
    return accelerator->intersect_some(ray, *met);
}

Interior World::interior_at(const Vec3& p, float time) const {
    // Closed solids are left in whatever direction, open sheets only in some: any three that models
    // seldom have
    const Vec3 directions[] = {normalize(Vec3(0.31f, 0.87f, -0.39f)),
                               normalize(Vec3(-0.72f, -0.23f, -0.65f)),
                               normalize(Vec3(0.43f, -0.57f, 0.70f))};
    std::vector<scene::MaterialId> solids = bodies_left(*this, p, directions[0], time);
    for (int i = 1; i < 3; ++i) {
        const std::vector<scene::MaterialId> others = bodies_left(*this, p, directions[i], time);
        std::erase_if(solids, [&](scene::MaterialId m) {
            return std::find(others.begin(), others.end(), m) == others.end();
        });
    }
    Interior interior;
    for (auto m = solids.rbegin(); m != solids.rend(); ++m) interior.enter(materials, *m);
    return interior;
}

}  // namespace velatura::integrator
