// SPDX-License-Identifier: Apache-2.0
#include "translate/shadow_casters.h"

#include "translate/linking.h"
#include "translate/values.h"

#include <fmt/format.h>

#include <map>
#include <utility>

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
        scene::Scene& scene = ctx_.scene;
        for (size_t i = 0; i < scene.shapes.size(); ++i) {
            const uint32_t place =
                i < ctx_.first_baked_shape ? 0 : ctx_.place_of_baked[i - ctx_.first_baked_shape];
            casters().shapes.push_back(caster_of(place, scene.shapes[i].provenance));
        }
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
        for (const Path& path : paths) {
            for (Prim p = ctx_.stage.prim_at(path); p && !p.is_pseudo_root(); p = p.parent()) {
                const std::string name = read_text(p.attribute(caster_attribute), "", ctx_.time);
                if (!name.empty()) return add("name " + name, {name, ""});
            }
        }
        for (const bool components : {true, false}) {
            for (const Path& path : paths) {
                for (Prim p = ctx_.stage.prim_at(path); p && !p.is_pseudo_root(); p = p.parent()) {
                    const bool is_component = p.kind() == "component" && p.is_model();
                    if (components ? is_component : p.is_model()) return add_prim(p);
                }
            }
        }
        const Prim own = ctx_.stage.prim_at(paths.front());
        return own ? add_prim(own) : scene::none;
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
                        "the prims that hold them joins them",
                        count, beyond, caster_attribute));
    }

    Context& ctx_;
    std::map<std::pair<uint32_t, scene::ProvenanceId>, CasterId> known_;
    std::map<std::string, CasterId> ids_;
};

}  // namespace

void find_casters(Context& ctx) {
    if (ctx.options.finds_casters) CasterFinder(ctx).run();
}

}  // namespace velatura::translate
