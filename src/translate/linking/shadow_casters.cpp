// SPDX-License-Identifier: Apache-2.0
#include "translate/linking/shadow_casters.h"

#include "translate/context/values.h"
#include "translate/linking/caster_tree.h"
#include "translate/linking/linking.h"
#include "usd/stage/collection.h"
#include "usd/stage/path_expression.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

namespace velatura::translate::linking {

namespace {

using scene::CasterId;
using usd::layer::Path;

constexpr const char* caster_attribute = "velatura:shadow:caster";
constexpr size_t many_casters = CasterTree::many_casters;
/// Every light has a layer of each, which takes memory in every thread.
constexpr size_t max_casters = 1024;

class CasterFinder {
  public:
    explicit CasterFinder(Context& ctx) : ctx_(ctx), places_(ctx.state<LinkPathMappings>()) {}

    void run() {
        read_patterns();
        if (patterns_.empty()) divide_the_rest();
        scene::Scene& scene = ctx_.scene;
        for (size_t i = 0; i < scene.shapes.size(); ++i)
            casters().shapes.push_back(caster_of(places_.of_shape(i), scene.shapes[i].provenance));
        std::map<std::pair<uint32_t, uint32_t>, uint32_t> known;  // place, prototype → row
        for (size_t i = 0; i < scene.instances.size(); ++i) {
            const std::pair key(places_.of_instance[i], scene.instances[i].prototype);
            const auto [at, is_new] = known.try_emplace(key, uint32_t(casters().rows.size()));
            if (is_new) add_row(key.first, key.second);
            casters().row_of_instance.push_back(at->second);
        }
        for (size_t i = 0; i < scene.volumes.size(); ++i) {
            const CasterId caster = caster_of(places_.of_volume[i], scene.volumes[i].provenance);
            casters().volumes = i == 0 || casters().volumes == caster ? caster : scene::none;
            if (casters().volumes == scene::none) break;
        }
        warn_of_many();
        warn_of_idle_patterns();
    }

  private:
    scene::Casters& casters() { return ctx_.scene.casters; }

    void add_row(uint32_t place, uint32_t prototype) {
        std::vector<CasterId> row;
        for (const scene::Shape& shape : ctx_.scene.prototypes[prototype].shapes)
            row.push_back(caster_of(place, shape.provenance));
        casters().rows.push_back(std::move(row));
    }

    CasterId caster_of(uint32_t place, scene::ProvenanceId provenance) {
        const auto [at, is_new] = known_.try_emplace({place, provenance}, scene::none);
        if (is_new) at->second = find(places_of(ctx_, place, provenance));
        return at->second;
    }

    /// The paths of a thing: its own as it is placed, then its point instancers, the innermost
    /// first.
    CasterId find(const std::vector<Path>& paths) {
        if (!patterns_.empty()) return find_by_pattern(paths);
        if (const std::string name = authored_name(paths); !name.empty())
            return add("name " + name, {name, ""});
        if (const Prim component = component_of(paths); component && !divides_component_)
            return add_prim(component);
        const Prim prim = ctx_.stage.prim_at(tree_.caster_of(way_to(paths)));
        return prim ? add_prim(prim) : scene::none;
    }

    std::string authored_name(const std::vector<Path>& paths) const {
        for (const Path& path : paths) {
            for (Prim p = ctx_.stage.prim_at(path); p && !p.is_pseudo_root(); p = p.parent()) {
                std::string name = read_text(p.attribute(caster_attribute), "", ctx_.time);
                if (!name.empty()) return name;
            }
        }
        return {};
    }

    /// The outermost component above a thing, whether or not the kinds above that make it a model.
    Prim component_of(const std::vector<Path>& paths) const {
        for (const Path& path : paths) {
            Prim component;
            for (Prim p = ctx_.stage.prim_at(path); p && !p.is_pseudo_root(); p = p.parent())
                if (p.kind() == "component") component = p;
            if (component) return component;
        }
        return {};
    }

    /// From the root to the outermost point instancer, and so on inwards.
    std::vector<CasterTree::Step> way_to(const std::vector<Path>& paths) const {
        std::vector<CasterTree::Step> way;
        for (auto path = paths.rbegin(); path != paths.rend(); ++path) {
            for (const Path& prefix : path->prefixes()) {
                const auto is_here = [&](const CasterTree::Step& s) { return s.prim == prefix; };
                if (std::any_of(way.begin(), way.end(), is_here)) continue;
                const Prim prim = ctx_.stage.prim_at(prefix);
                way.push_back(
                    {prefix, prim && (prim.kind() == "subcomponent" || prim.is_instance() ||
                                      prim.type_name() == "PointInstancer")});
            }
        }
        return way;
    }

    /// Every distinct list of paths.
    std::vector<std::vector<Path>> all_paths() const {
        std::vector<std::vector<Path>> things;
        const scene::Scene& scene = ctx_.scene;
        for (size_t i = 0; i < scene.shapes.size(); ++i)
            things.push_back(places_of(ctx_, places_.of_shape(i), scene.shapes[i].provenance));
        std::set<std::pair<uint32_t, uint32_t>> known;  // place, prototype
        for (size_t i = 0; i < scene.instances.size(); ++i) {
            const uint32_t place = places_.of_instance[i];
            if (!known.emplace(place, scene.instances[i].prototype).second) continue;
            for (const scene::Shape& shape : scene.prototypes[scene.instances[i].prototype].shapes)
                things.push_back(places_of(ctx_, place, shape.provenance));
        }
        for (size_t i = 0; i < scene.volumes.size(); ++i)
            things.push_back(places_of(ctx_, places_.of_volume[i], scene.volumes[i].provenance));
        return things;
    }

    /// What has no component is divided by the prims that hold it, and so is the one component that
    /// holds everything: as the only caster it would let no shadow be chosen.
    void divide_the_rest() {
        const std::vector<std::vector<Path>> things = all_paths();
        std::set<std::string> others;
        std::vector<const std::vector<Path>*> loose, chosen;
        bool has_names = false;
        for (const std::vector<Path>& paths : things) {
            const std::string name = authored_name(paths);
            const Prim component = name.empty() ? component_of(paths) : Prim();
            has_names |= !name.empty();
            if (!name.empty()) others.insert("name " + name);
            if (component) others.insert("prim " + component.path_string());
            (name.empty() && !component ? loose : chosen).push_back(&paths);
        }
        divides_component_ = loose.empty() && !has_names && others.size() == 1;
        if (divides_component_) {
            std::swap(loose, chosen);
            others.clear();
        }
        for (const auto* paths : loose) tree_.add(way_to(*paths));
        for (const auto* paths : chosen) tree_.add_other(way_to(*paths));
        tree_.divide(others.size());
    }

    void read_patterns() {
        for (const std::string& text : ctx_.state<CasterChoice>().patterns) {
            std::string error;  // the command line was checked
            patterns_.push_back(
                {text, usd::stage::parse_path_expression(
                           text, Path::absolute_root(), [](Path path) { return path; }, error)});
        }
    }

    /// The nearest prim that some pattern matches.
    CasterId find_by_pattern(const std::vector<Path>& paths) {
        for (const Path& path : paths) {
            for (Prim p = ctx_.stage.prim_at(path); p && !p.is_pseudo_root(); p = p.parent())
                if (is_matched(p.path())) return add_prim(p);
        }
        return scene::none;
    }

    bool is_matched(Path path) {
        const auto [at, is_new] = matched_.try_emplace(path, false);
        if (!is_new) return at->second;
        const auto in_collection = [&](const Path& prim, const std::string& name, const Path& of) {
            const Prim holder = ctx_.stage.prim_at(prim);
            return holder && usd::stage::CollectionQuery(holder, name).includes(of);
        };
        for (Pattern& pattern : patterns_) {
            if (!usd::stage::matches(pattern.expression, path, ctx_.stage.pseudo_root(),
                                     in_collection))
                continue;
            pattern.is_used = at->second = true;
        }
        return at->second;
    }

    void warn_of_idle_patterns() {
        for (const Pattern& pattern : patterns_)
            if (!pattern.is_used)
                ctx_.diagnostics.warn(
                    "casters", {}, {},
                    fmt::format("--casters {} matches no prim with geometry; no caster is created",
                                pattern.text));
    }

    CasterId add_prim(Prim prim) {
        return add("prim " + prim.path_string(), {prim.name().str(), prim.path_string()});
    }

    CasterId add(const std::string& key, scene::Caster caster) {
        const auto [at, is_new] = ids_.try_emplace(key, scene::none);
        if (is_new && casters().list.size() < max_casters) {
            at->second = CasterId(casters().list.size());
            casters().list.push_back(std::move(caster));
        }
        return at->second;
    }

    void warn_of_many() {
        const size_t count = ids_.size();
        if (count <= many_casters) return;
        const std::string beyond =
            count > max_casters
                ? fmt::format("; those after the first {} are in `rest`", max_casters)
                : "";
        ctx_.diagnostics.warn(
            "many-casters", ctx_.stage.pseudo_root().loc(), "",
            fmt::format("{} shadow casters have layers for every light{}; join some with {} on "
                        "their common prim, or choose some with --casters",
                        count, beyond, caster_attribute));
    }

    struct Pattern {
        std::string text;
        usd::stage::PathExpressionNode expression;
        bool is_used = false;
    };

    Context& ctx_;
    const LinkPathMappings& places_;
    CasterTree tree_;                 ///< of what nothing else names
    bool divides_component_ = false;  ///< the only one
    std::vector<Pattern> patterns_;
    std::unordered_map<Path, bool> matched_;
    std::map<std::pair<uint32_t, scene::ProvenanceId>, CasterId> known_;
    std::map<std::string, CasterId> ids_;
};

}  // namespace

void find_casters(Context& ctx) {
    if (ctx.state<CasterChoice>().is_wanted) CasterFinder(ctx).run();
}

}  // namespace velatura::translate::linking
