// SPDX-License-Identifier: Apache-2.0
#include "compositor/look/row_names.h"

#include "base/nearest_names.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>

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

}  // namespace

RowNames::RowNames(const LayerStack& stack, const Look& look)
    : stack_(stack),
      sets_(look.rows),
      columns_(stack.column_names()),
      groups_(stack.group_names()) {
    names_columns_ = !columns_.empty();
    names_groups_ = !groups_.empty();
    if (columns_.empty()) columns_.emplace_back();
    if (groups_.empty()) groups_.emplace_back();
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

Error RowNames::unknown_name(const std::string& name) const {
    const auto no = [&](const char* why) {
        return Error{"unknown-name", fmt::format("no '{}' in this file: {}", name, why)};
    };
    const bool tells_direct = has_column("b1");
    if (is_bounce_word(name) && !names_columns_)
        return no("it has no bounce layers; render with --layers bounce or matrix");
    if ((name == "direct" || name == "indirect") && !tells_direct)
        return no("`tail` contains all light after b0; render with --bounces 1 or more");
    std::vector<std::string> names = names_groups_ ? groups_ : std::vector<std::string>();
    if (names_columns_) names.insert(names.end(), columns_.begin(), columns_.end());
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
            fmt::format("{}; groups: {}; bounces: {}; also: all, direct, indirect, env, shadow, "
                        "GROUP:BOUNCE",
                        text, list(groups_, names_groups_), list(columns_, names_columns_))};
}

bool RowNames::is_row(const std::string& name) const {
    return names_groups_ && std::find(groups_.begin(), groups_.end(), name) != groups_.end();
}

Selection RowNames::cells_of(const std::vector<bool>& columns,
                             const std::vector<bool>& groups) const {
    Selection cells(columns_.size() * groups_.size());
    for (size_t c = 0; c < columns_.size(); ++c) {
        for (size_t g = 0; g < groups_.size(); ++g)
            cells[c * groups_.size() + g] = columns[c] && groups[g];
    }
    return cells;
}

Result<Selection> RowNames::select_of_file(const std::string& target) const {
    std::vector<bool> columns(columns_.size(), true), groups(groups_.size(), true);
    if (select_groups(target, groups)) return cells_of(columns, groups);
    groups.assign(groups_.size(), true);
    if (select_columns(target, columns)) return cells_of(columns, groups);
    // GROUP:BOUNCE, of which the group may hold colons
    const size_t colon = target.rfind(':');
    if (colon == std::string::npos) return unknown_name(target);
    const std::string group = target.substr(0, colon), bounce = target.substr(colon + 1);
    if (!select_groups(group, groups))
        return unknown_name(select_columns(bounce, columns) ? group : target);
    if (!select_columns(bounce, columns)) return unknown_name(bounce);
    return cells_of(columns, groups);
}

Result<Selection> RowNames::select_set(const std::vector<std::string>& rows,
                                       const std::string& bounce) const {
    Selection cells(columns_.size() * groups_.size());
    for (const std::string& row : rows) {
        const auto one = select_of_file(row);
        if (!one) return one;
        for (size_t i = 0; i < cells.size(); ++i) cells[i] = cells[i] || (*one)[i];
    }
    std::vector<bool> columns(columns_.size(), true);
    if (!bounce.empty() && !select_columns(bounce, columns)) return unknown_name(bounce);
    for (size_t i = 0; i < cells.size(); ++i) cells[i] = cells[i] && columns[i / groups_.size()];
    return cells;
}

Result<Selection> RowNames::select(const std::string& target) const {
    const auto whole = sets_.find(target);
    if (whole != sets_.end()) return select_set(whole->second, "");
    const size_t colon = target.rfind(':');
    const auto set = colon == std::string::npos ? sets_.end() : sets_.find(target.substr(0, colon));
    if (set == sets_.end() || is_row(target)) return select_of_file(target);
    return select_set(set->second, target.substr(colon + 1));
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
        return Error{"mix-not-stored",
                     "this mix needs shadows by caster, which are not stored; render with --layers "
                     "shadow,caster"};
    if (!layers.empty()) return layers;
    const std::vector<std::string> names(casters.begin(), casters.end());
    return Error{"unknown-name", fmt::format("no caster '{}' in this light{}, casters: {}", target,
                                             did_you_mean(caster, names), fmt::join(names, " "))};
}

}  // namespace look
}  // namespace velatura::compositor
