// SPDX-License-Identifier: Apache-2.0
#include "translate/instancing/placement.h"

#include "translate/context/instance_source.h"
#include "translate/context/values.h"
#include "translate/geometry/mesh.h"
#include "translate/instancing/instancer_primvars.h"
#include "translate/instancing/placement_copies.h"
#include "translate/instancing/placement_motion.h"
#include "translate/lights/lights.h"
#include "translate/lights/mesh_lights.h"
#include "translate/linking/linking.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <unordered_map>
#include <unordered_set>

namespace velatura::translate::instancing {

namespace {

/// Index of the placeable's shapes among Scene::prototypes; moves them there on first use.
uint32_t prototype_index(Context& ctx, InstanceSource& instance_source) {
    if (instance_source.prototype == scene::none) {
        instance_source.prototype = uint32_t(ctx.scene.prototypes.size());
        lights::join_mesh_light_groups(ctx, instance_source.shapes);
        ctx.scene.prototypes.push_back({instance_source.name, std::move(instance_source.shapes)});
    }
    return instance_source.prototype;
}

void warn_at(Context& ctx, scene::ProvenanceId id, const char* code, const std::string& message) {
    const scene::Provenance& p = ctx.scene.provenance[id];
    ctx.diagnostics.warn(code, p.loc, p.prim_path, message);
}

/// What a copy of the shapes comes to beside lights and volumes: one for each, and one for every so
/// many corners.
size_t copies_of(const std::vector<scene::Shape>& shapes) {
    constexpr size_t corners_of_one = 24;
    size_t count = shapes.size();
    for (const scene::Shape& shape : shapes)
        if (const auto* mesh = std::get_if<scene::Mesh>(&shape.geometry))
            count += mesh->face_vertex_indices.size() / corners_of_one;
    return count;
}

/// Puts shapes of a placement whose matrix cannot be inverted straight into the scene.
void bake(Context& ctx,
          uint32_t prototype,
          const Mat4d& matrix,
          const ValueRange& values,
          uint32_t link_place) {
    for (const scene::Shape& shape : ctx.scene.prototypes[prototype].shapes) {
        if (std::holds_alternative<scene::Curves>(shape.geometry) ||
            std::holds_alternative<scene::Points>(shape.geometry)) {
            warn_at(
                ctx, shape.provenance, "bad-transform",
                "transform of an instance flattens widths; the prim is skipped in this instance");
            continue;
        }
        ctx.scene.shapes.push_back(geometry::baked(shape, matrix));
        ctx.state<linking::LinkPathMappings>().of_baked.push_back(link_place);
        scene::MeshLightId& light = ctx.scene.shapes.back().light;
        if (light != scene::none) {
            // Its shaping turns with it
            scene::MeshLight placed = ctx.scene.mesh_lights[light];
            placed.parent_from_light = placed.parent_from_light * matrix;
            for (Mat4d& key : placed.later_parent_from_light) key = key * matrix;
            light = scene::MeshLightId(ctx.scene.mesh_lights.size());
            ctx.scene.mesh_lights.push_back(std::move(placed));
            auto& prims = ctx.state<lights::CollectedLights>().mesh_lights;
            prims.push_back(prims[shape.light]);
        }
        std::visit([&](auto& geometry) { inherit_primvars(ctx.scene, values, geometry.primvars); },
                   ctx.scene.shapes.back().geometry);
    }
}

/// Columns of a map by which a place is carried over, applied behind another map.
void move_rows(const Mat4d& first, std::vector<float>& column) {
    const std::vector<float> was = column;
    for (int i = 0; i < 4; ++i) {
        double sum = 0;
        for (int k = 0; k < 4; ++k) sum += first[i][k] * double(was[size_t(k)]);
        column[size_t(i)] = float(sum);
    }
}

/// Whether the primvar is one of scene::object_space_primvars.
bool is_object_space(const scene::Scene& scene, const scene::Primvar& primvar) {
    return std::any_of(
        scene::object_space_primvars.begin(), scene::object_space_primvars.end(),
        [&](std::string_view name) { return primvar.name == scene::find_primvar(scene, name); });
}

/// Where an instance puts what it holds; keys as Placement::later.
struct OuterMotion {
    Mat4d matrix = {};
    std::vector<Mat4d> later = {};
};

/// Puts a volume into the scene where `outer` carries it.
void place_volume(Context& ctx,
                  scene::Volume volume,
                  const OuterMotion& outer,
                  uint32_t link_place) {
    const Mat4d& matrix = outer.matrix;
    volume.later_render_from_volume = composed_motion(
        {volume.render_from_volume, volume.later_render_from_volume, reach_of(volume)}, matrix,
        outer.later);
    volume.render_from_volume = volume.render_from_volume * matrix;
    if (determinant3(volume.render_from_volume) == 0.0) {
        warn_at(ctx, volume.provenance, "bad-transform",
                "transform of an instance flattens the volume; it is skipped in this instance");
        return;
    }
    // Rows of the map to the prim's own space, for the surface that it may be
    if (matrix != Mat4d()) {
        const Mat4d inverse = matrix.inverse();
        for (scene::Primvar& primvar : volume.surface_primvars)
            if (is_object_space(ctx.scene, primvar)) move_rows(inverse, primvar.values);
    }
    ctx.scene.volumes.push_back(std::move(volume));
    ctx.state<linking::LinkPathMappings>().of_volume.push_back(link_place);
}

/// State of this module: what was placed so far.
struct PlacementCount {
    size_t copies = 0;  ///< of what instances do not share
    bool has_stopped = false;
};

/// Nothing more is placed.
void stop_placing(Context& ctx, scene::ProvenanceId provenance, std::string why) {
    const scene::Provenance& p = ctx.scene.provenance[provenance];
    ctx.diagnostics.error("too-many-instances", p.loc, p.prim_path, std::move(why));
    ctx.state<PlacementCount>().has_stopped = true;
}

/// False: there are too many.
bool count_copies(Context& ctx, scene::ProvenanceId provenance, size_t count) {
    size_t& copies = ctx.state<PlacementCount>().copies;
    const size_t limit = ctx.state<PlacementLimits>().max_copies;
    copies += count;
    if (copies <= limit) return true;
    stop_placing(ctx, provenance,
                 fmt::format("more than {} instanced lights, volumes and flat shapes (24 corners "
                             "of a mesh are one); the rest is skipped",
                             limit));
    return false;
}

/// How many instances come of placing something once. A few lines of nested instances may ask for
/// more than any machine holds: what they come to is multiplied out before anything is placed.
class InstanceCounter {
  public:
    /// Itself and all that is nested in it; 0 where nothing is to be seen in the end.
    uint64_t of(const InstanceSource& what) {
        const auto known = counts_.find(&what);
        if (known != counts_.end()) return known->second;
        const bool has_own = !what.shapes.empty() || what.prototype != scene::none ||
                             !what.lights.empty() || !what.volumes.empty();
        uint64_t count = 0;
        for (const Placement& nested : what.placements) count = sum(count, of(*nested.what));
        if (has_own || count > 0) count = sum(count, 1);
        counts_.emplace(&what, count);
        return count;
    }

    static uint64_t sum(uint64_t a, uint64_t b) { return a + std::min(b, UINT64_MAX - a); }

  private:
    std::unordered_map<const InstanceSource*, uint64_t> counts_;
};

/// What is shown of a scene that asks for more than it may: enough to see what it is. It is broken
/// or hostile, or waits for the user to raise the limit, and is not to fill the memory up to there.
constexpr uint64_t max_of_too_many = 1'000'000;

/// The prims that ask for most, and are left out so that the others come to no more than the limit,
/// or max_of_too_many; of those that ask for the same all or none.
std::unordered_set<scene::ProvenanceId> refused_prims(Context& ctx,
                                                      const std::vector<Placement>& placements,
                                                      InstanceCounter& counter) {
    std::map<scene::ProvenanceId, uint64_t> asked;
    for (const Placement& placement : placements) {
        uint64_t& count = asked[placement.provenance];
        count = InstanceCounter::sum(count, counter.of(*placement.what));
    }
    std::map<uint64_t, uint64_t> sums;  // by what a prim asks for, that of all such prims
    for (const auto& [prim, count] : asked) sums[count] = InstanceCounter::sum(sums[count], count);
    uint64_t total = 0;
    for (const auto& [count, sum] : sums) total = InstanceCounter::sum(total, sum);
    std::unordered_set<scene::ProvenanceId> refused;
    const size_t limit = ctx.state<PlacementLimits>().max_instances;
    if (total <= limit) return refused;
    uint64_t rest = 0, max = 0;
    for (const auto& [count, sum] : sums) {
        rest = InstanceCounter::sum(rest, sum);
        if (rest <= std::min(uint64_t(limit), max_of_too_many)) max = count;
    }
    for (const auto& [prim, count] : asked) {
        if (count <= max) continue;
        refused.insert(prim);
        const scene::Provenance& p = ctx.scene.provenance[prim];
        ctx.diagnostics.error(
            "too-many-instances", p.loc, p.prim_path,
            fmt::format("{} instances here, nested ones counted, and {} in the scene exceed the "
                        "limit of {} (--instance-limit); the prim is skipped",
                        count, total, limit));
    }
    return refused;
}

/// `matrix` and the `later` keys: of the placement, into render space. outer: what it stands in,
/// index into LinkPathMappings.
void place(Context& ctx,
           InstanceCounter& counter,
           const Placement& placement,
           const Mat4d& matrix,
           const std::vector<Mat4d>& later,
           uint32_t outer) {
    if (ctx.state<PlacementCount>().has_stopped) return;
    InstanceSource& what = *placement.what;
    const scene::ProvenanceId provenance = placement.provenance;
    const Mat4 cast_matrix = to_float(matrix);
    if (!is_finite(matrix) || !is_finite(Mat4d(cast_matrix)) || !keeps_a_surface(matrix)) {
        warn_at(ctx, provenance, "bad-transform",
                "instances whose transform is infinite or flattens everything to a line or a point "
                "are skipped");
        return;
    }
    if (!count_copies(ctx, provenance, what.lights.size() + what.volumes.size())) return;
    const uint32_t link_place = linking::place_inside(ctx, outer, placement);
    if (!what.shapes.empty() || what.prototype != scene::none) {
        const uint32_t prototype = prototype_index(ctx, what);
        if (determinant3(Mat4d(cast_matrix)) == 0.0) {
            const size_t copies = copies_of(ctx.scene.prototypes[prototype].shapes);
            if (!count_copies(ctx, provenance, copies)) return;
            bake(ctx, prototype, matrix, {placement.first_value, placement.value_count},
                 link_place);
            if (!later.empty())
                warn_at(ctx, provenance, "unsupported-motion-blur",
                        "the transform of a moving instance is singular at shutter open; the "
                        "instance is rendered without motion blur, as at shutter open");
        } else {
            scene::Instance instance;
            instance.prototype = prototype;
            instance.render_from_prototype = cast_matrix;
            instance.first_value = placement.first_value;
            instance.value_count = placement.value_count;
            instance.provenance = provenance;
            for (const Mat4d& key : later)
                instance.later_render_from_prototype.push_back(to_float(key));
            const auto is_key = [](const Mat4& key) { return is_finite(Mat4d(key)); };
            if (!std::ranges::all_of(instance.later_render_from_prototype, is_key)) {
                instance.later_render_from_prototype.clear();
                warn_at(ctx, provenance, "unsupported-motion-blur",
                        "a moving instance leaves the range of floats while the shutter is open; "
                        "it is rendered without motion blur, as at shutter open");
            }
            ctx.scene.instances.push_back(instance);
            linking::LinkPathMappings& places = ctx.state<linking::LinkPathMappings>();
            if (places.is_kept) places.of_instance.push_back(link_place);
        }
    }
    for (const LightSite& site : what.lights)
        lights::read_light(ctx, site, site.matrix * matrix,
                           composed_motion({site.matrix, site.later, site.reach}, matrix, later),
                           link_place);
    for (scene::Volume volume : what.volumes) {
        inherit_primvars(ctx.scene, {placement.first_value, placement.value_count},
                         volume.surface_primvars);
        place_volume(ctx, std::move(volume), {matrix, later}, link_place);
    }
    for (const Placement& nested : what.placements) {
        if (counter.of(*nested.what) == 0) continue;
        Placement inner = nested;
        const ValueRange values =
            handed_on(ctx.scene, nested, {placement.first_value, placement.value_count});
        inner.first_value = values.first;
        inner.value_count = values.count;
        const double reach = later.empty() && nested.later.empty() ? 0.0 : reach_of(*nested.what);
        place(ctx, counter, inner, nested.matrix * matrix,
              composed_motion({nested.matrix, nested.later, reach}, matrix, later), link_place);
    }
}

}  // namespace

void place_all(Context& ctx, InstanceSource& stage_content) {
    omit_copies(ctx, stage_content);
    ctx.scene.shapes = std::move(stage_content.shapes);
    ctx.state<linking::LinkPathMappings>().first_baked_shape = ctx.scene.shapes.size();
    lights::join_mesh_light_groups(ctx, ctx.scene.shapes);
    for (const LightSite& site : stage_content.lights)
        lights::read_light(ctx, site, site.matrix, site.later, 0);
    for (const scene::Volume& volume : stage_content.volumes) place_volume(ctx, volume, {}, 0);
    InstanceCounter counter;
    const auto refused = refused_prims(ctx, stage_content.placements, counter);
    for (const Placement& placement : stage_content.placements) {
        if (counter.of(*placement.what) == 0 || refused.contains(placement.provenance)) continue;
        place(ctx, counter, placement, placement.matrix, placement.later, 0);
    }
}

}  // namespace velatura::translate::instancing
