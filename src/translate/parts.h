// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "scene/scene.h"
#include "translate/context.h"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace velatura::translate {

/// Reads the RenderSettings prim (options.settings, else the stage's renderSettingsPrimPath) with
/// its products and vars into ctx.scene.settings, and what follows from it: purposes, material
/// purpose, wanted primvars. Errors: "unknown-settings", "bad-resolution".
Result<void> read_render_settings(Context& ctx);

/// Camera of a UsdGeomCamera prim for the picture that ctx.scene.settings asks for; "bad-camera"
/// when its transform or lens cannot form a picture.
Result<scene::Camera> read_camera(Context& ctx, Prim prim);

/// Camera that sees the whole box (world space) from above and beside, field of view as a
/// UsdGeomCamera without opinions.
scene::Camera framing_camera(Context& ctx, const Box3d& world_bounds);

struct Pose;

// Materials

/// Material bound to a gprim or GeomSubset, translated on first use; id none when nothing usable is
/// bound.
const MaterialEntry& bound_material(Context& ctx, Prim prim);
/// Whether a binding reaches the prim at all, usable or not.
bool has_binding(Context& ctx, Prim prim);

// Geometry

/// Shape of a Mesh prim under `matrix` (into the space of the holder), deformed by `pose`, whose
/// matrix leads there too, with its motion while the shutter is open; nullopt when nothing of it is
/// left.
std::optional<scene::Shape> read_mesh(Context& ctx,
                                      Prim prim,
                                      const Placeable& holder,
                                      const Mat4d& matrix,
                                      const Pose* pose = nullptr);
/// Shape of a Sphere, Cube, Cylinder, Cone, Capsule or Plane prim; nullopt when its sizes make no
/// surface.
std::optional<scene::Shape> read_gprim(Context& ctx, Prim prim, const Mat4d& matrix);
bool is_gprim_type(std::string_view type);

/// Primvars that `materials` or the rest of the picture want, checked against the element counts (0
/// = interpolation not possible), order by name.
struct ElementCounts {
    size_t faces = 0, points = 0, corners = 0;
    std::optional<size_t> varying = std::nullopt;  ///< of curves; else as many as points
};

std::vector<scene::Primvar> read_primvars(Context& ctx,
                                          Prim prim,
                                          const ElementCounts& counts,
                                          const std::vector<const MaterialEntry*>& materials);

/// Adds scene::object_space_primvars where a material asks for them; matrix: of the prim, into
/// shape space.
void add_object_space(Context& ctx,
                      const std::vector<const MaterialEntry*>& materials,
                      const Mat4d& matrix,
                      std::vector<scene::Primvar>& primvars);

/// Number of elements of a primvar of this interpolation.
size_t element_count(const ElementCounts& counts, scene::Interpolation interpolation);

/// A shape of a prototype, moved into another space.
scene::Shape baked(const scene::Shape& shape, const Mat4d& matrix);

// Instancing

/// Placements of a PointInstancer in the space of its holder.
void read_point_instancer(Context& ctx, Prim prim, const Mat4d& matrix, Placeable& out);
/// Prototype of a native instance, walked on first use; nullptr inside itself.
Placeable* native_prototype(Context& ctx, Prim instance);
/// Prototype of a point instancer: the prim with its own transform and everything below.
Placeable* point_prototype(Context& ctx, Prim root, const Prim& instancer);
/// Turns what the walk of the stage collected into Scene::shapes, prototypes, instances, lights.
void place_all(Context& ctx, Placeable& stage_content);

/// Walks the subtree of `prim` whose parent has the given matrix (absolute, before the origin is
/// subtracted).
void walk(Context& ctx, Prim prim, const Mat4d& parent_matrix, Placeable& out);
/// Walks what stands below `prim`, which has the given matrix, by names.
void walk_children(Context& ctx, Prim prim, const Mat4d& matrix, Placeable& out);

/// Matrix with the holder's origin taken off its translation.
Mat4d relative_to(const Mat4d& matrix, const Vec3d& origin);
/// The matrix of what stands around `from`, to around `to`: its translation is
/// from · matrix − to, summed with twice the working precision, since large parts of it cancel.
Mat4d between_origins(const Mat4d& matrix, const Vec3d& from, const Vec3d& to);
/// Chooses the origin of a prototype in which nothing stands yet; no change for others.
void propose_origin(Placeable& out, const Vec3d& position);

// Lights

bool is_light_type(std::string_view type);
/// Whether the prim is a light, be it of a kind that is not rendered.
bool is_any_light(Prim prim);
/// Light of the prim, appended to Scene::lights and groups. place: where it stands, index into
/// ctx.link_places. False when it emits nothing.
bool read_light(Context& ctx,
                const LightSite& site,
                const Mat4d& render_from_light,
                uint32_t place);
/// Dome of radiance 1 in the group `default`.
void add_default_dome(Context& ctx);
/// Appends `emissive`, names `is_environment` and checks that names are unique.
void finish_light_groups(Context& ctx);
/// Row of the light, created on first use, which then lists its prim.
scene::GroupId join_light_group(Context& ctx, Prim light);

/// Whether LightAPI or MeshLightAPI makes a light of the prim's geometry.
bool is_geometry_light(Prim prim);
/// Makes the shape of a prim a light, if it can be one. The group is left to be joined once the
/// shape is placed.
void make_mesh_light(Context& ctx, Prim prim, const Mat4d& holder_from_light, scene::Shape& shape);
/// Gives the lights among shapes that enter the scene their rows.
void join_mesh_light_groups(Context& ctx, const std::vector<scene::Shape>& shapes);

/// Warns about a prim type that is seen and not rendered.
void warn_unsupported(Context& ctx, Prim prim);
/// Names a prim without geometry of its own that LightAPI or one of its kin is applied to.
void warn_light_without_geometry(Context& ctx, Prim prim);
/// Names features of rendered prims that are not honoured.
void warn_unsupported_features(Context& ctx, Prim prim);

}  // namespace velatura::translate
