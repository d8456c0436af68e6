// SPDX-License-Identifier: Apache-2.0
#include "compositor/bake.h"

#include "compositor/mix.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

namespace velatura::compositor {

namespace {

using Kind = Control::Kind;

/// How a control is typed, for messages.
std::string typed(const Control& control) {
    return fmt::format("--{} {}{}{}", name_of(control.kind), control.target,
                       control.value.empty() ? "" : "=", control.value);
}

/// What a look does to a whole group.
struct GroupGain {
    double intensity = 1;  ///< of gains typed as factors
    double stops = 0;
    std::array<double, 3> tint = {1, 1, 1};
    bool is_muted = false;

    bool changes() const {
        return is_muted || intensity != 1 || stops != 0 || tint != std::array<double, 3>{1, 1, 1};
    }
};

class Baker {
  public:
    Baker(const LayerStack& stack, const Look& look)
        : stack_(stack), look_(look), gains_(stack.header().lights.size()) {}

    Result<Bake> run();

  private:
    std::vector<bool> groups_of(const std::string& name) const;
    std::vector<bool> whole_groups(const std::string& row) const;
    std::vector<std::string> rows_of(const std::string& target) const;
    std::string why_not(const Control& control) const;
    std::vector<bool> select(const Control& control);
    void apply(const Control& control, const std::vector<bool>& groups);
    void mute(size_t group);
    void apply_solos();
    void bake_group(const image::LightGroup& group, const GroupGain& gain);
    void bake_prim(const std::string& path, const GroupGain& gain);

    /// Whether some layer of the group is not black.
    bool has_light(const std::string& group) const {
        bool is_lit = false;
        for (const image::LayerEntry& entry : stack_.header().layers) {
            if (entry.group != group) continue;
            for (size_t c = 0; c < 3; ++c) {
                if (const image::Channel* channel = stack_.channel(entry.name, c))
                    image::for_each_value(*channel,
                                          [&](size_t, float v) { is_lit = is_lit || v != 0.0f; });
            }
        }
        return is_lit;
    }

    const image::LightValues* values_of(const std::string& path) const {
        const auto& all = stack_.header().light_values;
        const auto at = std::find_if(all.begin(), all.end(),
                                     [&](const image::LightValues& v) { return v.path == path; });
        return at == all.end() ? nullptr : &*at;
    }

    const LayerStack& stack_;
    const Look& look_;
    std::vector<GroupGain> gains_;  ///< per group
    Bake out_;
};

std::vector<bool> Baker::groups_of(const std::string& name) const {
    std::vector<bool> selected;
    for (const image::LightGroup& g : stack_.header().lights)
        selected.push_back(name == "all" || name == g.name || (name == "env" && g.is_dome));
    return selected;
}

/// The groups that a row takes as a whole; none where it picks bounces or shadows.
std::vector<bool> Baker::whole_groups(const std::string& row) const {
    const size_t colon = row.find(':');
    const bool is_whole = colon == std::string::npos || row.substr(colon + 1) == "all";
    return is_whole ? groups_of(row.substr(0, colon)) : std::vector<bool>(gains_.size(), false);
}

/// The rows of a named set, else the target itself.
std::vector<std::string> Baker::rows_of(const std::string& target) const {
    const auto at = look_.rows.find(target);
    return at == look_.rows.end() ? std::vector{target} : at->second;
}

std::string Baker::why_not(const Control& control) const {
    if (!control.matte.empty()) return "it acts within a matte, and light does not stop there";
    if (control.kind == Kind::Clamp) return "a clamp is no property of a light";
    if (control.kind > Kind::Solo || control.target == "shadow")
        return "shadows have no strength in UsdLux";
    return "lights have no gain per bounce";
}

/// The groups that a control takes as a whole; what else it names is told.
std::vector<bool> Baker::select(const Control& control) {
    std::vector<bool> selected(gains_.size(), false);
    const bool is_of_light = control.kind <= Kind::Solo && control.matte.empty();
    for (const std::string& row : rows_of(control.target)) {
        const std::vector<bool> groups =
            is_of_light ? whole_groups(row) : std::vector<bool>(gains_.size(), false);
        if (std::find(groups.begin(), groups.end(), true) == groups.end() && row != "env") {
            Control one = control;
            one.target = row;
            out_.left.push_back(fmt::format("{}: {}", typed(one), why_not(one)));
        }
        for (size_t g = 0; g < groups.size(); ++g) selected[g] = selected[g] || groups[g];
    }
    return selected;
}

void Baker::mute(size_t group) {
    gains_[group].is_muted = true;
    Control control;
    control.kind = Kind::Mute;
    control.target = stack_.header().lights[group].name;
    out_.baked.controls.push_back(std::move(control));
}

void Baker::apply(const Control& control, const std::vector<bool>& groups) {
    for (size_t g = 0; g < groups.size(); ++g) {
        if (!groups[g]) continue;
        GroupGain& gain = gains_[g];
        if (control.kind == Kind::Mute) {
            mute(g);
            continue;
        }
        if (control.kind == Kind::Gain && control.value.ends_with("st")) {
            gain.stops += std::log2(double(control.factor[0]));
        } else if (control.kind == Kind::Gain) {
            gain.intensity *= double(control.factor[0]);
        } else {
            for (size_t c = 0; c < 3; ++c) gain.tint[c] *= double(control.factor[c]);
        }
        out_.baked.controls.push_back(control);
        out_.baked.controls.back().target = stack_.header().lights[g].name;
    }
}

/// Groups outside every solo are muted, whatever bounces the solos name.
void Baker::apply_solos() {
    std::vector<bool> heard(gains_.size(), false);
    bool has_solo = false;
    for (const Control& control : look_.controls) {
        if (control.kind != Kind::Solo || !control.matte.empty()) continue;
        has_solo = true;
        for (const std::string& row : rows_of(control.target)) {
            const std::vector<bool> groups = groups_of(row.substr(0, row.find(':')));
            // A row of bounces is heard in every group
            const bool is_bounce =
                row != "env" && std::find(groups.begin(), groups.end(), true) == groups.end();
            for (size_t g = 0; g < heard.size(); ++g) heard[g] = heard[g] || groups[g] || is_bounce;
        }
    }
    for (size_t g = 0; g < heard.size() && has_solo; ++g) {
        if (!heard[g]) mute(g);
    }
}

void Baker::bake_prim(const std::string& path, const GroupGain& gain) {
    const image::LightValues& v = *values_of(path);
    const auto varies = [&](const char* name) {
        return std::find(v.varying.begin(), v.varying.end(), name) != v.varying.end();
    };
    BakedLight light;
    light.path = path;
    if (gain.is_muted) {
        light.intensity = 0;
        out_.lights.push_back(std::move(light));
        return;
    }
    double intensity = gain.intensity, stops = gain.stops;
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
        intensity = 1;
        stops = 0;
    }
    if (intensity != 1) light.intensity = v.intensity * intensity;
    if (stops != 0) light.exposure = v.exposure + stops;
    if (gain.tint != std::array<double, 3>{1, 1, 1}) {
        if (varies("color")) {
            out_.left.push_back(fmt::format("tint of <{}>: its colour has time samples", path));
        } else {
            light.color = v.color;
            for (size_t c = 0; c < 3; ++c) (*light.color)[c] *= gain.tint[c];
        }
    }
    if (light.intensity || light.exposure || light.color) out_.lights.push_back(std::move(light));
}

void Baker::bake_group(const image::LightGroup& group, const GroupGain& gain) {
    if (group.prims.empty()) {
        if (has_light(group.name))
            out_.left.push_back(
                fmt::format("{}: surfaces that emit have no light prim", group.name));
        return;
    }
    for (const std::string& path : group.prims) {
        const image::LightValues* v = values_of(path);
        if (!v) {
            out_.left.push_back(
                path.empty()
                    ? fmt::format("{}: the dome of a stage without lights has no prim", group.name)
                    : fmt::format("<{}>: the file does not say what it was", path));
        } else if (v->is_in_instance) {
            out_.left.push_back(
                fmt::format("<{}>: lies below an instance, where opinions do not reach", path));
        } else {
            bake_prim(path, gain);
            if (v->shows_material)
                out_.notes.push_back(
                    fmt::format("<{}>: the camera sees its material's emission, which the light's "
                                "values do not change",
                                path));
        }
    }
}

Result<Bake> Baker::run() {
    if (const auto plan = plan_mix(stack_, look_); !plan && plan.error().code == "unknown-name")
        return plan.error();
    if (stack_.header().light_values.empty())
        return Error{"no-light-values",
                     "the file does not say what its lights were: it has no values in "
                     "velatura/lights (render it again)"};
    for (const Control& control : look_.controls) {
        const std::vector<bool> groups = select(control);
        if (control.kind != Kind::Solo) apply(control, groups);
    }
    apply_solos();
    out_.baked.exposure_stops = look_.exposure_stops;
    for (size_t g = 0; g < gains_.size(); ++g) {
        gains_[g].stops += double(look_.exposure_stops);
        if (gains_[g].changes()) bake_group(stack_.header().lights[g], gains_[g]);
    }
    return std::move(out_);
}

}  // namespace

Result<Bake> bake_look(const LayerStack& stack, const Look& look) {
    return Baker(stack, look).run();
}

}  // namespace velatura::compositor
