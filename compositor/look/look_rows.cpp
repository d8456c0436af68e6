// SPDX-License-Identifier: Apache-2.0
#include "compositor/look/look_rows.h"

#include "base/check.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

namespace velatura::compositor {
inline namespace look {

namespace {

using Kind = Control::Kind;

constexpr float coldest = 1667, hottest = 25000;  // K, what a control takes

bool contains(const std::vector<std::string>& names, const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
}

/// The control that a row shows.
bool is_of_row(const Control& c, Kind kind, const RowTarget& target) {
    return c.kind == kind && c.target == target.name && c.matte == target.matte && c.keys.empty();
}

auto first_control(Look& look, Kind kind, const RowTarget& target) {
    return std::find_if(look.controls.begin(), look.controls.end(),
                        [&](const Control& c) { return is_of_row(c, kind, target); });
}

const Control* find_control(const Look& look, Kind kind, const RowTarget& target) {
    const auto at = std::find_if(look.controls.begin(), look.controls.end(),
                                 [&](const Control& c) { return is_of_row(c, kind, target); });
    return at == look.controls.end() ? nullptr : &*at;
}

void take_away(Look& look, Kind kind, const RowTarget& target) {
    const auto at = first_control(look, kind, target);
    if (at != look.controls.end()) look.controls.erase(at);
}

/// The control as if it had been typed, so that the window and a preset mean the same number.
void put(Look& look, Kind kind, const RowTarget& target, const std::string& value) {
    auto control = make_control(kind, target.name, value);
    VELATURA_CHECK(control.has_value(), "the mixer wrote an invalid control");
    control->matte = target.matte;
    const auto at = first_control(look, kind, target);
    if (at == look.controls.end()) {
        look.controls.push_back(std::move(*control));
    } else {
        *at = std::move(*control);
    }
}

void set_switch(Look& look, Kind kind, const RowTarget& target, bool is_on) {
    if (is_on) {
        put(look, kind, target, "");
    } else {
        take_away(look, kind, target);
    }
}

/// True if a layer of the family holds something.
bool has_light_of(const LayerStack& stack, const std::string& family, const std::string& group) {
    const auto& layers = stack.header().layers;
    return std::any_of(layers.begin(), layers.end(), [&](const accumulate::LayerEntry& e) {
        return e.family == family && !e.is_empty && (group.empty() || e.group == group);
    });
}

}  // namespace

bool MixerRows::has_place(Control::Kind kind, const std::string& target) const {
    if (kind == Kind::Shadow) return contains(shadows, target);
    if (kind == Kind::Caster) return contains(casters, target);
    if (kind == Kind::Clamp) return contains(clamps, target);
    if (contains(lights, target) || contains(bounces, target) || contains(lobes, target))
        return true;
    // GROUP:BOUNCE, GROUP:LOBE, LOBE:BOUNCE, GROUP:LOBE:BOUNCE
    const size_t colon = target.rfind(':');
    if (colon == std::string::npos) return false;
    const std::string before = target.substr(0, colon), last = target.substr(colon + 1);
    if (contains(groups, before)) return contains(columns, last) || contains(lobes, last);
    if (!contains(columns, last)) return false;
    const size_t second = before.rfind(':');
    const bool is_of_group =
        second == std::string::npos || contains(groups, before.substr(0, second));
    return is_of_group && contains(lobes, before.substr(second + 1));
}

MixerRows mixer_rows(const LayerStack& stack) {
    MixerRows rows;
    const std::vector<std::string> groups = stack.group_names(), columns = stack.column_names();
    const auto& lights = stack.header().lights;
    rows.lights.emplace_back("all");
    if (std::any_of(lights.begin(), lights.end(), [](const auto& l) { return l.is_dome; }))
        rows.lights.emplace_back("env");
    rows.lights.insert(rows.lights.end(), groups.begin(), groups.end());
    // With K = 0 the tail holds the direct light as well
    if (contains(columns, "b1")) rows.bounces = {"direct", "indirect"};
    rows.bounces.insert(rows.bounces.end(), columns.begin(), columns.end());
    rows.lobes = stack.lobe_names();
    if (stack.has_family("matrix") || stack.has_family("lobe-matrix")) {
        rows.groups = groups;
        rows.columns = columns;
    }
    for (const std::string& group : groups) {
        const accumulate::LayerEntry* entry = stack.header().find("S_" + group);
        if (entry && !entry->is_empty) rows.shadows.push_back(group);
        if (has_light_of(stack, "clamp", group)) rows.clamps.push_back(group);
    }
    if (has_light_of(stack, "clamp", "")) rows.clamps.insert(rows.clamps.begin(), "all");
    for (const accumulate::LayerEntry& entry : stack.header().layers) {
        if (entry.family == "caster" && !entry.is_empty)
            rows.casters.push_back(entry.group + ":" + entry.caster);
    }
    return rows;
}

std::string row_title(const std::string& target) {
    if (target == "all") return "all light";
    if (target == "env") return "env (domes)";
    return target;
}

RowState row_state(const Look& look, const RowTarget& target) {
    RowState row;
    row.is_muted = find_control(look, Kind::Mute, target) != nullptr;
    row.is_soloed = find_control(look, Kind::Solo, target) != nullptr;
    if (const Control* gain = find_control(look, Kind::Gain, target))
        row.stops = std::log2(gain->factor[0]);
    if (const Control* tint = find_control(look, Kind::Tint, target)) row.tint = tint->factor;
    if (const Control* kelvin = find_control(look, Kind::Kelvin, target))
        row.kelvin = std::stof(kelvin->value);
    return row;
}

void set_stops(Look& look, const RowTarget& target, float stops) {
    if (!std::isfinite(stops)) return;
    const float rounded = std::round(std::clamp(stops, -largest_stops, largest_stops) * 100) / 100;
    if (rounded == 0) {
        take_away(look, Kind::Gain, target);
    } else {
        put(look, Kind::Gain, target, fmt::format("{:+.2f}st", rounded));
    }
}

void set_muted(Look& look, const RowTarget& target, bool is_muted) {
    set_switch(look, Kind::Mute, target, is_muted);
}

void set_soloed(Look& look, const RowTarget& target, bool is_soloed) {
    set_switch(look, Kind::Solo, target, is_soloed);
}

void toggle_only_solo(Look& look, const RowTarget& target) {
    const auto count = std::count_if(look.controls.begin(), look.controls.end(),
                                     [](const Control& c) { return c.kind == Kind::Solo; });
    const bool was_only = count == 1 && find_control(look, Kind::Solo, target);
    std::erase_if(look.controls, [](const Control& c) { return c.kind == Kind::Solo; });
    if (!was_only) put(look, Kind::Solo, target, "");
}

void set_tint(Look& look, const RowTarget& target, const std::array<float, 3>& tint) {
    if (!std::all_of(tint.begin(), tint.end(), [](float t) { return std::isfinite(t); })) return;
    if (tint == std::array<float, 3>{1, 1, 1}) {
        take_away(look, Kind::Tint, target);
    } else {
        const auto kept = [](float t) { return std::clamp(t, 0.0f, largest_factor); };
        put(look, Kind::Tint, target,
            fmt::format("{:.3f},{:.3f},{:.3f}", kept(tint[0]), kept(tint[1]), kept(tint[2])));
    }
}

void set_kelvin(Look& look, const RowTarget& target, std::optional<float> kelvin) {
    if (kelvin && !std::isfinite(*kelvin)) return;
    if (kelvin) {
        const float rounded = std::clamp(std::round(*kelvin / 10) * 10, coldest, hottest);
        put(look, Kind::Kelvin, target, fmt::format("{:.0f}", rounded));
    } else {
        take_away(look, Kind::Kelvin, target);
    }
}

float share_given(const Look& look, Control::Kind kind, const RowTarget& target) {
    const Control* control = find_control(look, kind, target);
    return control ? control->factor[0] : 0.0f;
}

void set_share(Look& look, Control::Kind kind, const RowTarget& target, float share) {
    if (!std::isfinite(share)) return;
    const float rounded = std::round(std::clamp(share, 0.0f, 1.0f) * 100) / 100;
    if (rounded == 0) {
        take_away(look, kind, target);
    } else {
        put(look, kind, target, fmt::format("{:.2f}", rounded));
    }
}

void reset_row(Look& look, const RowTarget& target) {
    for (const Kind kind : {Kind::Gain, Kind::Tint, Kind::Kelvin, Kind::Mute, Kind::Solo})
        take_away(look, kind, target);
}

std::vector<size_t> advanced_controls(const Look& look,
                                      const MixerRows& rows,
                                      const std::string& matte) {
    std::vector<size_t> further;
    for (size_t i = 0; i < look.controls.size(); ++i) {
        const Control& c = look.controls[i];
        const bool is_shown = rows.has_place(c.kind, c.target) &&
                              (c.matte.empty() || c.matte == matte) &&
                              find_control(look, c.kind, {c.target, c.matte}) == &c;
        if (!is_shown) further.push_back(i);
    }
    return further;
}

std::string control_text(const Control& control) {
    std::string line = fmt::format("{} {}", name_of(control.kind), control.target);
    if (!control.value.empty()) line += " " + control.value;
    if (!control.matte.empty()) line += " within " + control.matte;
    return line;
}

bool same_look(const Look& a, const Look& b) {
    const auto same_control = [](const Control& c, const Control& d) {
        return c.kind == d.kind && c.target == d.target && c.value == d.value && c.matte == d.matte;
    };
    return a.exposure_stops == b.exposure_stops && a.display == b.display && a.view == b.view &&
           a.rows == b.rows &&
           std::equal(a.controls.begin(), a.controls.end(), b.controls.begin(), b.controls.end(),
                      same_control);
}

std::optional<float> stops_of_text(std::string_view text) {
    const auto strip_blanks = [&] {
        while (text.starts_with(' ')) text.remove_prefix(1);
        while (text.ends_with(' ')) text.remove_suffix(1);
    };
    strip_blanks();
    bool is_factor = false;
    for (const std::string_view sign : {"x", "X", "×"}) {
        if (text.starts_with(sign)) {
            text.remove_prefix(sign.size());
            is_factor = true;
        } else if (text.ends_with(sign)) {
            text.remove_suffix(sign.size());
            is_factor = true;
        }
    }
    if (!is_factor && text.ends_with("st")) text.remove_suffix(2);
    strip_blanks();
    if (text.starts_with('+')) text.remove_prefix(1);
    float value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value))
        return std::nullopt;
    if (!is_factor) return value;
    return value < 0 ? std::nullopt : std::optional(std::log2(value));
}

}  // namespace look
}  // namespace velatura::compositor
