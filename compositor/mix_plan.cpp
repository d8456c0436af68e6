// SPDX-License-Identifier: Apache-2.0
#include "compositor/mix.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

namespace velatura::compositor {

namespace {

using Gain = std::array<float, 3>;
constexpr Gain unit = {1, 1, 1};

void multiply(Gain& a, const Gain& b) {
    for (size_t c = 0; c < 3; ++c) a[c] *= b[c];
}

/// The cells a name stands for.
struct Selection {
    std::vector<bool> columns, groups;

    bool has(size_t column, size_t group) const { return columns[column] && groups[group]; }
};

class Planner {
  public:
    Planner(const LayerStack& stack, const Look& look)
        : stack_(stack), look_(look), columns_(stack.column_names()), groups_(stack.group_names()) {
        // A file without bounces still has one column for everything, and one without groups one
        // row
        names_columns_ = !columns_.empty();
        if (columns_.empty()) columns_.emplace_back("");
        gains_.assign(columns_.size(), std::vector<Gain>(groups_.size(), unit));
        lifts_.assign(groups_.size(), 0.0f);
    }

    Result<MixPlan> run();

  private:
    bool select_columns(const std::string& name, std::vector<bool>& selected) const;
    bool select_groups(const std::string& name, std::vector<bool>& selected) const;
    Result<Selection> select(const std::string& target) const;
    Result<void> apply_controls();
    Result<void> apply_shadow(const Control& control);
    Error unknown(const std::string& name) const;
    Error not_stored() const;
    bool is_uniform_along(bool groups) const;
    Result<MixPlan> choose_family() const;
    Result<void> add_shadows(MixPlan& plan) const;
    Gain cell(const image::LayerEntry& entry) const;

    size_t column_of(const std::string& name) const {
        const auto at = std::find(columns_.begin(), columns_.end(), name);
        return at == columns_.end() ? 0 : size_t(at - columns_.begin());
    }

    size_t group_of(const std::string& name) const {
        const auto at = std::find(groups_.begin(), groups_.end(), name);
        return at == groups_.end() ? 0 : size_t(at - groups_.begin());
    }

    const LayerStack& stack_;
    const Look& look_;
    std::vector<std::string> columns_, groups_;
    bool names_columns_ = false;
    std::vector<std::vector<Gain>> gains_;  ///< per column and group
    std::vector<float> lifts_;              ///< per group
};

bool Planner::select_columns(const std::string& name, std::vector<bool>& selected) const {
    selected.assign(columns_.size(), false);
    if (name == "all") {
        selected.assign(columns_.size(), true);
        return true;
    }
    bool is_known = false;
    for (size_t c = 0; c < columns_.size() && names_columns_; ++c) {
        const bool is_indirect = columns_[c] != "b0" && columns_[c] != "b1";
        // With K = 0 the tail holds the direct light as well, so neither word can be told apart
        const bool tells_direct =
            std::find(columns_.begin(), columns_.end(), "b1") != columns_.end();
        selected[c] = columns_[c] == name || (name == "direct" && columns_[c] == "b1") ||
                      (name == "indirect" && is_indirect && tells_direct);
        is_known = is_known || selected[c];
    }
    return is_known;
}

bool Planner::select_groups(const std::string& name, std::vector<bool>& selected) const {
    selected.assign(groups_.size(), name == "all");
    bool is_known = name == "all" || name == "env";
    for (size_t g = 0; g < groups_.size(); ++g) {
        if (groups_[g] == name || (name == "env" && stack_.header().lights[g].is_dome)) {
            selected[g] = true;
            is_known = true;
        }
    }
    return is_known;
}

Error Planner::unknown(const std::string& name) const {
    return {"unknown-name", fmt::format("no '{}' in this file; groups: {}; bounces: {}; also: all, "
                                        "direct, indirect, env, shadow, "
                                        "GROUP:BOUNCE",
                                        name, fmt::join(groups_, " "),
                                        names_columns_ ? fmt::format("{}", fmt::join(columns_, " "))
                                                       : "not stored")};
}

Result<Selection> Planner::select(const std::string& target) const {
    Selection s;
    const size_t colon = target.find(':');
    if (colon != std::string::npos) {
        if (!select_groups(target.substr(0, colon), s.groups))
            return unknown(target.substr(0, colon));
        if (!select_columns(target.substr(colon + 1), s.columns))
            return unknown(target.substr(colon + 1));
        return s;
    }
    if (select_groups(target, s.groups)) {
        s.columns.assign(columns_.size(), true);
        return s;
    }
    s.groups.assign(groups_.size(), true);
    if (!select_columns(target, s.columns)) return unknown(target);
    return s;
}

Result<void> Planner::apply_shadow(const Control& control) {
    std::vector<bool> groups;
    const bool is_strength = control.kind != Control::Kind::Shadow;
    const std::string name = is_strength ? "all" : control.target;
    if (!select_groups(name, groups)) return unknown(name);
    for (size_t g = 0; g < groups.size(); ++g) {
        if (!groups[g]) continue;
        // A gain on `shadow` is the strength that is left: 1 as rendered, 0 no shadow
        const float lift = control.kind == Control::Kind::Gain   ? 1.0f - control.factor[0]
                           : control.kind == Control::Kind::Mute ? 1.0f
                                                                 : control.factor[0];
        lifts_[g] += lift;
    }
    return {};
}

Result<void> Planner::apply_controls() {
    std::vector<Selection> solos;
    for (const Control& control : look_.controls) {
        const bool is_shadow = control.kind == Control::Kind::Shadow || control.target == "shadow";
        if (is_shadow) {
            if (control.kind == Control::Kind::Tint || control.kind == Control::Kind::Kelvin ||
                control.kind == Control::Kind::Solo) {
                return Error{"unknown-name", "shadow takes --shadow, --gain and --mute only"};
            }
            if (auto done = apply_shadow(control); !done) return done;
            continue;
        }
        const auto selected = select(control.target);
        if (!selected) return selected.error();
        if (control.kind == Control::Kind::Solo) {
            solos.push_back(*selected);
            continue;
        }
        const Gain factor = control.kind == Control::Kind::Mute ? Gain{0, 0, 0} : control.factor;
        for (size_t c = 0; c < columns_.size(); ++c) {
            for (size_t g = 0; g < groups_.size(); ++g) {
                if (selected->has(c, g)) multiply(gains_[c][g], factor);
            }
        }
    }
    if (solos.empty()) return {};
    for (size_t c = 0; c < columns_.size(); ++c) {
        for (size_t g = 0; g < groups_.size(); ++g) {
            const bool is_heard = std::any_of(solos.begin(), solos.end(),
                                              [&](const Selection& s) { return s.has(c, g); });
            if (!is_heard) gains_[c][g] = {0, 0, 0};
        }
    }
    return {};
}

/// True if the gains are the same for all groups (or, for `groups` false, for all columns).
bool Planner::is_uniform_along(bool groups) const {
    for (size_t c = 0; c < columns_.size(); ++c) {
        for (size_t g = 0; g < groups_.size(); ++g) {
            if (gains_[c][g] != (groups ? gains_[c][0] : gains_[0][g])) return false;
        }
    }
    return true;
}

Error Planner::not_stored() const {
    const bool needs_groups = !is_uniform_along(true), needs_bounces = !is_uniform_along(false);
    const std::string what = needs_groups && needs_bounces ? "gains per bounce and per group"
                             : needs_groups                ? "gains per group"
                                                           : "gains per bounce";
    const std::string layers = needs_groups && needs_bounces ? "--layers matrix"
                               : needs_groups                ? "--layers light or --layers matrix"
                                                             : "--layers bounce or --layers matrix";
    return {"mix-not-stored",
            fmt::format("this mix needs {}, which the stored layers cannot express; render with {}",
                        what, layers)};
}

Gain Planner::cell(const image::LayerEntry& entry) const {
    return gains_[column_of(entry.bounce)][group_of(entry.group)];
}

Result<MixPlan> Planner::choose_family() const {
    MixPlan plan;
    for (const image::FamilyClosure& family : stack_.header().closure) {
        const bool can_express = family.family == "matrix" ||
                                 (family.family == "bounces" && is_uniform_along(true)) ||
                                 (family.family == "groups" && is_uniform_along(false));
        if (!can_express) continue;
        plan.family = family.family;
        for (const std::string& layer : family.order) {
            const image::LayerEntry* entry = stack_.header().find(layer);
            if (!entry)
                return Error{"layers-damaged",
                             fmt::format("layer {} is not in velatura/layers", layer)};
            plan.terms.push_back({layer, cell(*entry)});
        }
        return plan;
    }
    if (!is_uniform_along(true) || !is_uniform_along(false)) return not_stored();
    plan.family = "beauty";
    plan.terms.push_back({"rgba", gains_[0].empty() ? unit : gains_[0][0]});
    return plan;
}

Result<void> Planner::add_shadows(MixPlan& plan) const {
    // A lifted shadow shows the light's direct light, so it takes the gain of that cell
    const size_t direct = names_columns_ ? column_of("b1") : 0;
    for (size_t g = 0; g < groups_.size(); ++g) {
        if (lifts_[g] == 0.0f) continue;
        const std::string layer = "S_" + groups_[g];
        const image::LayerEntry* entry = stack_.header().find(layer);
        if (!entry) {
            return Error{
                "mix-not-stored",
                fmt::format(
                    "this mix needs the shadow layer {}, which is not stored; render with --layers "
                    "shadow",
                    layer)};
        }
        if (entry->is_empty) continue;
        Gain gain = gains_[direct][g];
        multiply(gain, {lifts_[g], lifts_[g], lifts_[g]});
        plan.shadow_terms.push_back({layer, gain});
    }
    return {};
}

Result<MixPlan> Planner::run() {
    if (auto done = apply_controls(); !done) return done.error();
    auto plan = choose_family();
    if (!plan) return plan;
    if (auto done = add_shadows(*plan); !done) return done.error();
    return plan;
}

}  // namespace

Result<MixPlan> plan_mix(const LayerStack& stack, const Look& look) {
    return Planner(stack, look).run();
}

}  // namespace velatura::compositor
