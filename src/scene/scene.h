// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "base/source_loc.h"
#include "scene/camera.h"
#include "scene/casters.h"
#include "scene/effect.h"
#include "scene/ids.h"
#include "scene/light.h"
#include "scene/linking.h"
#include "scene/material.h"
#include "scene/mesh.h"
#include "scene/moment.h"
#include "scene/pattern.h"
#include "scene/render_settings.h"
#include "scene/texture.h"
#include "scene/volume.h"

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace velatura::scene {

/// Where a thing of the scene came from.
struct Provenance {
    std::string prim_path;
    SourceLoc loc;
    uint32_t asset = none;  ///< of Scene::assets; none: it is part of none
};

/// Shapes that are placed together many times.
struct Prototype {
    std::string name;
    std::vector<Shape> shapes;  ///< in prototype space
};

/// A constant primvar that an instance gives to its prototype: of a point instancer, its element.
/// A primvar that a shape of the prototype has by itself counts before it.
struct InstanceValue {
    PrimvarId name = none;
    uint8_t width = 1;  ///< numbers of `values`: 1, 2, 3 or 4
    /// Inherited from above the prototype that its point instancer stands in: what the instance of
    /// that prototype hands down counts before it.
    bool yields_to_outer = false;
    std::array<float, 4> values = {0, 0, 0, 0};  ///< those past the width are 0

    bool operator==(const InstanceValue&) const = default;
};

/// One placement of a prototype. Nested instancing is resolved to leaves by `translate`.
struct Instance {
    uint32_t prototype = 0;
    Mat4 render_from_prototype;  ///< camera-centered, cast from double
    /// [key − 1] the same at the later keys of an instance that moves, at equal steps over the
    /// shutter; entries go straight on between. Empty = it does not.
    std::vector<Mat4> later_render_from_prototype;
    MaterialId material_override = none;
    uint32_t link_row =
        none;  ///< LinkClasses of its shapes, index into Linking::rows; none = all of class 0
    uint32_t first_value = 0, value_count = 0;  ///< of Scene::instance_values
    ProvenanceId provenance = none;
};

/// A primvar of the stage, for those who ask for one by name.
struct FoundPrimvar {
    std::string name;
    std::string type;  ///< of its values, as USD names it
    int width = 0;     ///< maximum number of floats; 0: none was read
};

/// Everything one frame needs. Shapes of `shapes` are in render space; those of prototypes in
/// prototype space.
struct Scene {
    std::vector<Shape> shapes;
    std::vector<Prototype> prototypes;
    std::vector<Instance> instances;
    std::vector<Material> materials;
    std::vector<Texture> textures;
    std::vector<Pattern> patterns;  ///< node graphs of inputs
    std::vector<std::string> primvar_names;
    std::vector<Light> lights;
    std::vector<MeshLight> mesh_lights;  ///< of shapes, see Shape::light
    std::vector<Volume> volumes;
    std::vector<VolumeField> volume_fields;
    Linking linking;
    Casters casters;
    /// Rows of the light mixer; the last one is always `emissive` (emission of surfaces).
    std::vector<LightGroup> groups;
    Camera camera;
    RenderSettings settings;
    std::vector<Provenance> provenance;
    std::vector<std::string> assets;  ///< names of what is modeled as a whole
    std::vector<EffectNote> effect_notes;
    /// What motion vectors need to know; empty unless they are wanted.
    std::vector<Moment> moments;
    /// Primvars of the stage's geometry, by name; only where render vars or options ask for some.
    std::vector<FoundPrimvar> found_primvars;
    double meters_per_unit = 0.01;
    double frames_per_second = 24.0;
    std::vector<InstanceValue> instance_values;  ///< what instances hand down; ranges may be shared

    GroupId emissive_group() const { return GroupId(groups.size() - 1); }
};

/// Class of a shape as the instance places it; instance none = a shape placed directly.
LinkClass link_class(const Scene& scene, uint32_t instance, ShapeId shape);

/// Whether a part of the geometry casts the light's shadows, neither all nor none of it.
bool has_shadow_links(const Scene& scene, const LightLinks& links);

/// Whether its shadows are switched off, end before their time, or are colored.
bool has_shadow_controls(const Scene& scene, const LightLinks& links);

/// Whether rays ask for classes: some light has shadow links, or is geometry and has casters of its
/// own, or something is invisible to rays of a kind.
bool asks_for_classes(const Scene& scene);

/// Of a light that says nothing: what is visible to shadow rays casts its shadows.
LightLinks plain_links(const Scene& scene);

/// Whether its shadows are those of plain_links().
bool has_plain_shadows(const Scene& scene, const LightLinks& links);

/// The set, or null for all geometry.
inline const LinkSet* find_link_set(const Scene& scene, LinkSetId id) {
    return id == none ? nullptr : &scene.linking.sets[id];
}

/// Id of the primvar name, interned on first use.
PrimvarId intern_primvar(Scene& scene, std::string_view name);

/// Id of the name, or none when no mesh or material mentions it.
PrimvarId find_primvar(const Scene& scene, std::string_view name);

/// Whether a surface without a material may not be there somewhere, by its displayOpacity.
bool can_cut_display(const Scene& scene);

/// Calls visit(const Shape&) for the shapes placed directly and those of prototypes.
template <class Visitor>
void for_each_shape(const Scene& scene, Visitor visit) {
    for (const Shape& shape : scene.shapes) visit(shape);
    for (const Prototype& prototype : scene.prototypes)
        for (const Shape& shape : prototype.shapes) visit(shape);
}

/// What the instance hands down, in the order of names' ids.
inline std::span<const InstanceValue> values_of(const Scene& scene, const Instance& instance) {
    return std::span(scene.instance_values).subspan(instance.first_value, instance.value_count);
}

/// The value of that name which the instance hands down; null when it has none.
const InstanceValue* find_value(const Scene& scene, const Instance& instance, PrimvarId name);

/// Gives the instance a value of its own, in place of one of the same name.
void set_value(Scene& scene, Instance& instance, const InstanceValue& value);

/// Whether the input depends on the primvar, by itself, as coordinates or in a pattern.
bool reads_primvar(const Scene& scene, const Input& input, PrimvarId name);

/// The primvar of the shape; null when it has none of that name.
const Primvar* find_primvar(const Shape& shape, PrimvarId name);

/// Whether some of the shape has no material but its displayColor.
bool shows_display_color(const Shape& shape);

/// "displayColor" and "displayOpacity" feed the material of shapes without one.
/// The names that texture coordinates go by, the usual ones first.
inline constexpr std::array<std::string_view, 7> texture_coordinate_names = {
    "st", "UVMap", "uv", "map1", "st0", "st_0", "Texture_uv"};
/// Constant primvars of four numbers: rows of the matrix from shape space to the space of the prim,
/// of shapes whose material has a pattern that asks for it.
inline constexpr std::array<std::string_view, 3> object_space_primvars = {
    "velatura:object:x", "velatura:object:y", "velatura:object:z"};
inline constexpr std::string_view display_color_primvar = "displayColor";
inline constexpr std::string_view display_opacity_primvar = "displayOpacity";

}  // namespace velatura::scene
