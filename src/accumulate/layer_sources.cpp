// SPDX-License-Identifier: Apache-2.0
#include "accumulate/layer_sources.h"

#include "accumulate/names.h"

#include <fmt/format.h>

namespace velatura::accumulate {

namespace {

std::string group_lpe(const std::string& events, const LayerSet& set, int group) {
    const std::string& name = set.groups[size_t(group)].name;
    return fmt::format("{}<{}.'{}'>", events, name == emissive_group ? 'O' : 'L', name);
}

std::string column_events(const LayerSet& set, int column) {
    if (column == 0) return "C";
    if (column > set.last_bounce) return fmt::format("C.{{{},}}", column);
    return column == 1 ? "C." : fmt::format("C.{{{}}}", column);
}

/// What arrived of a group's direct light.
uint32_t direct(const AccumulatorTable& table, int g) {
    return table.direct(g) != AccumulatorTable::absent ? table.direct(g) : table.matrix(1, g);
}

}  // namespace

std::vector<LayerSource> matrix_sources(const LayerSet& set, const AccumulatorTable& table) {
    std::vector<LayerSource> list;
    for (int c = 0; c < set.bounce_count(); ++c) {
        for (int g = 0; g < set.group_count(); ++g) {
            LayerSource s;
            s.entry.bounce = set.column_name(c);
            s.entry.group = set.groups[size_t(g)].name;
            s.entry.name = s.entry.bounce + "_" + s.entry.group;
            s.entry.lpe = group_lpe(column_events(set, c), set, g);
            s.plus = {table.matrix(c, g)};
            s.can_be_omitted = true;
            s.is_clamped = set.has_clamp();
            list.push_back(std::move(s));
        }
    }
    return list;
}

std::vector<LayerSource> bounce_sources(const LayerSet& set, const AccumulatorTable& table) {
    std::vector<LayerSource> list;
    for (int c = 0; c < set.bounce_count(); ++c) {
        LayerSource s;
        s.entry.name = s.entry.bounce = set.column_name(c);
        s.entry.lpe = column_events(set, c) + "[LOB]";
        if (set.matrix_layers) {
            for (int g = 0; g < set.group_count(); ++g) s.plus.push_back(table.matrix(c, g));
        } else {
            s.plus = {table.bounce(c)};
        }
        s.is_clamped = set.has_clamp();
        list.push_back(std::move(s));
    }
    return list;
}

std::vector<LayerSource> group_sources(const LayerSet& set, const AccumulatorTable& table) {
    std::vector<LayerSource> list;
    for (int g = 0; g < set.group_count(); ++g) {
        LayerSource s;
        s.entry.group = set.groups[size_t(g)].name;
        s.entry.name = "C_" + s.entry.group;
        s.entry.lpe = group_lpe("C.*", set, g);
        if (set.matrix_layers) {
            for (int c = 0; c < set.bounce_count(); ++c) s.plus.push_back(table.matrix(c, g));
        } else {
            s.plus = {table.group(g)};
        }
        s.is_clamped = set.has_clamp();
        list.push_back(std::move(s));
    }
    return list;
}

std::vector<LayerSource> caster_sources(const LayerSet& set, const AccumulatorTable& table, int g) {
    std::vector<LayerSource> list;
    LayerSource rest;
    rest.plus = {table.unoccluded(g)};
    rest.minus = {direct(table, g)};
    rest.is_rest = true;
    for (uint32_t c = 0; c <= set.casters.size(); ++c) {
        const bool is_named = c < set.casters.size();
        LayerSource s = is_named ? LayerSource{} : rest;
        if (is_named) {
            s.plus = {table.taken(g, c)};
            rest.minus.push_back(table.taken(g, c));
        }
        s.entry.group = set.groups[size_t(g)].name;
        s.entry.caster = is_named ? set.casters[c].name : rest_caster;
        s.entry.bounce = "b1";
        s.entry.name = "S_" + s.entry.group + "_" + s.entry.caster;
        s.entry.lpe = group_lpe("shadow;C.", set, g);
        s.can_be_omitted = true;
        list.push_back(std::move(s));
    }
    return list;
}

std::vector<LayerSource> shadow_sources(const LayerSet& set,
                                        const AccumulatorTable& table,
                                        bool unoccluded) {
    std::vector<LayerSource> list;
    for (int g = 0; g < set.group_count(); ++g) {
        LayerSource s;
        s.entry.group = set.groups[size_t(g)].name;
        s.entry.bounce = "b1";
        s.entry.name = (unoccluded ? "U_" : "S_") + s.entry.group;
        s.entry.lpe = group_lpe(unoccluded ? "unoccluded;C." : "shadow;C.", set, g);
        s.plus = {table.unoccluded(g)};
        if (!unoccluded) s.minus = {direct(table, g)};
        s.can_be_omitted = true;
        list.push_back(std::move(s));
    }
    return list;
}

std::string lpe_of(const PathLayer& layer) {
    using Light = PathLayer::Light;
    const char* const prefix = layer.light == Light::Shadow       ? "shadow;"
                               : layer.light == Light::Unoccluded ? "unoccluded;"
                                                                  : "";
    return prefix + layer.expression;
}

std::vector<LayerSource> path_sources(const LayerSet& set,
                                      const AccumulatorTable& table,
                                      const std::string& family) {
    using Light = PathLayer::Light;
    std::vector<LayerSource> list;
    for (size_t i = 0; i < set.path_layers.size(); ++i) {
        const PathLayer& layer = set.path_layers[i];
        if (layer.family != family) continue;
        LayerSource s;
        s.entry.name = layer.name;
        s.entry.lpe = lpe_of(layer);
        s.plus = {layer.light == Light::Arriving ? table.path(i) : table.unoccluded_path(i)};
        if (layer.light == Light::Shadow) s.minus = {table.path(i)};
        s.is_clamped = layer.light == Light::Arriving && set.has_clamp();
        // What somebody asked for by name is there, black or not
        s.can_be_omitted = family == "lobes";
        list.push_back(std::move(s));
    }
    return list;
}

}  // namespace velatura::accumulate
