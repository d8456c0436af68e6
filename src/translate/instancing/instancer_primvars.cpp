// SPDX-License-Identifier: Apache-2.0
#include "translate/instancing/instancer_primvars.h"

#include "translate/color/color_space.h"
#include "translate/context/instance_source.h"
#include "translate/geometry/primvars.h"
#include "translate/materials/materials.h"
#include "usd/stage/primvars.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <set>
#include <span>
#include <utility>

namespace velatura::translate::instancing {

namespace {

constexpr const char* ignored = "it is ignored; instances use the primvars of their prototypes";

void warn_primvar(Context& ctx, const usd::stage::Primvar& source, const std::string& what) {
    ctx.warn("bad-primvar", source.attribute, fmt::format("primvar {} {}", source.name, what));
}

/// Which row each instance has, one where all have the same; nothing, with a warning, where the
/// numbers do not fit.
std::optional<std::vector<uint32_t>> rows_of(Context& ctx,
                                             const usd::stage::Primvar& source,
                                             size_t stored,
                                             size_t instances) {
    using usd::stage::Interpolation;
    const std::vector<int> indices =
        source.is_indexed() ? source.index_values(ctx.time) : std::vector<int>();
    const size_t found = source.is_indexed() ? indices.size() : stored;
    const char* const kind = source.is_indexed() ? "indices" : "values";
    bool is_for_all = source.interpolation == Interpolation::Constant ||
                      source.interpolation == Interpolation::Uniform;
    if (found == 0) {
        warn_primvar(ctx, source, fmt::format("has no {}; {}", kind, ignored));
        return std::nullopt;
    }
    if (is_for_all && found > 1) {
        warn_primvar(
            ctx, source,
            fmt::format("is {} and has {} {}, expected 1; the first is used everywhere",
                        usd::stage::interpolation_name(source.interpolation), found, kind));
    } else if (!is_for_all && found != instances) {
        const bool is_one = found == 1;
        warn_primvar(ctx, source,
                     fmt::format("has {} {}, expected {}, one for each instance; {}", found, kind,
                                 instances, is_one ? "it is used for all instances" : ignored));
        if (!is_one) return std::nullopt;
        is_for_all = true;
    }
    std::vector<uint32_t> rows;
    for (size_t i = 0; i < (is_for_all ? 1 : instances); ++i) {
        const int64_t row = indices.empty() ? int64_t(i) : int64_t(indices[i]);
        if (row < 0 || size_t(row) >= stored) {
            warn_primvar(ctx, source,
                         fmt::format("has the index {}, expected 0 to {}; {}", row,
                                     int64_t(stored) - 1, ignored));
            return std::nullopt;
        }
        rows.push_back(uint32_t(row));
    }
    return rows;
}

/// Whether some shape of the prototype is displaced by the primvar of instances.
bool is_displaced_by(const scene::Scene& scene, const InstanceSource& what, scene::PrimvarId name) {
    const auto reads = [&](scene::MaterialId material) {
        return material < scene.materials.size() &&
               scene::reads_primvar(scene, scene.materials[material].displacement, name);
    };
    const auto is_displaced = [&](const scene::Shape& shape) {
        const auto* mesh = std::get_if<scene::Mesh>(&shape.geometry);
        if (mesh == nullptr) return false;
        const scene::Primvar* own = scene::find_primvar(shape, name);
        return (own == nullptr || own->yields_to_instance) &&
               (reads(shape.material) ||
                std::any_of(mesh->face_materials.begin(), mesh->face_materials.end(), reads));
    };
    return std::any_of(what.shapes.begin(), what.shapes.end(), is_displaced) ||
           std::any_of(what.placements.begin(), what.placements.end(),
                       [&](const Placement& p) { return is_displaced_by(scene, *p.what, name); });
}

}  // namespace

ValueRange add_values(scene::Scene& scene, const std::vector<scene::InstanceValue>& values) {
    std::vector<scene::InstanceValue>& all = scene.instance_values;
    const size_t n = values.size();
    if (n > 0 && all.size() >= n &&
        std::equal(values.begin(), values.end(), all.end() - int64_t(n)))
        return {uint32_t(all.size() - n), uint32_t(n)};
    const ValueRange range{uint32_t(all.size()), uint32_t(n)};
    all.insert(all.end(), values.begin(), values.end());
    return range;
}

std::unordered_set<std::string> primvar_names(Prim prim) {
    std::unordered_set<std::string> names;
    for (const usd::stage::Primvar& primvar : usd::stage::find_primvars(prim))
        names.insert(primvar.name);
    return names;
}

bool InstancerPrimvars::is_wanted(const std::string& name) const {
    if (ctx_.state<geometry::RequestedPrimvars>().names.contains(name)) return true;
    const auto& materials = ctx_.state<materials::TranslatedMaterials>().entries;
    return std::any_of(materials.begin(), materials.end(), [&](const auto& entry) {
        const std::vector<std::string>& names = entry.second.primvars;
        return std::find(names.begin(), names.end(), name) != names.end();
    });
}

InstancerPrimvars::InstancerPrimvars(Context& ctx, Prim instancer, size_t instances)
    : ctx_(ctx), instancer_(instancer) {
    if (instances == 0) return;
    for (const usd::stage::Primvar& primvar : usd::stage::find_primvars(instancer)) {
        if (!is_wanted(primvar.name)) continue;
        Source source;
        int width = 0;
        if (color::read_color_rows(ctx, primvar.attribute, source.numbers, width)) {
            ctx.state<geometry::RequestedPrimvars>().note(primvar, width);
        } else {
            ctx.warn("unsupported-primvar", primvar.attribute,
                     fmt::format("primvar {} of type {} is not supported; {}", primvar.name,
                                 primvar.attribute.type_name().str(), ignored));
            continue;
        }
        if (primvar.element_size != 1) {
            ctx.warn("unsupported-primvar", primvar.attribute,
                     fmt::format("primvar {} has elementSize {}, only 1 is supported; {}",
                                 primvar.name, primvar.element_size, ignored));
            continue;
        }
        const size_t stored = source.numbers.size() / size_t(width);
        // Nothing at this time
        if (stored == 0) continue;
        std::optional<std::vector<uint32_t>> rows = rows_of(ctx, primvar, stored, instances);
        if (!rows) continue;
        source.value.name = scene::intern_primvar(ctx.scene, primvar.name);
        source.value.width = uint8_t(width);
        source.value.yields_to_outer = ctx.is_outside_prototype(primvar.attribute.prim());
        std::copy_n(&source.numbers[(*rows)[0] * size_t(width)], width,
                    source.value.values.begin());
        if (rows->size() > 1) source.rows = *std::move(rows);
        sources_.push_back(std::move(source));
    }
    std::ranges::sort(sources_, {}, [](const Source& source) { return source.value.name; });
}

ValueRange InstancerPrimvars::of(size_t instance) {
    if (sources_.empty()) return {};
    std::vector<scene::InstanceValue> values;
    for (const Source& source : sources_) {
        values.push_back(source.value);
        if (source.rows.empty()) continue;
        const size_t width = source.value.width;
        std::copy_n(&source.numbers[source.rows[instance] * width], width,
                    values.back().values.begin());
    }
    return add_values(ctx_.scene, values);
}

void InstancerPrimvars::warn_displacement(const std::vector<InstanceSource*>& prototypes) {
    for (const Source& source : sources_) {
        const bool is_displaced =
            std::any_of(prototypes.begin(), prototypes.end(), [&](const InstanceSource* what) {
                return what != nullptr && is_displaced_by(ctx_.scene, *what, source.value.name);
            });
        if (is_displaced)
            ctx_.warn(
                "unsupported-displacement", instancer_,
                fmt::format(
                    "the displacement of a prototype reads primvar {}, which instances override; "
                    "the prototype is displaced once for all instances, with the fallback",
                    ctx_.scene.primvar_names[source.value.name]));
    }
}

ValueRange handed_on(scene::Scene& scene, const Placement& inner, const ValueRange& outer) {
    if (outer.count == 0) return {inner.first_value, inner.value_count};
    if (inner.value_count == 0) return outer;
    const auto own = std::span(scene.instance_values).subspan(inner.first_value, inner.value_count);
    const auto around = std::span(scene.instance_values).subspan(outer.first, outer.count);
    // Both go by names
    std::vector<scene::InstanceValue> values;
    size_t i = 0, k = 0;
    while (i < own.size() || k < around.size()) {
        const bool is_own_next =
            k == around.size() || (i < own.size() && own[i].name < around[k].name);
        const bool is_both = !is_own_next && i < own.size() && own[i].name == around[k].name;
        if (is_own_next) {
            values.push_back(own[i++]);
        } else if (is_both) {
            values.push_back(own[i].yields_to_outer ? around[k] : own[i]);
            ++i;
            ++k;
        } else {
            values.push_back(around[k++]);
        }
    }
    return add_values(scene, values);
}

void inherit_primvars(const scene::Scene& scene,
                      const ValueRange& range,
                      std::vector<scene::Primvar>& primvars) {
    for (uint32_t i = 0; i < range.count; ++i) {
        const scene::InstanceValue& value = scene.instance_values[range.first + i];
        const auto own = std::find_if(primvars.begin(), primvars.end(),
                                      [&](const auto& p) { return p.name == value.name; });
        if (own != primvars.end()) {
            if (!own->yields_to_instance) continue;
            primvars.erase(own);
        }
        scene::Primvar primvar;
        primvar.name = value.name;
        primvar.width = value.width;
        primvar.values.assign(value.values.begin(), value.values.begin() + value.width);
        primvars.push_back(std::move(primvar));
    }
}

}  // namespace velatura::translate::instancing
