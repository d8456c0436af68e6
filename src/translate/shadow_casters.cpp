// SPDX-License-Identifier: Apache-2.0
#include "translate/shadow_casters.h"

#include "translate/linking.h"
#include "translate/values.h"
#include "usd/stage/collection.h"
#include "usd/stage/path_expression.h"

#include <fmt/format.h>

#include <map>
#include <set>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

namespace velatura::translate {

namespace {

using scene::CasterId;
using usd::layer::Path;

constexpr const char* caster_attribute = "velatura:shadow:caster";
constexpr size_t many_casters = 64;
/// Every light has a layer of each, which takes memory in every thread.
constexpr size_t most_casters = 1024;

class CasterFinder {
  public:
    explicit CasterFinder(Context& ctx) : ctx_(ctx) {}

    void run() {
        read_patterns();
        if (patterns_.empty()) find_lone_root();
        scene::Scene& scene = ctx_.scene;
        for (size_t i = 0; i < scene.shapes.size(); ++i)
            casters().shapes.push_back(caster_of(place_of_shape(i), scene.shapes[i].provenance));
        std::map<std::pair<uint32_t, uint32_t>, uint32_t> known;  // place, prototype → row
        for (size_t i = 0; i < scene.instances.size(); ++i) {
            const std::pair key(ctx_.place_of_instance[i], scene.instances[i].prototype);
            const auto [at, is_new] = known.try_emplace(key, uint32_t(casters().rows.size()));
            if (is_new) add_row(key.first, key.second);
            casters().row_of_instance.push_back(at->second);
        }
        for (size_t i = 0; i < scene.volumes.size(); ++i) {
            const CasterId caster = caster_of(ctx_.place_of_volume[i], scene.volumes[i].provenance);
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

    uint32_t place_of_shape(size_t i) const {
        return i < ctx_.first_baked_shape ? 0 : ctx_.place_of_baked[i - ctx_.first_baked_shape];
    }

    /// The paths of a thing: its own as it is placed, then its point instancers, the innermost
    /// first.
    CasterId find(const std::vector<Path>& paths) {
        if (!patterns_.empty()) return find_by_pattern(paths);
        if (const std::string name = authored_name(paths); !name.empty())
            return add("name " + name, {name, ""});
        const Prim prim = lone_root_ ? part_below(lone_root_, paths) : model_of(paths);
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

    /// The nearest component, else the nearest model, else the thing itself.
    Prim model_of(const std::vector<Path>& paths) const {
        for (const bool components : {true, false}) {
            for (const Path& path : paths) {
                for (Prim p = ctx_.stage.prim_at(path); p && !p.is_pseudo_root(); p = p.parent()) {
                    const bool is_component = p.kind() == "component" && p.is_model();
                    if (components ? is_component : p.is_model()) return p;
                }
            }
        }
        return ctx_.stage.prim_at(paths.front());
    }

    /// The nearest subcomponent below a prim, else its child that holds the thing, as the outermost
    /// point instancer stands; the prim itself where the thing is not below it.
    Prim part_below(Prim root, const std::vector<Path>& paths) const {
        const auto is_below = [&](const Path& path) {
            return path != root.path() && path.has_prefix(root.path());
        };
        for (const Path& path : paths) {
            if (!is_below(path)) continue;
            for (Prim p = ctx_.stage.prim_at(path); p && !(p == root); p = p.parent())
                if (p.kind() == "subcomponent") return p;
        }
        for (auto path = paths.rbegin(); path != paths.rend(); ++path) {
            if (!is_below(*path)) continue;
            Prim p = ctx_.stage.prim_at(*path);
            while (p && !(p.parent() == root)) p = p.parent();
            if (p) return p;
        }
        return root;
    }

    /// Where one model holds everything, shadows are told apart by what is below it: by the first
    /// prims there that differ.
    void find_lone_root() {
        std::vector<std::vector<Path>> things;
        scene::Scene& scene = ctx_.scene;
        for (size_t i = 0; i < scene.shapes.size(); ++i)
            things.push_back(places_of(ctx_, place_of_shape(i), scene.shapes[i].provenance));
        std::set<std::pair<uint32_t, uint32_t>> known;  // place, prototype
        for (size_t i = 0; i < scene.instances.size(); ++i) {
            const uint32_t place = ctx_.place_of_instance[i];
            if (!known.emplace(place, scene.instances[i].prototype).second) continue;
            for (const scene::Shape& shape : scene.prototypes[scene.instances[i].prototype].shapes)
                things.push_back(places_of(ctx_, place, shape.provenance));
        }
        for (size_t i = 0; i < scene.volumes.size(); ++i)
            things.push_back(places_of(ctx_, ctx_.place_of_volume[i], scene.volumes[i].provenance));

        const auto common = [&](const auto& prim_of) {
            Prim one;
            for (const std::vector<Path>& paths : things) {
                const Prim prim = prim_of(paths);
                if (!prim || (one && !(one == prim))) return Prim();
                one = prim;
            }
            return one;
        };
        for (const std::vector<Path>& paths : things)
            if (!authored_name(paths).empty()) return;
        Prim root = common([&](const std::vector<Path>& paths) { return model_of(paths); });
        while (root) {
            const Prim below =
                common([&](const std::vector<Path>& paths) { return part_below(root, paths); });
            if (!below) lone_root_ = root;  // its parts differ
            if (!below || below == root) return;
            root = below;
        }
    }

    void read_patterns() {
        for (const std::string& text : ctx_.options.casters) {
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
                    fmt::format("--casters {} matches no prim that holds geometry: no caster is "
                                "called by it",
                                pattern.text));
    }

    CasterId add_prim(Prim prim) {
        return add("prim " + prim.path_string(), {prim.name().str(), prim.path_string()});
    }

    CasterId add(const std::string& key, scene::Caster caster) {
        const auto [at, is_new] = ids_.try_emplace(key, scene::none);
        if (is_new && casters().list.size() < most_casters) {
            at->second = CasterId(casters().list.size());
            casters().list.push_back(std::move(caster));
        }
        return at->second;
    }

    void warn_of_many() {
        const size_t count = ids_.size();
        if (count <= many_casters) return;
        const std::string beyond =
            count > most_casters
                ? fmt::format("; those after the first {} count as `rest`", most_casters)
                : "";
        ctx_.diagnostics.warn(
            "many-casters", ctx_.stage.pseudo_root().loc(), "",
            fmt::format("{} things cast shadows with layers of their own for every light{}; {} on "
                        "the prims that hold them joins them, --casters chooses some",
                        count, beyond, caster_attribute));
    }

    struct Pattern {
        std::string text;
        usd::stage::PathExpressionNode expression;
        bool is_used = false;
    };

    Context& ctx_;
    Prim lone_root_;  ///< whose parts are the casters; invalid: models are
    std::vector<Pattern> patterns_;
    std::unordered_map<Path, bool> matched_;
    std::map<std::pair<uint32_t, scene::ProvenanceId>, CasterId> known_;
    std::map<std::string, CasterId> ids_;
};

}  // namespace

void find_casters(Context& ctx) {
    if (ctx.options.finds_casters) CasterFinder(ctx).run();
}

}  // namespace velatura::translate
