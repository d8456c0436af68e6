// SPDX-License-Identifier: Apache-2.0
#include "compositor/bake/bake.h"

#include "compositor/look/row_names.h"
#include "compositor/look/stack_color.h"
#include "compositor/mix/mix_plan.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

namespace velatura::compositor::bake {

namespace {

using Kind = Control::Kind;

/// How a control is typed, for messages.
std::string typed(const Control& control) {
    return fmt::format("--{} {}{}{}", name_of(control.kind), control.target,
                       control.value.empty() ? "" : "=", control.value);
}

/// Of a gain in stops, which goes to the exposure.
std::optional<double> stops_of(const Control& control) {
    if (control.kind != Kind::Gain) return std::nullopt;
    const bool are_stops =
        control.keys.empty() ? control.value.ends_with("st") : control.keys_are_stops;
    if (!are_stops) return std::nullopt;
    return std::log2(double(control.factor[0]));
}

/// What a look does to a whole group, or of that what a prim could take.
struct GroupGain {
    double intensity = 1;  ///< of gains typed as factors
    double stops = 0;
    std::array<double, 3> tint = {1, 1, 1};
    bool is_muted = false;

    bool operator==(const GroupGain&) const = default;

    bool changes() const { return *this != GroupGain(); }

    bool is_finite() const {
        return std::isfinite(intensity) && std::isfinite(stops) &&
               std::all_of(tint.begin(), tint.end(), [](double t) { return std::isfinite(t); });
    }
};

/// A row of a control's target, with the cells that it stands for.
struct RowCells {
    std::string name;
    Selection cells;
};

class Baker {
  public:
    Baker(const LayerStack& stack, const Look& look)
        : stack_(stack), look_(look), names_(stack, {}), gains_(stack.header().lights.size()) {}

    Result<Bake> run();

  private:
    std::vector<RowCells> rows_of(const std::string& target) const;
    std::vector<bool> whole_groups(const Selection& cells) const;
    bool has_more(const Selection& cells, const std::vector<bool>& whole) const;
    std::string why_not(const Control& control) const;
    std::vector<bool> select(const Control& control);
    void apply(const Control& control, const std::vector<bool>& groups);
    void apply_solos();
    Result<void> bake_group(const accumulate::LightGroup& group, const GroupGain& gain);
    Result<GroupGain> bake_prim(const std::string& path, const GroupGain& gain);
    void record(const std::string& group, const GroupGain& gain);

    /// Whether some layer of the group is not black.
    bool has_light(const std::string& group) const {
        bool is_lit = false;
        for (const accumulate::LayerEntry& entry : stack_.header().layers) {
            if (entry.group != group) continue;
            for (size_t c = 0; c < 3; ++c) {
                if (const image::Channel* channel = stack_.channel(entry.name, c))
                    image::for_each_value(*channel,
                                          [&](size_t, float v) { is_lit = is_lit || v != 0.0f; });
            }
        }
        return is_lit;
    }

    const layers::LightValues* values_of(const std::string& path) const {
        const auto& all = stack_.header().light_values;
        const auto at = std::find_if(all.begin(), all.end(),
                                     [&](const layers::LightValues& v) { return v.path == path; });
        return at == all.end() ? nullptr : &*at;
    }

    const LayerStack& stack_;
    const Look& look_;
    const RowNames names_;          ///< of the file, without the look's sets
    std::vector<GroupGain> gains_;  ///< per group
    image::ColorMatrix file_from_rec709_ = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    Bake out_;
};

/// Rows of a set one by one, so that each that cannot be baked is named; else the target itself.
std::vector<RowCells> Baker::rows_of(const std::string& target) const {
    const size_t colon = target.find(':');
    const std::string name = target.substr(0, colon);
    const std::string bounce = colon == std::string::npos ? "" : target.substr(colon);
    const auto set = look_.rows.find(name);
    std::vector<RowCells> rows;
    if (set == look_.rows.end()) {
        if (const auto cells = names_.select(target)) rows.push_back({target, *cells});
        return rows;
    }
    for (const std::string& row : set->second) {
        Look one;
        one.rows[name] = {row};
        const auto cells = RowNames(stack_, one).select(target);
        if (cells) rows.push_back({row + bounce, *cells});
    }
    return rows;
}

/// The groups of which all bounces and lobes are selected.
std::vector<bool> Baker::whole_groups(const Selection& cells) const {
    std::vector<bool> whole(gains_.size(), true);
    for (size_t i = 0; i < cells.size() && !gains_.empty(); ++i) {
        if (!cells[i]) whole[names_.group_of_cell(i)] = false;
    }
    return whole;
}

/// True if cells are selected beside those of whole groups.
bool Baker::has_more(const Selection& cells, const std::vector<bool>& whole) const {
    for (size_t i = 0; i < cells.size(); ++i) {
        if (cells[i] && (whole.empty() || !whole[names_.group_of_cell(i)])) return true;
    }
    return false;
}

std::string Baker::why_not(const Control& control) const {
    if (!control.matte.empty()) return "it is limited to a matte, which lights cannot be";
    if (control.kind == Kind::Clamp) return "a clamp is not a property of a light";
    if (control.kind > Kind::Solo || control.target == "shadow")
        return "shadows have no strength in UsdLux";
    return "lights have no gain per bounce or lobe";
}

/// The groups that a control takes as a whole; what else it names is told.
std::vector<bool> Baker::select(const Control& control) {
    std::vector<bool> selected(gains_.size(), false);
    const bool is_of_light =
        control.kind <= Kind::Solo && control.matte.empty() && control.target != "shadow";
    if (!is_of_light) {
        out_.left.push_back(fmt::format("{}: {}", typed(control), why_not(control)));
        return selected;
    }
    for (const RowCells& row : rows_of(control.target)) {
        const std::vector<bool> whole = whole_groups(row.cells);
        if (has_more(row.cells, whole)) {
            Control one = control;
            one.target = row.name;
            out_.left.push_back(fmt::format("{}: {}", typed(one), why_not(one)));
        }
        for (size_t g = 0; g < whole.size(); ++g) selected[g] = selected[g] || whole[g];
    }
    const bool is_any = std::find(selected.begin(), selected.end(), true) != selected.end();
    if (is_any && !control.keys.empty())
        out_.notes.push_back(
            fmt::format("{}: its value at this frame, for all frames", typed(control)));
    return selected;
}

void Baker::apply(const Control& control, const std::vector<bool>& groups) {
    const std::optional<double> stops = stops_of(control);
    const std::array<float, 3> factor = control.kind == Kind::Kelvin
                                            ? kelvin_tint(control.kelvin, file_from_rec709_)
                                            : control.factor;
    for (size_t g = 0; g < groups.size(); ++g) {
        if (!groups[g]) continue;
        GroupGain& gain = gains_[g];
        if (control.kind == Kind::Mute) {
            gain.is_muted = true;
        } else if (stops) {
            gain.stops += *stops;
        } else if (control.kind == Kind::Gain) {
            gain.intensity *= double(factor[0]);
        } else {
            for (size_t c = 0; c < 3; ++c) gain.tint[c] *= double(factor[c]);
        }
    }
}

/// Groups outside every solo are muted, whatever bounces the solos name.
void Baker::apply_solos() {
    std::vector<bool> heard(gains_.size(), false);
    bool has_solo = false;
    for (const Control& control : look_.controls) {
        if (control.kind != Kind::Solo || !control.matte.empty()) continue;
        has_solo = true;
        for (const RowCells& row : rows_of(control.target)) {
            for (size_t i = 0; i < row.cells.size() && !heard.empty(); ++i) {
                if (row.cells[i]) heard[names_.group_of_cell(i)] = true;
            }
        }
    }
    for (size_t g = 0; g < heard.size() && has_solo; ++g) {
        if (!heard[g]) gains_[g].is_muted = true;
    }
}

/// Returns: what of the gain the prim's inputs say now.
Result<GroupGain> Baker::bake_prim(const std::string& path, const GroupGain& gain) {
    const layers::LightValues& v = *values_of(path);
    const auto varies = [&](const char* name) {
        return std::find(v.varying.begin(), v.varying.end(), name) != v.varying.end();
    };
    BakedLight light;
    light.path = path;
    light.connected = v.connected;
    light.has_color_space = v.has_color_space;
    if (gain.is_muted) {
        light.intensity = 0;
        out_.lights.push_back(std::move(light));
        return gain;
    }
    double intensity = gain.intensity, stops = gain.stops;
    GroupGain taken = gain;
    if (varies("intensity") && intensity != 1) {
        // A gain of 0 has no stops, but then nothing of the animation shows
        if (intensity > 0) {
            stops += std::log2(intensity);
            intensity = 1;
        }
    } else if (varies("exposure") && stops != 0) {
        intensity *= std::exp2(stops);
        stops = 0;
    }
    if ((intensity > 0 && intensity != 1 && varies("intensity")) ||
        (stops != 0 && varies("exposure"))) {
        out_.left.push_back(
            fmt::format("gain of <{}>: its intensity and exposure both have time samples", path));
        intensity = taken.intensity = 1;
        stops = taken.stops = 0;
    }
    if (intensity != 1) light.intensity = v.intensity * intensity;
    if (stops != 0) light.exposure = v.exposure + stops;
    if (gain.tint != std::array<double, 3>{1, 1, 1}) {
        if (varies("color")) {
            out_.left.push_back(fmt::format("tint of <{}>: its color has time samples", path));
            taken.tint = {1, 1, 1};
        } else {
            light.color = v.color;
            for (size_t c = 0; c < 3; ++c) (*light.color)[c] *= gain.tint[c];
        }
    }
    // Inputs of lights are floats
    const auto is_float = [](double value) { return std::isfinite(float(value)); };
    const std::array<double, 3> color = light.color.value_or(std::array<double, 3>{});
    if (!is_float(light.intensity.value_or(0)) || !is_float(light.exposure.value_or(0)) ||
        !std::all_of(color.begin(), color.end(), is_float))
        return Error{"bad-gain",
                     fmt::format("<{}>: the preset exceeds the range of a USD float", path)};
    if (light.intensity || light.exposure || light.color) out_.lights.push_back(std::move(light));
    return taken;
}

/// What all prims of a group say now, as controls of the group.
void Baker::record(const std::string& group, const GroupGain& gain) {
    const auto add = [&](Kind kind, const std::array<double, 3>& factor, std::string value) {
        Control control;
        control.kind = kind;
        control.target = group;
        control.value = std::move(value);
        for (size_t c = 0; c < 3; ++c) control.factor[c] = float(factor[c]);
        out_.baked.controls.push_back(std::move(control));
    };
    if (gain.is_muted) return add(Kind::Mute, {1, 1, 1}, "");
    const double whole = gain.intensity * std::exp2(gain.stops);
    if (whole != 1) add(Kind::Gain, {whole, whole, whole}, fmt::format("{}", float(whole)));
    const auto& t = gain.tint;
    if (t != std::array<double, 3>{1, 1, 1})
        add(Kind::Tint, t, fmt::format("{},{},{}", float(t[0]), float(t[1]), float(t[2])));
}

Result<void> Baker::bake_group(const accumulate::LightGroup& group, const GroupGain& gain) {
    if (group.prims.empty()) {
        if (has_light(group.name))
            out_.left.push_back(
                fmt::format("{}: surfaces that emit have no light prim", group.name));
        return {};
    }
    std::vector<GroupGain> taken;  // per prim
    for (const std::string& path : group.prims) {
        taken.emplace_back();
        const layers::LightValues* v = values_of(path);
        if (!v) {
            out_.left.push_back(
                path.empty()
                    ? fmt::format("{}: the dome of a stage without lights has no prim", group.name)
                    : fmt::format("<{}>: the file does not name it", path));
        } else if (v->is_in_instance) {
            out_.left.push_back(
                fmt::format("<{}>: lies below an instance, where opinions are ignored", path));
        } else {
            const auto baked = bake_prim(path, gain);
            if (!baked) return baked.error();
            taken.back() = *baked;
            if (v->shows_material)
                out_.notes.push_back(
                    fmt::format("<{}>: the camera sees its material's emission, which the light's "
                                "values do not change",
                                path));
        }
    }
    const bool is_same =
        std::all_of(taken.begin(), taken.end(), [&](const GroupGain& t) { return t == taken[0]; });
    if (is_same) {
        record(group.name, taken[0]);
    } else {
        out_.partial.push_back(group.name);
    }
    return {};
}

Result<Bake> Baker::run() {
    // What mattes hold is of no interest: nothing within them can be baked
    if (const auto plan = mix::plan_gains(stack_, look_);
        !plan && (plan.error().code == "unknown-name" || plan.error().code == "bad-gain"))
        return plan.error();
    if (stack_.header().light_values.empty())
        return Error{"no-light-values",
                     "the file has no light values in velatura/lights; render it again"};
    // Without a usable OpenColorIO config nothing else is known
    if (const auto color = color_of_stack(stack_, look_)) {
        file_from_rec709_ = image::file_from_rec709(*color);
        if (color->known) out_.color_space = color->known->names[0];
    }
    for (const Control& control : look_.controls) {
        const std::vector<bool> groups = select(control);
        if (control.kind != Kind::Solo) apply(control, groups);
    }
    apply_solos();
    for (size_t g = 0; g < gains_.size(); ++g) {
        const accumulate::LightGroup& group = stack_.header().lights[g];
        gains_[g].stops += double(look_.exposure_stops);
        if (!gains_[g].is_muted && !gains_[g].is_finite())
            return Error{"bad-gain",
                         fmt::format("{}: its gains with an exposure of {} stops are not finite",
                                     group.name, look_.exposure_stops)};
        if (!gains_[g].changes()) continue;
        if (auto done = bake_group(group, gains_[g]); !done) return done.error();
    }
    return std::move(out_);
}

}  // namespace

Result<Bake> bake_look(const LayerStack& stack, const Look& look) {
    return Baker(stack, look).run();
}

}  // namespace velatura::compositor::bake
