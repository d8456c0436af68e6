// SPDX-License-Identifier: Apache-2.0
#include "compositor/look/row_names.h"

#include "base/nearest_names.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <set>
#include <utility>

namespace velatura::compositor {
inline namespace look {

namespace {

size_t index_of(const std::vector<std::string>& names, const std::string& name) {
    const auto at = std::find(names.begin(), names.end(), name);
    return at == names.end() ? 0 : size_t(at - names.begin());
}

/// `direct`, `indirect`, `tail`, `b0`, `b12` …
bool is_bounce_word(const std::string& name) {
    if (name == "direct" || name == "indirect" || name == "tail") return true;
    return name.size() > 1 && name[0] == 'b' &&
           name.find_first_not_of("0123456789", 1) == std::string::npos;
}

constexpr const char* emission = accumulate::emission_lobe;

bool is_lobe_word(const std::string& name) {
    constexpr std::array lobes = {emission,   "diffuse",    "specular", "coat",
                                  "transmit", "subsurface", "volume"};
    return std::find(lobes.begin(), lobes.end(), name) != lobes.end();
}

}  // namespace

RowNames::RowNames(const LayerStack& stack, const Look& look)
    : stack_(stack),
      sets_(look.rows),
      columns_(stack.column_names()),
      groups_(stack.group_names()),
      lobes_(stack.lobe_names()) {
    names_columns_ = !columns_.empty();
    names_groups_ = !groups_.empty();
    names_lobes_ = !lobes_.empty();
    for (auto* names : {&columns_, &groups_, &lobes_})
        if (names->empty()) names->emplace_back();
}

size_t RowNames::column_of(const std::string& name) const {
    return index_of(columns_, name);
}

size_t RowNames::direct_column() const {
    const auto b1 = std::find(columns_.begin(), columns_.end(), "b1");
    return b1 != columns_.end() ? size_t(b1 - columns_.begin()) : column_of("tail");
}

bool RowNames::has_column(const std::string& name) const {
    return names_columns_ && std::find(columns_.begin(), columns_.end(), name) != columns_.end();
}

size_t RowNames::group_of(const std::string& name) const {
    return index_of(groups_, name);
}

size_t RowNames::lobe_of(const std::string& name) const {
    return index_of(lobes_, name);
}

/// Emission seen directly has no lobe, and all that scattered has one.
bool RowNames::is_cell(size_t column, size_t lobe) const {
    return !names_lobes_ || (columns_[column] == "b0") == (lobes_[lobe] == emission);
}

std::vector<size_t> RowNames::cells_of(const accumulate::LayerEntry& entry) const {
    // From the first to before the last of each: one, or all where the layer tells them not apart
    const auto range = [](const std::string& name, size_t at, size_t count) {
        return name.empty() ? std::pair<size_t, size_t>(0, count)
                            : std::pair<size_t, size_t>(at, at + 1);
    };
    const auto columns = range(entry.bounce, column_of(entry.bounce), columns_.size());
    const auto groups = range(entry.group, group_of(entry.group), groups_.size());
    const auto lobes = range(entry.lobe, lobe_of(entry.lobe), lobes_.size());
    std::vector<size_t> cells;
    for (size_t c = columns.first; c < columns.second; ++c)
        for (size_t g = groups.first; g < groups.second; ++g)
            for (size_t l = lobes.first; l < lobes.second; ++l)
                if (is_cell(c, l)) cells.push_back(cell(c, g, l));
    return cells;
}

bool RowNames::select_columns(const std::string& name, std::vector<bool>& selected) const {
    selected.assign(columns_.size(), false);
    if (name == "all") {
        selected.assign(columns_.size(), true);
        return true;
    }
    bool is_known = false;
    for (size_t c = 0; c < columns_.size() && names_columns_; ++c) {
        const bool is_indirect = columns_[c] != "b0" && columns_[c] != "b1";
        // With K = 0 the tail holds the direct light as well, so neither word can be told apart
        const bool tells_direct = has_column("b1");
        selected[c] = columns_[c] == name || (name == "direct" && columns_[c] == "b1") ||
                      (name == "indirect" && is_indirect && tells_direct);
        is_known = is_known || selected[c];
    }
    return is_known;
}

bool RowNames::select_groups(const std::string& name, std::vector<bool>& selected) const {
    // A row that is called like a word is that row
    const bool is_row_name = is_row(name);
    const bool is_all = name == "all" && !is_row_name, is_env = name == "env" && !is_row_name;
    selected.assign(groups_.size(), is_all);
    bool is_known = is_all || is_env;
    for (size_t g = 0; g < groups_.size() && names_groups_; ++g) {
        if (groups_[g] == name || (is_env && stack_.header().lights[g].is_dome)) {
            selected[g] = true;
            is_known = true;
        }
    }
    return is_known;
}

bool RowNames::select_lobes(const std::string& name, std::vector<bool>& selected) const {
    selected.assign(lobes_.size(), false);
    const auto at = std::find(lobes_.begin(), lobes_.end(), name);
    if (!names_lobes_ || at == lobes_.end()) return false;
    selected[size_t(at - lobes_.begin())] = true;
    return true;
}

Error RowNames::unknown_name(const std::string& name) const {
    const auto no = [&](const char* why) {
        return Error{"unknown-name", fmt::format("no '{}' in this file: {}", name, why)};
    };
    const bool tells_direct = has_column("b1");
    if (is_bounce_word(name) && !names_columns_)
        return no("it has no bounce layers; render with --layers bounce or matrix");
    if (is_lobe_word(name) && !names_lobes_)
        return no("it has no layers by lobe; render with --layers lobe-matrix");
    if ((name == "direct" || name == "indirect") && !tells_direct)
        return no("`tail` contains all light after b0; render with --bounces 1 or more");
    std::vector<std::string> names = names_groups_ ? groups_ : std::vector<std::string>();
    if (names_columns_) names.insert(names.end(), columns_.begin(), columns_.end());
    if (names_lobes_) names.insert(names.end(), lobes_.begin(), lobes_.end());
    names.insert(names.end(), {"all", "env"});
    if (tells_direct) names.insert(names.end(), {"direct", "indirect"});
    if (stack_.has_family("shadow")) names.emplace_back("shadow");
    for (const auto& [set, rows] : sets_) names.push_back(set);
    return {"unknown-name", fmt::format("no '{}' in this file{}", name, did_you_mean(name, names))};
}

Error RowNames::unknown(const std::vector<Error>& errors) const {
    std::string text;
    for (const Error& e : errors) text += (text.empty() ? "" : "; ") + e.message;
    const auto list = [](const std::vector<std::string>& names, bool is_stored) {
        return is_stored ? fmt::format("{}", fmt::join(names, " ")) : std::string("not stored");
    };
    return {"unknown-name",
            fmt::format("{}; groups: {}; bounces: {}; lobes: {}; also: all, direct, indirect, "
                        "env, shadow, GROUP:BOUNCE{}",
                        text, list(groups_, names_groups_), list(columns_, names_columns_),
                        list(lobes_, names_lobes_), names_lobes_ ? ", GROUP:LOBE:BOUNCE" : "")};
}

bool RowNames::is_row(const std::string& name) const {
    return names_groups_ && std::find(groups_.begin(), groups_.end(), name) != groups_.end();
}

Selection RowNames::selection(const std::vector<bool>& columns,
                              const std::vector<bool>& groups,
                              const std::vector<bool>& lobes) const {
    Selection cells(cell_count());
    for (size_t c = 0; c < columns_.size(); ++c)
        for (size_t g = 0; g < groups_.size(); ++g)
            for (size_t l = 0; l < lobes_.size(); ++l)
                cells[cell(c, g, l)] = columns[c] && groups[g] && lobes[l];
    return cells;
}

/// A bounce or a lobe: what may stand after a colon.
bool RowNames::select_along(const std::string& name, Selection& selected) const {
    const std::vector<bool> all_groups(groups_.size(), true);
    std::vector<bool> columns, lobes;
    const std::vector<bool> all_lobes(lobes_.size(), true);
    if (select_columns(name, columns)) {
        selected = selection(columns, all_groups, all_lobes);
        return true;
    }
    if (!select_lobes(name, lobes)) return false;
    selected = selection(std::vector<bool>(columns_.size(), true), all_groups, lobes);
    return true;
}

bool RowNames::select_word(const std::string& name, Selection& selected) const {
    std::vector<bool> groups;
    if (!select_groups(name, groups)) return select_along(name, selected);
    selected = selection(std::vector<bool>(columns_.size(), true), groups,
                         std::vector<bool>(lobes_.size(), true));
    return true;
}

/// Whether it selects light that there is.
bool RowNames::holds_cell(const Selection& selected) const {
    for (size_t c = 0; c < columns_.size(); ++c)
        for (size_t g = 0; g < groups_.size(); ++g)
            for (size_t l = 0; l < lobes_.size(); ++l)
                if (is_cell(c, l) && selected[cell(c, g, l)]) return true;
    return false;
}

Result<Selection> RowNames::select_set(const std::vector<std::string>& rows) const {
    Selection cells(cell_count());
    for (const std::string& row : rows) {
        const auto one = select_named(row, false);
        if (!one) return one;
        for (size_t i = 0; i < cells.size(); ++i) cells[i] = cells[i] || (*one)[i];
    }
    return cells;
}

/// Names may hold colons themselves, so that the whole comes before what stands before the last.
Result<Selection> RowNames::select_named(const std::string& target, bool has_sets) const {
    const auto set = has_sets ? sets_.find(target) : sets_.end();
    if (set != sets_.end()) return select_set(set->second);
    Selection cells;
    if (select_word(target, cells)) return cells;
    const size_t colon = target.rfind(':');
    if (colon == std::string::npos) return unknown_name(target);
    const std::string before = target.substr(0, colon), word = target.substr(colon + 1);
    Selection along;
    // A bounce or lobe, even where a light is called like one
    const bool is_known = select_along(word, along) || select_word(word, along);
    auto row = select_named(before, has_sets);
    if (!row) return is_known ? row : unknown_name(target);
    if (!is_known) return unknown_name(word);
    for (size_t i = 0; i < along.size(); ++i) along[i] = along[i] && (*row)[i];
    if (!holds_cell(along))
        return Error{
            "unknown-name",
            fmt::format("'{}' is nothing: no light is both of {} and of {}", target, before, word)};
    return along;
}

Result<Selection> RowNames::select(const std::string& target) const {
    return select_named(target, true);
}

Result<std::vector<bool>> RowNames::groups(const std::string& name) const {
    const auto set = sets_.find(name);
    std::vector<bool> selected(groups_.size(), false);
    for (const std::string& row :
         set == sets_.end() ? std::vector<std::string>{name} : set->second) {
        std::vector<bool> one;
        if (!select_groups(row, one)) return unknown_name(row);
        for (size_t g = 0; g < one.size(); ++g) selected[g] = selected[g] || one[g];
    }
    return selected;
}

Result<std::vector<std::string>> RowNames::caster_layers(const std::string& target) const {
    const size_t colon = target.find(':');
    const std::string caster = target.substr(colon + 1);
    const auto selected = groups(target.substr(0, colon));
    if (!selected) return selected.error();
    std::vector<std::string> layers;
    std::set<std::string> casters;
    for (const accumulate::LayerEntry& entry : stack_.header().layers) {
        if (entry.family != "caster") continue;
        casters.insert(entry.caster);
        if (entry.caster == caster && (*selected)[group_of(entry.group)])
            layers.push_back(entry.name);
    }
    if (casters.empty())
        return Error{
            "mix-not-stored",
            "this mix needs shadows by caster, which are not stored; render with shadow and "
            "caster among --layers"};
    if (!layers.empty()) return layers;
    const std::vector<std::string> names(casters.begin(), casters.end());
    return Error{"unknown-name", fmt::format("no caster '{}' in this light{}, casters: {}", target,
                                             did_you_mean(caster, names), fmt::join(names, " "))};
}

}  // namespace look
}  // namespace velatura::compositor
