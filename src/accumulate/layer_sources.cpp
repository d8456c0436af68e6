// SPDX-License-Identifier: Apache-2.0
#include "accumulate/layer_sources.h"

#include "accumulate/names.h"

#include <fmt/format.h>

#include <cstring>
#include <iterator>
#include <utility>

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

/// The events up to the first scattering of an expression that ends in any others and any light.
std::string first_events(const std::string& expression) {
    std::string events = expression;
    for (const char* end : {"[LOB]", ".*"})
        if (events.ends_with(end)) events.resize(events.size() - std::strlen(end));
    return events;
}

std::string lobe_events(const LayerSet& set, const PathLayer& lobe, int column) {
    const std::string first = first_events(lobe.expression);
    if (column > set.last_bounce && column > 1)
        return fmt::format("{}.{{{},}}", first, set.last_bounce);
    if (column > set.last_bounce) return first + ".*";
    return column <= 1 ? first : fmt::format("{}.{{{}}}", first, column - 1);
}

bool has_lobe(int column, const PathLayer& lobe) {
    return (column == 0) == (lobe.lobe == emission_lobe);
}

/// What a column of a group is the sum of.
std::vector<uint32_t> cells(const LayerSet& set, const AccumulatorTable& table, int column, int g) {
    if (!set.has_lobe_matrix()) return {table.matrix(column, g)};
    const std::vector<size_t> lobes = set.lobes();
    std::vector<uint32_t> list;
    for (size_t l = 0; l < lobes.size(); ++l)
        if (has_lobe(column, set.path_layers[lobes[l]]))
            list.push_back(table.lobe_matrix(column, g, l));
    return list;
}

void add_cells(const LayerSet& set,
               const AccumulatorTable& table,
               int column,
               int g,
               std::vector<uint32_t>& to) {
    const std::vector<uint32_t> more = cells(set, table, column, g);
    to.insert(to.end(), more.begin(), more.end());
}

/// What arrived of a group's direct light.
uint32_t direct(const AccumulatorTable& table, int g) {
    return table.direct(g) != AccumulatorTable::absent ? table.direct(g) : table.matrix(1, g);
}

}  // namespace

std::vector<LayerSource> lobe_matrix_sources(const LayerSet& set, const AccumulatorTable& table) {
    const std::vector<size_t> lobes = set.lobes();
    std::vector<LayerSource> list;
    for (int c = 0; c < set.bounce_count(); ++c) {
        for (int g = 0; g < set.group_count(); ++g) {
            for (size_t l = 0; l < lobes.size(); ++l) {
                const PathLayer& lobe = set.path_layers[lobes[l]];
                if (!has_lobe(c, lobe)) continue;
                LayerSource s;
                s.entry.bounce = set.column_name(c);
                s.entry.group = set.groups[size_t(g)].name;
                s.entry.lobe = lobe.lobe;
                s.entry.name = fmt::format("{}_{}_{}", s.entry.bounce, s.entry.group, s.entry.lobe);
                s.entry.lpe = group_lpe(lobe_events(set, lobe, c), set, g);
                s.plus = {table.lobe_matrix(c, g, l)};
                s.can_be_omitted = true;
                s.is_clamped = set.has_clamp();
                list.push_back(std::move(s));
            }
        }
    }
    return list;
}

std::vector<LayerSource> matrix_sources(const LayerSet& set, const AccumulatorTable& table) {
    std::vector<LayerSource> list;
    for (int c = 0; c < set.bounce_count(); ++c) {
        for (int g = 0; g < set.group_count(); ++g) {
            LayerSource s;
            s.entry.bounce = set.column_name(c);
            s.entry.group = set.groups[size_t(g)].name;
            s.entry.name = s.entry.bounce + "_" + s.entry.group;
            s.entry.lpe = group_lpe(column_events(set, c), set, g);
            s.plus = cells(set, table, c, g);
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
        if (set.has_cells()) {
            for (int g = 0; g < set.group_count(); ++g) add_cells(set, table, c, g, s.plus);
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
        if (set.has_cells()) {
            for (int c = 0; c < set.bounce_count(); ++c) add_cells(set, table, c, g, s.plus);
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

std::vector<LayerSource> light_sources(const LayerSet& set, const AccumulatorTable& table) {
    std::vector<LayerSource> all;
    const auto add = [&all](bool is_stored, std::vector<LayerSource> more) {
        if (is_stored)
            all.insert(all.end(), std::make_move_iterator(more.begin()),
                       std::make_move_iterator(more.end()));
    };
    add(set.has_lobe_matrix(), lobe_matrix_sources(set, table));
    add(set.matrix_layers, matrix_sources(set, table));
    add(set.bounce_layers, bounce_sources(set, table));
    add(set.group_layers, group_sources(set, table));
    add(set.shadow_layers, shadow_sources(set, table, true));
    add(set.shadow_layers, shadow_sources(set, table, false));
    add(true, path_sources(set, table, "lobes"));
    add(true, path_sources(set, table, "paths"));
    return all;
}

}  // namespace velatura::accumulate
