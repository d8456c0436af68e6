// SPDX-License-Identifier: Apache-2.0
#include "accumulate/layer_set.h"

#include "accumulate/names.h"
#include "base/json_numbers.h"
#include "base/unique_names.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <stdexcept>

namespace velatura::accumulate {

namespace {

constexpr uint64_t max_accumulators = uint64_t(1)
                                      << 28;  // times two for clamps, and for halves, below 2^32
constexpr uint64_t other_accumulators_per_group = 3;  // all of it, direct, unoccluded

/// False where a word is unknown, or a layer has no channels or too many.
bool parse_named_data(const nlohmann::json& list, LayerSet& set) {
    for (const auto& d : list) {
        DataLayer layer;
        layer.name = d.at("name").get<std::string>();
        layer.primvar = d.at("primvar").get<std::string>();
        layer.group = d.value("group", std::string());
        const auto source = d.at("source").get<std::string>();
        const auto found = find_data_source(source);
        const auto filter = find_data_filter(d.at("filter").get<std::string>());
        layer.suffixes = d.at("channels").get<std::string>();
        const bool is_primvar = source == name_of(DataSource::Primvar);
        if ((!found && !is_primvar) || !filter || layer.width() < 1 || layer.width() > 4)
            return false;
        layer.source = is_primvar ? DataSource::Primvar : *found;
        layer.filter = *filter;
        layer.is_half = d.at("half").get<bool>();
        layer.is_premultiplied = d.at("premultiplied").get<bool>();
        set.named_data.push_back(std::move(layer));
    }
    return true;
}

}  // namespace

std::vector<DataFilter> LayerSet::picking_filters() const {
    std::vector<DataFilter> filters;
    for (const DataLayer& d : named_data)
        if (!d.is_summed()) filters.push_back(d.filter);
    return filters;
}

std::vector<size_t> LayerSet::lobes() const {
    std::vector<size_t> lobes;
    for (size_t i = 0; i < path_layers.size(); ++i)
        if (path_layers[i].family == lobe_matrix_family) lobes.push_back(i);
    return lobes;
}

std::string LayerSet::column_name(int column) const {
    return column > last_bounce ? std::string("tail") : fmt::format("b{}", column);
}

void LayerSet::normalize_names() {
    size_t longest = caster_layers ? max_group_name_bytes_beside_casters
                     : has_clamp() ? max_group_name_bytes_beside_clamps
                                   : max_group_name_bytes;
    if (has_lobe_matrix())
        longest = std::min(longest, has_clamp() ? max_group_name_bytes_beside_clamped_lobes
                                                : max_group_name_bytes_beside_lobes);
    UniqueNames group_names("_", longest);
    for (LightGroup& group : groups) group.name = group_names.make(legal_group_name(group.name));
    UniqueNames caster_names("_", max_caster_name_bytes);
    caster_names.take(rest_caster);
    for (ShadowCaster& caster : casters)
        caster.name = caster_names.make(legal_group_name(caster.name));
}

std::string LayerSet::to_json() const {
    nlohmann::ordered_json j;
    j["lastBounce"] = last_bounce;
    j["bounces"] = bounce_layers;
    j["groups"] = group_layers;
    j["matrix"] = matrix_layers;
    j["shadow"] = shadow_layers;
    if (caster_layers) {
        j["casters"] = nlohmann::ordered_json::array();
        for (const ShadowCaster& c : casters)
            j["casters"].push_back({{"name", c.name}, {"prim", c.prim}});
    }
    if (has_clamp()) {
        // No number of JSON is infinite
        j["clampDirect"] = std::isfinite(clamp_direct) ? clamp_direct : -1.0f;
        j["clampIndirect"] = std::isfinite(clamp_indirect) ? clamp_indirect : -1.0f;
    }
    if (!path_layers.empty()) {
        j["strictPaths"] = has_strict_paths;
        j["paths"] = nlohmann::ordered_json::array();
        for (const PathLayer& p : path_layers) {
            j["paths"].push_back({{"name", p.name},
                                  {"lpe", p.expression},
                                  {"light", int(p.light)},
                                  {"family", p.family}});
            if (!p.lobe.empty()) j["paths"].back()["lobe"] = p.lobe;
        }
    }
    j["data"] = data_layers;
    for (const DataAlias& a : data_aliases)
        j["aliases"].push_back({{"name", a.name}, {"of", a.of}});
    for (const DataLayer& d : named_data) {
        j["namedData"].push_back({{"name", d.name},
                                  {"source", name_of(d.source)},
                                  {"primvar", d.primvar},
                                  {"filter", name_of(d.filter)},
                                  {"channels", d.suffixes},
                                  {"half", d.is_half},
                                  {"premultiplied", d.is_premultiplied}});
        if (!d.group.empty()) j["namedData"].back()["group"] = d.group;
    }
    j["halves"] = halves;
    j["float"] = float_layers;
    j["mattes"] = nlohmann::ordered_json::array();
    for (const MatteKind kind : matte_kinds) {
        if (has_mattes(kind)) j["mattes"].push_back(matte_word(kind));
    }
    j["matteLevels"] = matte_levels;
    j["lights"] = nlohmann::ordered_json::array();
    for (const LightGroup& group : groups) {
        nlohmann::ordered_json g;
        g["name"] = group.name;
        g["prims"] = group.prims;
        g["dome"] = group.is_dome;
        if (!group.label.empty()) g["label"] = group.label;
        j["lights"].push_back(std::move(g));
    }
    return j.dump();
}

Result<LayerSet> LayerSet::from_json(const std::string& text) {
    const auto j = nlohmann::json::parse(text, nullptr, false);
    const Error error{"layer-set-json", "the description of the layer set is damaged"};
    try {
        LayerSet set;
        set.last_bounce = whole_number<int>(j.at("lastBounce"));
        set.bounce_layers = j.at("bounces").get<bool>();
        set.group_layers = j.at("groups").get<bool>();
        set.matrix_layers = j.at("matrix").get<bool>();
        set.shadow_layers = j.at("shadow").get<bool>();
        if (j.contains("casters")) {
            set.caster_layers = true;
            for (const auto& c : j["casters"])
                set.casters.push_back(
                    {c.at("name").get<std::string>(), c.at("prim").get<std::string>()});
        }
        if (j.contains("paths")) {
            set.has_strict_paths = j.at("strictPaths").get<bool>();
            for (const auto& p : j["paths"]) {
                const int light = whole_number<int>(p.at("light"));
                if (light < 0 || light > int(PathLayer::Light::Shadow)) return error;
                set.path_layers.push_back({p.at("name").get<std::string>(),
                                           p.at("lpe").get<std::string>(), PathLayer::Light(light),
                                           p.at("family").get<std::string>(), p.value("lobe", "")});
            }
        }
        const auto limit = [&j](const char* name) {
            const float value = j.value(name, -1.0f);
            return value >= 0.0f ? value : std::numeric_limits<float>::infinity();
        };
        set.clamp_direct = limit("clampDirect");
        set.clamp_indirect = limit("clampIndirect");
        set.data_layers = j.at("data").get<bool>();
        if (j.contains("aliases"))
            for (const auto& a : j["aliases"])
                set.data_aliases.push_back(
                    {a.at("name").get<std::string>(), a.at("of").get<std::string>()});
        if (j.contains("namedData") && !parse_named_data(j["namedData"], set)) return error;
        set.halves = j.at("halves").get<bool>();
        set.float_layers = j.at("float").get<bool>();
        for (const auto& word : j.at("mattes")) {
            for (const MatteKind kind : matte_kinds) {
                if (word == matte_word(kind)) set.mattes[size_t(kind)] = true;
            }
        }
        set.matte_levels = whole_number<int>(j.at("matteLevels"));
        for (const auto& g : j.at("lights")) {
            set.groups.push_back({g.at("name").get<std::string>(),
                                  g.at("prims").get<std::vector<std::string>>(),
                                  g.at("dome").get<bool>(), g.value("label", "")});
        }
        if (set.last_bounce < 0 || set.last_bounce > 999 || set.groups.empty()) return error;
        if (set.matte_levels < 1 || set.matte_levels > 64) return error;
        // Every accumulator must have a number
        const uint64_t per_group = uint64_t(set.bounce_count()) * (1 + set.lobes().size()) +
                                   set.casters.size() + other_accumulators_per_group;
        if (set.groups.size() * per_group > max_accumulators) return error;
        return set;
    } catch (const nlohmann::json::exception&) {
        return error;
    } catch (const std::out_of_range&) {
        return error;
    }
}

AccumulatorTable::AccumulatorTable(const LayerSet& set)
    : groups_(uint32_t(set.groups.size())), count_(2), halves_(set.halves) {
    const auto columns = uint32_t(set.bounce_count());
    const auto take = [this](bool is_wanted, uint32_t& first, uint32_t how_many) {
        if (!is_wanted) return;
        first = count_;
        count_ += how_many;
    };
    take(set.data_layers, albedo_, 5);
    for (const DataLayer& d : set.named_data)
        take(true, named_data_.emplace_back(absent), d.accumulators());
    // With a matrix at hand its margins are sums of cells, and bounce 1 per group is one of the
    // columns of the plain one
    const bool has_lobes = set.has_lobe_matrix(), has_matrix = set.matrix_layers && !has_lobes;
    lobes_ = uint32_t(set.lobes().size());
    take(has_lobes, lobe_matrix_, columns * groups_ * lobes_);
    take(has_matrix, matrix_, columns * groups_);
    take(set.bounce_layers && !set.has_cells(), bounces_, columns);
    take(set.group_layers && !set.has_cells(), all_, groups_);
    take(set.shadow_layers && (!has_matrix || set.last_bounce < 1), direct_, groups_);
    take(set.shadow_layers, unoccluded_, groups_);
    casters_ = uint32_t(set.casters.size());
    take(set.shadow_layers && set.caster_layers, taken_, groups_ * casters_);
    take(!set.path_layers.empty(), paths_, uint32_t(set.path_layers.size()));
    take(!set.path_layers.empty() && set.wants_unoccluded(), unoccluded_paths_,
         uint32_t(set.path_layers.size()));
    // Numbers alone: what no clamp touches takes nothing
    take(set.has_clamp(), clamped_, count_);
}

}  // namespace velatura::accumulate
