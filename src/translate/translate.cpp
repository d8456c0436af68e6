// SPDX-License-Identifier: Apache-2.0
#include "translate/translate.h"

#include "base/box.h"
#include "translate/camera.h"
#include "translate/color/color_space.h"
#include "translate/context/instance_source.h"
#include "translate/context/values.h"
#include "translate/geometry/primvars.h"
#include "translate/geometry/thin_walls.h"
#include "translate/instancing/placement.h"
#include "translate/lights/light_groups.h"
#include "translate/lights/lights.h"
#include "translate/linking/linking.h"
#include "translate/linking/shadow_casters.h"
#include "translate/materials/materials.h"
#include "translate/settings.h"
#include "translate/walk.h"
#include "usd/stage/xform.h"

#include <fmt/format.h>

#include <algorithm>
#include <unordered_map>
#include <unordered_set>
#include <utility>

namespace velatura::translate {

namespace {

Context make_context(const usd::stage::Stage& stage,
                     const TranslateOptions& options,
                     Diagnostics& diagnostics) {
    Context ctx(stage, options.time, diagnostics);
    ctx.state<lights::GroupingPolicy>().grouping = options.light_grouping;
    ctx.state<instancing::PlacementLimits>() = {options.max_instances, options.max_copies};
    ctx.state<linking::CasterChoice>() = {options.finds_casters, options.casters};
    // Casters go by where things stand, as links do
    ctx.state<linking::LinkPathMappings>().is_kept = options.finds_casters;
    geometry::RequestedPrimvars& primvars = ctx.state<geometry::RequestedPrimvars>();
    primvars.names.insert(options.primvars.begin(), options.primvars.end());
    primvars.lists_all = !options.primvars.empty();
    ctx.scene.meters_per_unit = stage.meters_per_unit();
    ctx.scene.frames_per_second = stage.frames_per_second();
    return ctx;
}

/// Fills the scene around ctx.origin.
void translate_content(Context& ctx) {
    InstanceSource content;
    content.is_stage = true;
    content.origin = ctx.origin;
    walk_children(ctx, ctx.stage.pseudo_root(), Mat4d(), content);
    instancing::place_all(ctx, content);
}

Box3d bounds_of(const scene::Shape& shape) {
    Box3d box;
    if (const auto* mesh = std::get_if<scene::Mesh>(&shape.geometry)) {
        for (const uint32_t i : mesh->face_vertex_indices) box.extendBy(Vec3d(mesh->points[i]));
        return box;
    }
    const auto add_balls = [&](const auto& set, const Mat4d& matrix) {
        double widest = 0;
        for (const float width : set.widths) widest = std::max(widest, double(width));
        for (const Vec3& p : set.points) box.extendBy(Vec3d(p));
        box = {box.min - Vec3d(widest / 2), box.max + Vec3d(widest / 2)};
        box = transformed(box, matrix);
    };
    if (const auto* curves = std::get_if<scene::Curves>(&shape.geometry)) {
        add_balls(*curves, curves->shape_from_curves);
        return box;
    }
    if (const auto* cloud = std::get_if<scene::Points>(&shape.geometry)) {
        add_balls(*cloud, cloud->shape_from_points);
        return box;
    }
    const auto& gprim = std::get<scene::Gprim>(shape.geometry);
    using Kind = scene::Gprim::Kind;
    Vec3d half(gprim.radius, gprim.radius, gprim.height / 2);
    if (gprim.kind == Kind::Sphere) half.z = gprim.radius;
    if (gprim.kind == Kind::Capsule) half.z += gprim.radius;
    if (gprim.kind == Kind::Cube) half = Vec3d(gprim.size / 2);
    if (gprim.kind == Kind::Plane) half = Vec3d(gprim.width / 2, gprim.length / 2, 0);
    for (int i = 0; i < 8; ++i)
        box.extendBy(transform_point(
            Vec3d(i & 1 ? half.x : -half.x, i & 2 ? half.y : -half.y, i & 4 ? half.z : -half.z),
            gprim.shape_from_gprim));
    return box;
}

Box3d bounds_of(const scene::Scene& scene) {
    Box3d box;
    for (const scene::Shape& shape : scene.shapes) box.extendBy(bounds_of(shape));
    std::vector<Box3d> prototypes;
    for (const scene::Prototype& prototype : scene.prototypes) {
        prototypes.emplace_back();
        for (const scene::Shape& shape : prototype.shapes)
            prototypes.back().extendBy(bounds_of(shape));
    }
    for (const scene::Instance& instance : scene.instances)
        box.extendBy(
            transformed(prototypes[instance.prototype], Mat4d(instance.render_from_prototype)));
    for (const scene::Volume& volume : scene.volumes)
        box.extendBy(transformed(volume.extent, volume.render_from_volume));
    return box;
}

/// Box of everything in world space, found by translating the stage once around its first geometry.
Box3d world_bounds(const usd::stage::Stage& stage, const TranslateOptions& options) {
    Diagnostics ignored;
    Context ctx = make_context(stage, options, ignored);
    if (!read_render_settings(ctx, options)) return {};
    bool is_found = false;
    std::unordered_set<std::string> prototypes;
    usd::stage::traverse(stage.pseudo_root(), [&](Prim prim) {
        if (!is_found && (prim.is_a("Gprim") || prim.is_a("PointInstancer"))) {
            const Mat4d world = usd::stage::world_transform(prim, ctx.time);
            if (is_finite(world)) ctx.origin = {world[3][0], world[3][1], world[3][2]};
            is_found = true;
        }
        if (is_found) return false;
        // Where one instance of a prototype has none, no other has
        return !prim.is_instance() || prototypes.insert(prim.prototype().path_string()).second;
    });
    translate_content(ctx);
    const Box3d box = bounds_of(ctx.scene);
    return box.isEmpty() ? box : Box3d(box.min + ctx.origin, box.max + ctx.origin);
}

/// Whether the stage holds a light of any kind, visible, valid, supported or not.
bool holds_light(const Context& ctx) {
    if (ctx.state<lights::CollectedLights>().has_prim) return true;
    bool is_found = false;
    std::unordered_set<std::string> prototypes;
    usd::stage::traverse(ctx.stage.pseudo_root(), [&](Prim prim) {
        if (is_found) return false;
        is_found = lights::is_any_light(prim);
        // Instances of one prototype hold the same
        return !prim.is_instance() || prototypes.insert(prim.prototype().path_string()).second;
    });
    return is_found;
}

bool is_camera(Prim prim) {
    return prim && prim.is_a("Camera");
}

/// Looks for cameras, into prototypes without one only once: nested instances may be many.
struct CameraSearch {
    std::vector<std::string> found;
    std::unordered_map<std::string, bool> has_camera;  ///< prototypes

    void visit(Prim prim) {
        if (is_camera(prim)) found.push_back(prim.path_string());
        if (!prim.is_instance()) {
            for (const Prim child : prim.children()) visit(child);
            return;
        }
        const std::string prototype = prim.prototype().path_string();
        const auto known = has_camera.find(prototype);
        if (known != has_camera.end() && !known->second) return;
        const size_t before = found.size();
        for (const Prim child : prim.children()) visit(child);
        has_camera[prototype] = found.size() > before;
    }
};

Error unknown_camera(const usd::stage::Stage& stage, const std::string& wanted, Prim found) {
    std::string message =
        found ? fmt::format("<{}> is a {}, not a Camera", wanted, found.type_name().str())
              : fmt::format("camera <{}> not found", wanted);
    const std::vector<std::string> cameras = camera_paths(stage);
    if (cameras.empty()) message += "; the stage has no camera";
    for (size_t i = 0; i < cameras.size(); ++i)
        message += fmt::format("{}<{}>", i == 0 ? "; cameras of the stage: " : ", ", cameras[i]);
    return {"unknown-camera", message};
}

void note_camera(Context& ctx, const std::vector<std::string>& cameras) {
    constexpr size_t named = 4;
    std::string others;
    for (size_t i = 1; i < std::min(cameras.size(), named); ++i)
        others += fmt::format("{}<{}>", i == 1 ? "" : ", ", cameras[i]);
    if (cameras.size() > named) others += fmt::format(" and {} more", cameras.size() - named);
    ctx.diagnostics.note(
        "camera-chosen", {}, "",
        fmt::format("no camera chosen; using the first of {}: <{}>; --camera chooses {}",
                    cameras.size(), cameras[0], others));
}

/// The camera prim to look through; invalid when the stage has none.
Result<Prim> chosen_camera(Context& ctx, const TranslateOptions& options) {
    if (!options.camera.empty()) {
        const Prim prim = ctx.stage.prim_at(options.camera);
        if (is_camera(prim)) return prim;
        return unknown_camera(ctx.stage, options.camera, prim);
    }
    if (!ctx.scene.settings.camera.empty()) {
        const Prim prim = ctx.stage.prim_at(ctx.scene.settings.camera);
        if (is_camera(prim)) return prim;
        const Error error = unknown_camera(ctx.stage, ctx.scene.settings.camera, prim);
        const std::vector<std::string> cameras = camera_paths(ctx.stage);
        ctx.diagnostics.warn(
            error.code, ctx.stage.prim_at(ctx.scene.settings.name).loc(), ctx.scene.settings.name,
            fmt::format("{}; {} is used", error.message,
                        cameras.empty() ? "one that frames the scene" : "<" + cameras[0] + ">"));
    }
    const std::vector<std::string> cameras = camera_paths(ctx.stage);
    if (cameras.empty()) return Prim();
    const Prim prim = ctx.stage.prim_at(cameras[0]);
    if (cameras.size() > 1) note_camera(ctx, cameras);
    return prim;
}

void note_framing(Context& ctx) {
    ctx.diagnostics.note("framing-camera", {}, "",
                         "the stage has no camera; using one that frames the scene");
}

Result<scene::Camera> make_camera(Context& ctx, const TranslateOptions& options) {
    Result<Prim> prim = chosen_camera(ctx, options);
    if (!prim) return prim.error();
    if (*prim) return read_camera(ctx, *prim);
    note_framing(ctx);
    return framing_camera(ctx, world_bounds(ctx.stage, options));
}

}  // namespace

std::vector<std::string> camera_paths(const usd::stage::Stage& stage) {
    CameraSearch search;
    search.visit(stage.pseudo_root());
    return std::move(search.found);
}

void report_choices(const usd::stage::Stage& stage,
                    const TranslateOptions& options,
                    Diagnostics& diagnostics) {
    Context ctx = make_context(stage, options, diagnostics);
    if (!read_render_settings(ctx, options)) return;
    const Result<Prim> camera = chosen_camera(ctx, options);
    if (camera && !*camera) note_framing(ctx);
    if (!holds_light(ctx))
        diagnostics.note(
            "no-lights", {}, "",
            "the stage has no light; unless a material emits, a white dome of radiance 1 is added");
}

Result<scene::Scene> translate_stage(const usd::stage::Stage& stage,
                                     const TranslateOptions& options,
                                     Diagnostics& diagnostics) {
    Context ctx = make_context(stage, options, diagnostics);
    color::note_color_configuration(ctx);
    const Result<void> settings = read_render_settings(ctx, options);
    if (!settings) return settings.error();
    bool& is_kept = ctx.state<linking::LinkPathMappings>().is_kept;
    is_kept = is_kept || linking::asks_for_places(ctx.rendered);
    Result<scene::Camera> camera = make_camera(ctx, options);
    if (!camera) return camera.error();
    ctx.scene.camera = *std::move(camera);
    ctx.scene.settings.camera = ctx.scene.camera.name;
    ctx.origin = ctx.scene.camera.world_position;
    translate_content(ctx);
    geometry::find_thin_walls(ctx);
    linking::link_all(ctx);
    linking::find_casters(ctx);
    if (ctx.scene.lights.empty() && !ctx.state<materials::TranslatedMaterials>().has_emissive &&
        !holds_light(ctx)) {
        lights::add_default_dome(ctx);
        ctx.scene.lights.back().links = scene::plain_links(ctx.scene);
    }
    lights::finish_light_groups(ctx);
    for (const auto& [name, found] : ctx.state<geometry::RequestedPrimvars>().found)
        ctx.scene.found_primvars.push_back(found);
    return std::move(ctx.scene);
}

scene::Scene translate_instant(const usd::stage::Stage& stage,
                               const TranslateOptions& options,
                               double time,
                               const scene::Scene& scene) {
    Diagnostics ignored;
    Context ctx = make_context(stage, options, ignored);
    if (!read_render_settings(ctx, options)) return {};
    ctx.is_quiet = true;
    ctx.scene.settings.disable_motion_blur = true;
    // Velocities go on from the frame
    ctx.time = time;
    const Prim prim = scene.camera.name.empty() ? Prim() : ctx.stage.prim_at(scene.camera.name);
    ctx.scene.camera = scene.camera;
    if (prim) {
        if (Result<scene::Camera> camera = read_camera(ctx, prim)) ctx.scene.camera = *camera;
    }
    ctx.origin = scene.camera.world_position;
    translate_content(ctx);
    return std::move(ctx.scene);
}

}  // namespace velatura::translate
