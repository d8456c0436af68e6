// SPDX-License-Identifier: Apache-2.0
#include "translate/moments.h"

#include "translate/context/values.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>
#include <variant>

namespace velatura::translate {

namespace {

using scene::Moment;
using scene::MomentKind;
using scene::Shape;

/// The shutter that the camera authors, in times of the stage, whether it is used or not.
struct CameraShutter {
    double open = 0, close = 0;
    bool is_used = false;
};

CameraShutter shutter_of(const usd::stage::Stage& stage,
                         const TranslateOptions& options,
                         const scene::Scene& scene) {
    CameraShutter shutter;
    const double now = options.time.value();
    shutter.open = shutter.close = now;
    const usd::stage::Prim camera =
        scene.camera.name.empty() ? usd::stage::Prim() : stage.prim_at(scene.camera.name);
    if (!camera) return shutter;
    const double open = read_number(camera.attribute("shutter:open"), 0.0, options.time);
    const double close = read_number(camera.attribute("shutter:close"), 0.0, options.time);
    if (!(close > open) || !std::isfinite(close - open)) return shutter;
    return {now + open, now + close, !scene.settings.disable_motion_blur};
}

/// Shapes of one prim, or instances of one prim, in their order.
using ByPath = std::unordered_map<std::string, std::vector<uint32_t>>;

const std::string& path_of(const scene::Scene& scene, scene::ProvenanceId id) {
    static const std::string none;
    return id < scene.provenance.size() ? scene.provenance[id].prim_path : none;
}

template <class T>
ByPath by_path(const scene::Scene& scene, const std::vector<T>& list) {
    ByPath map;
    for (size_t i = 0; i < list.size(); ++i)
        map[path_of(scene, list[i].provenance)].push_back(uint32_t(i));
    return map;
}

/// Gives the elements of one list their partners of another, prim by prim in turn.
class Partners {
  public:
    explicit Partners(ByPath map) : map_(std::move(map)) {}

    std::optional<uint32_t> next(const std::string& path) {
        const auto at = map_.find(path);
        if (at == map_.end()) return std::nullopt;
        const size_t i = used_[path]++;
        return i < at->second.size() ? std::optional(at->second[i]) : std::nullopt;
    }

  private:
    ByPath map_;
    std::unordered_map<std::string, size_t> used_;
};

/// The points that offsets are of, in shape space; empty for other shapes.
std::vector<Vec3d> points_of(const Shape& shape) {
    std::vector<Vec3d> points;
    const auto take = [&points](const std::vector<Vec3>& from, const Mat4d* matrix) {
        points.reserve(from.size());
        for (const Vec3& p : from)
            points.push_back(matrix ? transform_point(Vec3d(p), *matrix) : Vec3d(p));
    };
    if (const auto* mesh = std::get_if<scene::Mesh>(&shape.geometry)) take(mesh->points, nullptr);
    if (const auto* curves = std::get_if<scene::Curves>(&shape.geometry))
        take(curves->points, &curves->shape_from_curves);
    if (const auto* cloud = std::get_if<scene::Points>(&shape.geometry))
        take(cloud->points, &cloud->shape_from_points);
    return points;
}

/// Whether element i of one is element i of the other.
bool corresponds(const Shape& a, const Shape& b) {
    if (a.geometry.index() != b.geometry.index()) return false;
    if (const auto* mesh = std::get_if<scene::Mesh>(&a.geometry)) {
        const auto& other = std::get<scene::Mesh>(b.geometry);
        return mesh->points.size() == other.points.size() &&
               mesh->face_vertex_indices == other.face_vertex_indices;
    }
    if (const auto* curves = std::get_if<scene::Curves>(&a.geometry)) {
        const auto& other = std::get<scene::Curves>(b.geometry);
        return curves->points.size() == other.points.size() &&
               curves->vertex_counts == other.vertex_counts;
    }
    if (const auto* cloud = std::get_if<scene::Points>(&a.geometry))
        return cloud->points.size() == std::get<scene::Points>(b.geometry).points.size();
    if (const auto* gprim = std::get_if<scene::Gprim>(&a.geometry))
        return gprim->kind == std::get<scene::Gprim>(b.geometry).kind;
    return true;
}

/// From what the shape is made in to shape space; nothing for shapes of points.
std::optional<Mat4d> matrix_of(const Shape& shape) {
    if (const auto* gprim = std::get_if<scene::Gprim>(&shape.geometry))
        return gprim->shape_from_gprim;
    if (const auto* surface = std::get_if<scene::LevelSet>(&shape.geometry))
        return surface->shape_from_lattice;
    return std::nullopt;
}

/// Finds what is elsewhere in another scene, and writes it into one moment of the first.
class Matcher {
  public:
    Matcher(scene::Scene& scene, const scene::Scene& then, MomentKind kind)
        : scene_(scene),
          then_(then),
          shapes_(by_path(then, then.shapes)),
          instances_(by_path(then, then.instances)) {
        moment_.kind = kind;
        moment_.camera = then.camera;
        const Vec3d offset = then.camera.world_position - scene.camera.world_position;
        for (int i = 0; i < 3; ++i) moment_.camera.render_from_camera[3][i] += offset[i];
        moment_.camera.world_position = scene.camera.world_position;
        moment_.camera.motion_keys.clear();
    }

    Moment run() {
        for (size_t i = 0; i < scene_.shapes.size(); ++i) {
            Shape& shape = scene_.shapes[i];
            const auto other = shapes_.next(path_of(scene_, shape.provenance));
            match(shape, other ? &then_.shapes[*other] : nullptr, {scene::none, uint32_t(i)},
                  Mat4d());
        }
        std::vector<bool> is_known(scene_.prototypes.size(), false);
        for (size_t i = 0; i < scene_.instances.size(); ++i) match_instance(uint32_t(i), is_known);
        return std::move(moment_);
    }

    /// Prims without a partner.
    const std::vector<std::string>& lost() const { return lost_; }

  private:
    using Key = std::pair<uint32_t, scene::ShapeId>;

    void match_instance(uint32_t i, std::vector<bool>& is_known) {
        const scene::Instance& instance = scene_.instances[i];
        std::vector<Shape>& shapes = scene_.prototypes[instance.prototype].shapes;
        const bool is_first = !is_known[instance.prototype];
        is_known[instance.prototype] = true;
        if (const auto other = instances_.next(path_of(scene_, instance.provenance))) {
            const scene::Instance& there = then_.instances[*other];
            const std::vector<Shape>& others = then_.prototypes[there.prototype].shapes;
            if (there.render_from_prototype != instance.render_from_prototype)
                moment_.instances.emplace(i, Mat4d(there.render_from_prototype));
            for (size_t s = 0; is_first && s < shapes.size(); ++s)
                match(shapes[s], s < others.size() ? &others[s] : nullptr,
                      {instance.prototype, uint32_t(s)}, Mat4d());
            return;
        }
        // A shape that moves while the shutter is open is an instance; without it, it is none
        const auto other =
            shapes.size() == 1 ? shapes_.next(path_of(scene_, shapes[0].provenance)) : std::nullopt;
        if (!other || !is_first) {
            lost_.push_back(path_of(scene_, instance.provenance));
            return;
        }
        const Mat4d matrix(instance.render_from_prototype);
        match(shapes[0], &then_.shapes[*other], {instance.prototype, 0}, matrix.inverse());
    }

    /// there_to_here: from the other shape's space to that of the shape.
    void match(Shape& shape, const Shape* there, Key key, const Mat4d& there_to_here) {
        if (!there || !corresponds(shape, *there)) {
            lost_.push_back(path_of(scene_, shape.provenance));
            return;
        }
        if (const std::optional<Mat4d> here = matrix_of(shape)) {
            const Mat4d then = *matrix_of(*there) * there_to_here;
            if (then != *here && determinant3(*here) != 0.0)
                moment_.shapes.emplace(key, here->inverse() * then);
            return;
        }
        add_offsets(shape, points_of(*there), there_to_here);
    }

    void add_offsets(Shape& shape, const std::vector<Vec3d>& there, const Mat4d& there_to_here) {
        const std::vector<Vec3d> here = points_of(shape);
        const bool has_other_space = there_to_here != Mat4d();
        scene::Primvar offsets;
        offsets.interpolation = scene::Interpolation::Vertex;
        offsets.width = 3;
        offsets.values.reserve(3 * here.size());
        bool is_still = true;
        for (size_t i = 0; i < here.size(); ++i) {
            const Vec3d then =
                has_other_space ? transform_point(there[i], there_to_here) : there[i];
            Vec3d offset = then - here[i];
            // Points of faces that are skipped may be nowhere
            if (!is_finite(offset)) offset = Vec3d(0.0);
            is_still = is_still && offset == Vec3d(0.0);
            for (int c = 0; c < 3; ++c) offsets.values.push_back(float(offset[c]));
        }
        if (is_still) return;
        if (moment_.offsets == scene::none)
            moment_.offsets =
                scene::intern_primvar(scene_, scene::moment_primvars[size_t(moment_.kind)]);
        offsets.name = moment_.offsets;
        std::visit([&](auto& geometry) { geometry.primvars.push_back(std::move(offsets)); },
                   shape.geometry);
    }

    scene::Scene& scene_;
    const scene::Scene& then_;
    Partners shapes_, instances_;
    Moment moment_;
    std::vector<std::string> lost_;
};

void report_lost(std::vector<std::string> lost, scene::Scene& scene, Diagnostics& diagnostics) {
    std::sort(lost.begin(), lost.end());
    lost.erase(std::unique(lost.begin(), lost.end()), lost.end());
    if (lost.empty()) return;
    const auto where =
        std::find_if(scene.provenance.begin(), scene.provenance.end(),
                     [&](const scene::Provenance& p) { return p.prim_path == lost.front(); });
    diagnostics.warn(
        "motion-vectors", where != scene.provenance.end() ? where->loc : SourceLoc{}, lost.front(),
        fmt::format("{} prims, this one the first, have another topology, or are missing, at "
                    "the other end of their motion vectors; they get those of the camera alone",
                    lost.size()));
}

}  // namespace

void add_moments(const usd::stage::Stage& stage,
                 const TranslateOptions& options,
                 const std::vector<MomentKind>& kinds,
                 scene::Scene& scene,
                 Diagnostics& diagnostics) {
    if (kinds.empty()) return;
    if (options.time.is_default()) {
        diagnostics.warn("motion-vectors", {}, scene.settings.name,
                         "nothing moves at the default time; motion vectors are 0");
        return;
    }
    const double now = options.time.value();
    const CameraShutter shutter = shutter_of(stage, options, scene);
    const double scene_time = shutter.is_used ? shutter.open : now;
    const auto has = [&](MomentKind kind) {
        return std::find(kinds.begin(), kinds.end(), kind) != kinds.end();
    };
    if (has(MomentKind::ShutterClose) && shutter.close == shutter.open)
        diagnostics.warn("motion-vectors", {}, scene.camera.name,
                         "the shutter of the camera is closed; motion vectors by shutter are 0");
    std::vector<std::string> lost;
    for (const MomentKind kind : kinds) {
        const double time = kind == MomentKind::NextFrame       ? now + 1.0
                            : kind == MomentKind::PreviousFrame ? now - 1.0
                            : kind == MomentKind::ShutterOpen   ? shutter.open
                            : kind == MomentKind::ShutterClose  ? shutter.close
                                                                : now;
        if (time == scene_time && (!shutter.is_used || scene_time == now)) continue;
        const scene::Scene then = translate_instant(stage, options, time, scene);
        Matcher matcher(scene, then, kind);
        Moment moment = matcher.run();
        lost.insert(lost.end(), matcher.lost().begin(), matcher.lost().end());
        scene.moments.push_back(std::move(moment));
    }
    report_lost(std::move(lost), scene, diagnostics);
}

}  // namespace velatura::translate
