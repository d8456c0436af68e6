// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/diagnostics.h"
#include "base/math.h"
#include "base/unique_names.h"
#include "scene/scene.h"
#include "translate/named_color_space.h"
#include "translate/translate.h"
#include "usd/stage/collection.h"
#include "usd/stage/imageable.h"
#include "usd/stage/skeleton.h"
#include "usd/stage/stage.h"

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

namespace velatura::translate {

using usd::stage::Attribute;
using usd::stage::Prim;
using usd::stage::Relationship;
using usd::stage::TimeCode;

/// A light prim and its transform into the space of what holds it.
struct LightSite {
    Prim prim;
    Mat4d matrix;
};

/// What a RenderPass renders of the stage.
struct RenderPass {
    usd::stage::CollectionQuery visible, pruned;
};

struct Placeable;

/// One placement of a prototype, in the space of what holds it.
struct Placement {
    Placeable* what = nullptr;
    Mat4d matrix;  ///< from around the prototype's origin to around the holder's
    /// [key − 1] the same at the later keys of its motion, 1, 2, 4, 8 or 16 of them; empty: stays.
    std::vector<Mat4d> later = {};
    uint32_t first_value = 0, value_count = 0;  ///< of Scene::instance_values, handed down
    scene::ProvenanceId provenance = scene::none;
};

/// A prototype of a point instancer that is being walked.
struct OpenPrototype {
    usd::layer::Path root;
    std::unordered_set<std::string> handed_down;  ///< primvars that its instances may bring along
};

/// What a walk through the namespace collects: the whole stage, or a prototype that is placed many
/// times.
struct Placeable {
    std::string name;
    Prim frame;  ///< of a prototype: the prim whose children's space the walk is in
    std::vector<scene::Shape> shapes;   ///< in the space of this placeable
    std::vector<Placement> placements;  ///< nested ones
    std::vector<LightSite> lights;
    std::vector<scene::Volume> volumes;  ///< in the space of this placeable
    uint32_t prototype = scene::none;    ///< index into Scene::prototypes once `shapes` moved there
    bool is_being_built = false;         ///< guards against prototypes that hold themselves
    bool is_stage = false;               ///< the whole stage, not a prototype
    bool is_point_prototype = false;     ///< of point instancers, not of native instances
    bool is_origin_fixed = false;        ///< something of a prototype stands relative to `origin`
    /// Of a whole prototype, once motion asked for it: see placement_motion.cpp.
    std::optional<bool> must_stay;
    std::optional<double> reach;
    /// Subtracted from the translation of every matrix: what is cast to float stays near zero. For
    /// a prototype the position of the first thing in it, in the prototype's authored space.
    Vec3d origin = Vec3d(0.0);
};

/// A material that was translated, and the primvars that it reads.
struct MaterialEntry {
    scene::MaterialId id = scene::none;
    std::vector<std::string> primvars;
    std::vector<std::string> needed;  ///< those of `primvars` that have no authored fallback
    std::string name;                 ///< prim path
    bool is_emissive = false;
    bool is_displacing = false;
    bool is_hair = false;         ///< means something to curves alone
    bool needs_tangents = false;  ///< by texture coordinates of the mesh, whatever their name
};

/// Where geometry stands that was read once and placed more often, for collections of paths.
struct LinkPlace {
    /// What is below `read` stands below `placed`; empty: where it was read.
    usd::layer::Path read, placed;
    std::vector<usd::layer::Path> instancers;  ///< point instancers, the innermost first
};

/// Rendered faces of a mesh that a GeomSubset holds.
struct FaceSubset {
    usd::layer::Path path;
    std::vector<uint32_t> faces;
};

/// When the shutter opens and closes, in times of the stage.
struct Shutter {
    double open = 0, close = 0;
};

/// State of one translation.
struct Context {
    const usd::stage::Stage& stage;
    const TranslateOptions& options;
    Diagnostics& diagnostics;
    TimeCode time;
    TimeCode frame;  ///< the picture's instant; `time` may be another while the shutter is open
    scene::Scene scene;
    std::optional<Shutter> shutter;  ///< nothing: closed, the picture is of one instant
    bool is_quiet = false;           ///< reads again, at another time, what was complained about
    Vec3d origin = Vec3d(0.0);       ///< world position of render space's origin
    std::vector<std::string> material_purposes = {"full"};  ///< the first that binds wins
    std::unordered_set<std::string> purposes;
    std::optional<RenderPass> render_pass;
    std::unordered_set<std::string> wanted_primvars;  ///< beside those that materials read
    std::unordered_map<std::string, MaterialEntry> materials;
    std::unordered_map<std::string, scene::TextureId> textures;
    std::unordered_map<std::string, std::shared_ptr<const scene::IesProfile>> ies_profiles;
    std::unordered_map<std::string, uint32_t> volume_fields;  ///< by what is wanted of which file
    std::unordered_set<scene::TextureId>
        needs_coordinates;  ///< textures whose `st` has no fallback
    std::unordered_map<std::string, std::unique_ptr<Placeable>> placeables;
    std::unordered_map<std::string, scene::GroupId> light_groups;
    UniqueNames group_names{""};  ///< of Scene::groups
    std::unordered_map<std::string, usd::stage::SkeletonPose> skeleton_poses;
    /// Said by ColorSpaceAPI on a prim or above it.
    std::unordered_map<const usd::stage::PrimData*, std::optional<ColorSpace>> color_spaces;
    std::unordered_set<std::string> told_bindings;  ///< of another purpose, by path
    bool has_emissive_material = false;
    bool has_light_prim = false;  ///< a light was met, whether it shines or not
    bool instance_cap_hit = false;
    size_t copies = 0;                               ///< of what instances do not share
    scene::MaterialId black_material = scene::none;  ///< of mesh lights without material response
    std::vector<Prim> mesh_light_prims;              ///< of Scene::mesh_lights
    bool has_linking = false;                        ///< some light is linked, see note_linking
    std::vector<LinkPlace> link_places = {{}};       ///< first that of what is placed directly
    std::map<std::tuple<uint32_t, scene::ProvenanceId, const Placeable*>, uint32_t>
        known_link_places;
    std::vector<uint32_t> place_of_volume;    ///< of Scene::volumes, into link_places
    std::vector<uint32_t> place_of_instance;  ///< of Scene::instances, into link_places
    size_t first_baked_shape = 0;             ///< of Scene::shapes, which stand elsewhere
    std::vector<uint32_t> place_of_baked;     ///< of those from there on, into link_places

    struct PlacedLight {
        Prim prim;
        uint32_t place = 0;  ///< into link_places
    };

    std::vector<PlacedLight> light_sites;  ///< of Scene::lights
    /// Of meshes, by Shape::provenance.
    std::unordered_map<scene::ProvenanceId, std::vector<FaceSubset>> face_subsets;
    std::vector<OpenPrototype> point_prototypes;  ///< that are being walked, the innermost last

    /// Whether prims of the computed purpose, of the render pass, are rendered.
    bool is_rendered(Prim prim) const {
        const std::string purpose = usd::stage::computed_purpose(prim);
        return purposes.contains(purpose) && usd::stage::is_purpose_visible(prim, purpose) &&
               (!render_pass || render_pass->visible.includes(prim.path()));
    }

    void warn(std::string code, Prim prim, std::string message) {
        if (is_quiet) return;
        diagnostics.warn(std::move(code), prim.loc(), prim.path_string(), std::move(message));
    }

    void warn(std::string code, const Attribute& attribute, std::string message) {
        if (is_quiet) return;
        diagnostics.warn(std::move(code), attribute.loc(), attribute.prim().path_string(),
                         std::move(message));
    }

    /// Whether the prim stands outside the innermost point instancer's prototype that is walked:
    /// what is inherited from there yields to what instances hand down.
    bool is_outside_prototype(const Prim& prim) const {
        return !point_prototypes.empty() && !prim.path().has_prefix(point_prototypes.back().root);
    }

    /// The prim authors the effect so that it does nothing.
    void note_zero(scene::Effect effect, Prim prim, std::string_view why) {
        note_effect(effect, scene::EffectNote::Kind::ProvenZero, prim, why);
    }

    /// The prim calls for the effect, and the picture does without; warn() says so to the user.
    void note_not_simulated(scene::Effect effect, Prim prim, std::string_view why) {
        note_effect(effect, scene::EffectNote::Kind::NotSimulated, prim, why);
    }

    void note(std::string code, Prim prim, std::string message) {
        diagnostics.note(std::move(code), prim.loc(), prim.path_string(), std::move(message));
    }

    void note_effect(scene::Effect effect,
                     scene::EffectNote::Kind kind,
                     Prim prim,
                     std::string_view why) {
        if (!is_quiet)
            scene::note_effect(scene.effect_notes, effect, kind, prim.path_string(), why);
    }

    scene::ProvenanceId provenance(Prim prim) {
        scene.provenance.push_back({prim.path_string(), prim.loc()});
        return scene::ProvenanceId(scene.provenance.size() - 1);
    }
};

}  // namespace velatura::translate
