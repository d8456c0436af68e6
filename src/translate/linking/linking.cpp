// SPDX-License-Identifier: Apache-2.0
#include "translate/linking/linking.h"

#include "translate/context/instance_source.h"
#include "translate/context/values.h"
#include "translate/lights/light_filters.h"
#include "translate/lights/light_inputs.h"
#include "translate/lights/lights.h"
#include "translate/linking/link_subsets.h"
#include "usd/stage/collection.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <utility>

namespace velatura::translate::linking {

namespace {

using scene::LinkClass;
using scene::LinkSet;
using scene::LinkSetId;
using scene::none;
using scene::RayKind;
using usd::layer::Path;
using usd::stage::CollectionQuery;

/// Whether a linking collection says more than "everything".
bool is_linked(Context& ctx, Prim light, const std::string& collection) {
    const std::string base = "collection:" + collection;
    const Attribute include_root = light.attribute(base + ":includeRoot");
    const bool has_root = read_bool(include_root, true, ctx.time);
    const bool has_targets = !light.relationship(base + ":includes").targets().empty() ||
                             !light.relationship(base + ":excludes").targets().empty();
    return !has_root || has_targets;
}

/// Names an expression that other properties of its collection put out of force.
void warn_idle_expression(Context& ctx, Prim light, const std::string& collection) {
    const std::string base = "collection:" + collection;
    const Attribute expression = light.attribute(base + ":membershipExpression");
    if (!expression.has_authored_value()) return;
    if (read_bool(light.attribute(base + ":includeRoot"), true, ctx.time) ||
        !light.relationship(base + ":includes").targets().empty() ||
        !light.relationship(base + ":excludes").targets().empty())
        ctx.warn("idle-membership-expression", expression,
                 fmt::format("membershipExpression of {} is ignored, because includeRoot (default "
                             "true) is not false or something is included or excluded",
                             collection));
}

/// Names collections that are to be excluded: in USD only prims can be.
void warn_excluded_collections(Context& ctx, Prim light, const std::string& collection) {
    const auto excludes = light.relationship("collection:" + collection + ":excludes");
    for (const Path& path : excludes.targets())
        if (path.to_string().find(".collection:") != std::string::npos)
            ctx.diagnostics.warn(
                "excluded-collection", excludes.loc(), light.path_string(),
                fmt::format("{} excludes the collection <{}>; USD excludes prims only, and this "
                            "has no effect",
                            collection, path.to_string()));
}

Path map_path(const LinkPathMapping& place, Path path) {
    return place.read.is_empty() ? path : path.replace_prefix(place.read, place.placed);
}

std::vector<Path> paths_at(const Context& ctx,
                           const LinkPathMapping& place,
                           scene::ProvenanceId provenance) {
    std::vector<Path> paths = {
        map_path(place, Path::from(ctx.scene.provenance[provenance].prim_path))};
    paths.insert(paths.end(), place.instancers.begin(), place.instancers.end());
    return paths;
}

/// Of a placement inside another one.
VisibilityOpinion visibility_at(const Context& ctx, const LinkPathMapping& place, Path read) {
    VisibilityOpinion opinion = ctx.state<AuthoredVisibility>().above(read, place.read);
    opinion.inherit(place.inherited);
    return opinion;
}

/// A mesh light is a surface, which cannot be one for some geometry and another for the rest.
void warn_of_filter_links(Context& ctx, const scene::MeshLight& light) {
    for (const scene::LightFilter& filter : light.filters) {
        const Prim prim = ctx.stage.prim_at(filter.name);
        if (prim && is_linked(ctx, prim, "filterLink"))
            ctx.warn("unsupported-light-linking", prim,
                     fmt::format("filterLink is not supported for filters of geometry that is "
                                 "a light; the filter acts on everything that <{}> lights",
                                 light.name));
    }
}

/// All collections of all lights, what rays see, and what geometry is in them.
class Linker {
  public:
    explicit Linker(Context& ctx) : ctx_(ctx), places_(ctx.state<LinkPathMappings>()) {}

    void run() {
        read_collections();
        if (!ctx_.state<AuthoredVisibility>().of_prim.empty()) remove_unseen();
        classify();
        warn_of_volumes();
        make_sets();
        make_ray_sets();
        link_lights();
    }

  private:
    static constexpr uint32_t everything = scene::none;

    /// Geometry with the same traits is one class.
    struct Traits {
        std::vector<bool> members;  ///< [query]
        scene::RayKinds visible = scene::RayKinds::all();
        bool is_matte = false, is_catcher = false;

        auto operator<=>(const Traits&) const = default;
    };

    /// Collections of one light, as indices into queries_.
    struct Request {
        Prim light;
        bool is_seen = true;  ///< by the camera
        uint32_t lit = everything, casters = everything;
        bool casts_nothing = false;
        std::vector<uint32_t> filters;  ///< [filter of the light], what it acts on
    };

    void read_collections() {
        const auto& found = ctx_.state<lights::CollectedLights>();
        for (size_t i = 0; i < found.placed.size(); ++i) {
            const lights::CollectedLights::Placed& light = found.placed[i];
            const LinkPathMapping& place = places_.list[light.place];
            const Prim prim = ctx_.stage.prim_at(map_path(place, light.prim.path()));
            lights_.push_back(read_request(prim ? prim : light.prim));
            const std::optional<RenderPass>& pass = ctx_.rendered.pass;
            const bool is_in_pass =
                !pass || !pass->camera_visible ||
                pass->camera_visible->includes(map_path(place, light.prim.path()));
            lights_.back().is_seen =
                is_in_pass &&
                is_light_seen(ctx_, light.prim, visibility_at(ctx_, place, light.prim.path()));
            for (const scene::LightFilter& filter : ctx_.scene.lights[i].filters)
                lights_.back().filters.push_back(read_filter_collection(filter));
        }
        for (size_t i = 0; i < found.mesh_lights.size(); ++i) {
            mesh_lights_.push_back(read_request(found.mesh_lights[i]));
            warn_of_filter_links(ctx_, ctx_.scene.mesh_lights[i]);
        }
    }

    uint32_t read_filter_collection(const scene::LightFilter& filter) {
        const Prim prim = ctx_.stage.prim_at(filter.name);
        return prim ? read_collection(prim, "filterLink") : everything;
    }

    Request read_request(Prim light) {
        Request request;
        request.light = light;
        request.lit = read_collection(light, "lightLink");
        request.casters = read_collection(light, "shadowLink");
        request.casts_nothing =
            !read_bool(lights::light_input(ctx_, light, "shadow:enable"), true, ctx_.time);
        return request;
    }

    uint32_t read_collection(Prim light, const std::string& name) {
        if (!is_linked(ctx_, light, name)) return everything;
        CollectionQuery query(light, name);
        // Lights that say the same share a set
        std::string key = query.rule_text();
        if (key.empty()) key = light.path_string() + "." + name;
        const auto [at, is_new] = known_queries_.try_emplace(key, uint32_t(queries_.size()));
        if (is_new) queries_.push_back(std::move(query));
        return at->second;
    }

    /// Class of what is at these paths, and in these subsets, by all queries.
    LinkClass class_at(const std::vector<Path>& paths,
                       const std::vector<Path>& subsets,
                       const VisibilityOpinion& opinion) {
        Traits traits;
        for (const CollectionQuery& query : queries_)
            traits.members.push_back(includes(query, paths, subsets));
        traits.visible = opinion.kinds();
        traits.is_matte = opinion.is_matte.value_or(false);
        traits.is_catcher = opinion.is_catcher.value_or(false);
        if (const std::optional<RenderPass>& pass = ctx_.rendered.pass) {
            if (pass->camera_visible && !pass->camera_visible->includes_first(paths))
                traits.visible = traits.visible & ~scene::RayKinds().with(RayKind::Camera);
            if (pass->mattes && pass->mattes->includes_first(paths)) traits.is_matte = true;
        }
        // Nothing of what is held out is left for a plate
        if (traits.is_matte) traits.is_catcher = false;
        const auto [at, is_new] = classes_.try_emplace(traits, LinkClass(classes_.size()));
        if (is_new) traits_.push_back(traits);
        occurs_.resize(classes_.size());
        occurs_[at->second] = true;
        return at->second;
    }

    /// A subset that is named itself decides for its faces.
    static bool includes(const CollectionQuery& query,
                         const std::vector<Path>& paths,
                         const std::vector<Path>& subsets) {
        for (const Path& subset : subsets)
            if (const std::optional<bool> ruling = query.ruling_at(subset)) return *ruling;
        return query.includes_first(paths);
    }

    LinkClass class_of(const LinkPathMapping& place, scene::ProvenanceId provenance) {
        const std::vector<Path> paths = paths_at(ctx_, place, provenance);
        std::vector<Path> subsets;
        if (const auto at = subsets_.find(provenance); at != subsets_.end())
            for (const Path& path : at->second) subsets.push_back(map_path(place, path));
        const Path read = Path::from(ctx_.scene.provenance[provenance].prim_path);
        return class_at(paths, subsets, visibility_at(ctx_, place, read));
    }

    VisibilityOpinion visibility_of(uint32_t place, scene::ProvenanceId provenance) const {
        const Path read = Path::from(ctx_.scene.provenance[provenance].prim_path);
        return visibility_at(ctx_, places_.list[place], read);
    }

    /// Takes out the instances and volumes that rays of no kind see. What is placed directly and
    /// unseen was never read.
    void remove_unseen() {
        scene::Scene& scene = ctx_.scene;
        std::map<std::pair<uint32_t, uint32_t>, bool> known;  // place, prototype → unseen
        const auto is_unseen = [&](size_t i) {
            const uint32_t prototype = scene.instances[i].prototype;
            const uint32_t place = places_.of_instance[i];
            const auto [at, is_new] = known.try_emplace(std::pair(place, prototype), false);
            const std::vector<scene::Shape>& shapes = scene.prototypes[prototype].shapes;
            if (is_new)
                at->second = std::all_of(shapes.begin(), shapes.end(), [&](const auto& shape) {
                    return visibility_of(place, shape.provenance).kinds().is_empty();
                });
            return at->second;
        };
        erase_both(scene.instances, places_.of_instance, is_unseen);
        erase_both(scene.volumes, places_.of_volume, [&](size_t i) {
            const uint32_t place = places_.of_volume[i];
            return visibility_of(place, scene.volumes[i].provenance).kinds().is_empty();
        });
    }

    /// Erases elements, by their numbers, from two lists of as many.
    template <class A, class B, class Test>
    static void erase_both(std::vector<A>& a, std::vector<B>& b, const Test& is_erased) {
        size_t kept = 0;
        for (size_t i = 0; i < a.size(); ++i) {
            if (is_erased(i)) continue;
            if (kept != i) {
                a[kept] = std::move(a[i]);
                b[kept] = std::move(b[i]);
            }
            ++kept;
        }
        a.resize(kept);
        b.resize(kept);
    }

    void classify() {
        // What every light knows is class 0
        Traits all;
        all.members.assign(queries_.size(), true);
        classes_[all] = 0;
        traits_.push_back(all);
        occurs_.push_back(false);
        if (queries_.empty() && ctx_.state<AuthoredVisibility>().of_prim.empty() &&
            !asks_for_places(ctx_.rendered))
            return;
        subsets_ = divide_by_subsets(ctx_, queries_);
        scene::Scene& scene = ctx_.scene;
        for (size_t i = 0; i < scene.shapes.size(); ++i) {
            const LinkPathMapping& place = places_.list[places_.of_shape(i)];
            scene.shapes[i].link = class_of(place, scene.shapes[i].provenance);
        }
        for (size_t i = 0; i < scene.volumes.size(); ++i)
            scene.volumes[i].link =
                class_of(places_.list[places_.of_volume[i]], scene.volumes[i].provenance);
        std::map<std::pair<uint32_t, uint32_t>, uint32_t> known;  // place, prototype → row
        for (size_t i = 0; i < scene.instances.size(); ++i) {
            const uint32_t prototype = scene.instances[i].prototype;
            const uint32_t place = places_.of_instance[i];
            const auto [at, is_new] = known.try_emplace(std::pair(place, prototype), 0);
            if (is_new) at->second = make_row(places_.list[place], prototype);
            scene.instances[i].link_row = at->second;
        }
    }

    uint32_t make_row(const LinkPathMapping& place, uint32_t prototype) {
        std::vector<LinkClass> row;
        for (const scene::Shape& shape : ctx_.scene.prototypes[prototype].shapes)
            row.push_back(class_of(place, shape.provenance));
        if (std::all_of(row.begin(), row.end(), [](LinkClass c) { return c == 0; }))
            return scene::none;
        const auto [at, is_new] = rows_.try_emplace(row, uint32_t(ctx_.scene.linking.rows.size()));
        if (is_new) ctx_.scene.linking.rows.push_back(std::move(row));
        return at->second;
    }

    void warn_of_volumes() {
        const auto warn = [&](const scene::Volume& volume, const char* code, const char* text) {
            const scene::Provenance& at = ctx_.scene.provenance[volume.provenance];
            ctx_.diagnostics.warn(code, at.loc, at.prim_path, text);
        };
        for (const scene::Volume& volume : ctx_.scene.volumes) {
            if (traits_[volume.link].is_matte &&
                scene::has_emission(volume, ctx_.scene.volume_fields))
                warn(volume, "matte-emission",
                     "the volume is a matte, and what it emits is seen all the same");
            if (traits_[volume.link].is_catcher)
                warn(volume, "volume-catcher",
                     "a volume cannot be a catcher; it is rendered as any other");
        }
    }

    /// The classes that occur and of whose traits `is_in` holds; none: all of them.
    template <class Test>
    LinkSetId set_of(const Test& is_in) {
        LinkSet set(traits_.size());
        bool is_everything = true;
        for (LinkClass c = 0; c < traits_.size(); ++c) {
            if (!occurs_[c]) continue;
            if (is_in(traits_[c]))
                set.add(c);
            else
                is_everything = false;
        }
        return is_everything ? scene::none : set_id(set);
    }

    /// The classes that occur and of whose traits `is_in` holds; none: not one.
    template <class Test>
    LinkSetId some_of(const Test& is_in) {
        LinkSet set(traits_.size());
        for (LinkClass c = 0; c < traits_.size(); ++c)
            if (occurs_[c] && is_in(traits_[c])) set.add(c);
        return set.is_empty() ? scene::none : set_id(set);
    }

    static bool is_seen(const Traits& traits, RayKind kind) { return traits.visible.has(kind); }

    void make_sets() {
        ctx_.scene.linking.class_count = traits_.size();
        for (size_t q = 0; q < queries_.size(); ++q) {
            sets_.push_back(set_of([&](const Traits& traits) { return traits.members[q]; }));
            caster_sets_.push_back(set_of([&](const Traits& traits) {
                return traits.members[q] && is_seen(traits, RayKind::Shadow);
            }));
        }
    }

    void make_ray_sets() {
        scene::Linking& linking = ctx_.scene.linking;
        bool is_path_restricted = false;
        for (size_t k = 0; k < scene::ray_kind_count; ++k) {
            const auto kind = RayKind(k);
            linking.visible[k] =
                set_of([&](const Traits& traits) { return is_seen(traits, kind); });
            is_path_restricted =
                is_path_restricted || (kind != RayKind::Camera && linking.visible[k] != none);
        }
        linking.mattes = some_of([](const Traits& traits) { return traits.is_matte; });
        linking.catchers = some_of([](const Traits& traits) { return traits.is_catcher; });
        LinkSetId& shadow = linking.visible[size_t(RayKind::Shadow)];
        if (!is_path_restricted || shadow != none) return;
        LinkSet all(traits_.size());
        for (LinkClass c = 0; c < traits_.size(); ++c) all.add(c);
        shadow = set_id(all);
    }

    LinkSetId set_id(const LinkSet& set) {
        std::vector<LinkSet>& sets = ctx_.scene.linking.sets;
        const auto at = std::find(sets.begin(), sets.end(), set);
        if (at != sets.end()) return LinkSetId(at - sets.begin());
        sets.push_back(set);
        return LinkSetId(sets.size() - 1);
    }

    void link(const Request& request, scene::LightLinks& links) {
        const bool says_something = request.lit != everything || request.casters != everything;
        if (request.lit != everything) links.lit = sets_[request.lit];
        if (request.casters != everything) links.casters = caster_sets_[request.casters];
        if (links.casters == none) links.casters = scene::plain_links(ctx_.scene).casters;
        if (says_something && links.lit == scene::none &&
            links.casters == scene::plain_links(ctx_.scene).casters)
            ctx_.note_zero(scene::Effect::LightLinking, request.light,
                           "lightLink and shadowLink include everything");
        if (!request.casts_nothing) return;
        // Whatever else is said of its shadows
        const LinkSetId lit = links.lit;
        links = {};
        links.lit = lit;
        links.casters = set_id(LinkSet(traits_.size()));
    }

    /// Lobes that see nothing of geometry that is a light are not lit by it either.
    static void hide_from_lobes(scene::MeshLight& light, scene::RayKinds visible) {
        if (!visible.has(RayKind::Diffuse)) light.diffuse_multiplier = 0.0f;
        if (!visible.has(RayKind::Reflection)) light.specular_multiplier = 0.0f;
    }

    /// The filters of a light that act on a class.
    std::vector<bool> filters_of(const Request& request, LinkClass c) const {
        std::vector<bool> acting;
        for (const uint32_t query : request.filters)
            acting.push_back(query == everything || traits_[c].members[query]);
        return acting;
    }

    /// A light whose filters act on some geometry alone becomes several, with as many of the
    /// filters each as act on what it is lit by: their links are those of the light and leave
    /// nothing twice. The camera sees one of them.
    void divide_by_filters(size_t i) {
        const Request& request = lights_[i];
        if (std::all_of(request.filters.begin(), request.filters.end(),
                        [](uint32_t query) { return query == everything; }))
            return;
        const scene::LinkSetId lit = ctx_.scene.lights[i].links.lit;
        // The light that keeps most filters comes first
        std::map<std::vector<bool>, LinkSet, std::greater<>> parts;
        for (LinkClass c = 0; c < traits_.size(); ++c) {
            if (!occurs_[c] || (lit != none && !ctx_.scene.linking.sets[lit].holds(c))) continue;
            const std::vector<bool> acting = filters_of(request, c);
            parts.try_emplace(acting, LinkSet(traits_.size())).first->second.add(c);
        }
        const scene::Light whole = ctx_.scene.lights[i];
        bool is_first = true;
        for (const auto& [acting, classes] : parts) {
            scene::Light part = whole;
            part.filters.clear();
            for (size_t k = 0; k < acting.size(); ++k)
                if (acting[k]) part.filters.push_back(whole.filters[k]);
            if (parts.size() > 1) part.links.lit = set_id(classes);
            part.is_filter_copy = !is_first;
            if (is_first) {
                ctx_.scene.lights[i] = std::move(part);
            } else {
                part.is_camera_visible = false;
                ctx_.scene.lights.push_back(std::move(part));
            }
            is_first = false;
        }
    }

    void link_lights() {
        for (size_t i = 0; i < lights_.size(); ++i) {
            link(lights_[i], ctx_.scene.lights[i].links);
            ctx_.scene.lights[i].is_camera_visible = lights_[i].is_seen;
        }
        for (size_t i = 0; i < lights_.size(); ++i) divide_by_filters(i);
        const AuthoredVisibility& authored = ctx_.state<AuthoredVisibility>();
        for (size_t i = 0; i < mesh_lights_.size(); ++i) {
            link(mesh_lights_[i], ctx_.scene.mesh_lights[i].links);
            hide_from_lobes(ctx_.scene.mesh_lights[i],
                            authored.above(mesh_lights_[i].light.path()).kinds());
        }
        if (ctx_.scene.linking.sets.empty()) forget_classes();
    }

    /// All collections hold everything: the scene is as if nobody had linked anything.
    void forget_classes() {
        for (scene::Shape& shape : ctx_.scene.shapes) shape.link = 0;
        for (scene::Volume& volume : ctx_.scene.volumes) volume.link = 0;
        for (scene::Instance& instance : ctx_.scene.instances) instance.link_row = scene::none;
        ctx_.scene.linking = {};
    }

    Context& ctx_;
    LinkPathMappings& places_;
    std::vector<Request> lights_, mesh_lights_;
    std::vector<CollectionQuery> queries_;
    std::map<std::string, uint32_t> known_queries_;
    SubsetsOfPart subsets_;
    std::map<Traits, LinkClass> classes_;
    std::vector<Traits> traits_;  // [class]
    std::vector<bool> occurs_;    // [class]
    std::map<std::vector<LinkClass>, uint32_t> rows_;
    std::vector<LinkSetId> sets_, caster_sets_;  // [query]
};

}  // namespace

bool note_linking(Context& ctx, Prim light) {
    bool is_any = false;
    for (const char* collection : {"lightLink", "shadowLink"}) {
        is_any = is_linked(ctx, light, collection) || is_any;
        warn_idle_expression(ctx, light, collection);
        warn_excluded_collections(ctx, light, collection);
    }
    for (const Prim filter : lights::filter_prims(ctx, light)) {
        is_any = is_linked(ctx, filter, "filterLink") || is_any;
        warn_idle_expression(ctx, filter, "filterLink");
        warn_excluded_collections(ctx, filter, "filterLink");
    }
    bool& is_kept = ctx.state<LinkPathMappings>().is_kept;
    is_kept = is_kept || is_any;
    return is_any;
}

std::vector<usd::layer::Path> places_of(const Context& ctx,
                                        uint32_t place,
                                        scene::ProvenanceId provenance) {
    return paths_at(ctx, ctx.state<LinkPathMappings>().list[place], provenance);
}

uint32_t place_inside(Context& ctx, uint32_t outer, const Placement& placement) {
    LinkPathMappings& places = ctx.state<LinkPathMappings>();
    if (!places.is_kept) return 0;
    const auto [at, is_new] = places.known.try_emplace(
        {outer, placement.provenance, placement.what}, uint32_t(places.list.size()));
    if (!is_new) return at->second;
    LinkPathMapping place = places.list[outer];
    const Path read = Path::from(ctx.scene.provenance[placement.provenance].prim_path);
    const Path path = map_path(place, read);
    place.inherited = visibility_at(ctx, places.list[outer], read);
    if (placement.what->is_point_prototype) {
        place.instancers.insert(place.instancers.begin(), path);
    } else {
        place.read = placement.what->frame.path();
        place.placed = path;
    }
    places.list.push_back(std::move(place));
    return at->second;
}

bool asks_for_places(const RenderedPrims& rendered) {
    return rendered.pass && (rendered.pass->camera_visible || rendered.pass->mattes);
}

void link_all(Context& ctx) {
    Linker(ctx).run();
}

}  // namespace velatura::translate::linking
