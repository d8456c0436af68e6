// SPDX-License-Identifier: Apache-2.0
#include "compositor/mix/layer_outcomes.h"

#include "image/digest.h"

#include <fmt/format.h>

#include <algorithm>

namespace velatura::compositor::mix {

namespace {

using accumulate::LayerEntry;

/// What the gains of a mix have in common.
struct Gains {
    bool is_uniform = false;  ///< the same for all light
    bool is_gray = false;     ///< and for all channels
    bool is_unit = false;
};

Gains gains_of(const MixPlan& plan, float exposure) {
    Gains gains;
    if (!plan.common_gain) return gains;
    const auto& g = *plan.common_gain;
    gains.is_uniform = true;
    gains.is_gray = g[0] == g[1] && g[1] == g[2];
    gains.is_unit = gains.is_gray && g[0] == 1.0f && exposure == 1.0f;
    return gains;
}

LayerOutcome outcome_of(const LayerStack& layout,
                        const MixPlan& plan,
                        const Gains& gains,
                        const LayerEntry& e) {
    if (e.name == "rgba") return LayerOutcome::Beauty;
    if (e.family == "cryptomatte") return LayerOutcome::Same;
    if (e.family == "data") {
        if (e.name != "variance" || gains.is_unit) return LayerOutcome::Same;
        const bool has_halves = layout.header().find("beauty_hA") != nullptr;
        return gains.is_gray || has_halves ? LayerOutcome::Variance : LayerOutcome::NotStored;
    }
    if (e.family == plan.family) return LayerOutcome::Graded;
    // Where lobes of the direct light have gains of their own, what does not tell them apart has
    // none
    const bool has_gain = std::any_of(plan.beside.begin(), plan.beside.end(),
                                      [&](const MixPlan::Term& t) { return t.layer == e.name; });
    if (e.family == "shadow" || e.family == "caster")
        return has_gain ? LayerOutcome::Shadow : LayerOutcome::NotStored;
    if (e.family == "unoccluded") return has_gain ? LayerOutcome::Beside : LayerOutcome::NotStored;
    if (gains.is_unit) return LayerOutcome::Same;
    if (e.family == "clamp") {
        const LayerEntry* of = layout.header().find(e.of);
        return of && of->family == plan.family ? LayerOutcome::Clamp : LayerOutcome::NotStored;
    }
    const bool is_margin = e.family == "bounces" || e.family == "groups";
    if (is_margin && plan.family == "matrix") return LayerOutcome::Sum;
    if ((is_margin || e.family == "matrix") && plan.family == "lobe-matrix")
        return LayerOutcome::Sum;
    // What adds up to the beauty was rounded on its own, and would no longer do so
    return gains.is_uniform && !e.in_sum ? LayerOutcome::Uniform : LayerOutcome::NotStored;
}

/// Light of a file of ours that has lost channels: nothing can be made of it.
bool is_incomplete(const LayerStack& layout, const LayerEntry& e) {
    if (e.is_empty || e.name == "rgba" || e.family == "data" || e.family == "cryptomatte")
        return false;
    for (size_t c = 0; c < 3; ++c)
        if (!layout.place(e.name, c)) return true;
    return false;
}

/// What does not hold where channels are missing: these layers, their half images, half images that
/// are sums of those, casters whose sum is a shadow.
void drop_incomplete(const LayerStack& layout,
                     const Gains& gains,
                     std::map<std::string, LayerOutcome>& outcomes) {
    bool has_broken_halves = false;
    for (const LayerEntry& e : layout.header().layers) {
        if (!is_incomplete(layout, e)) continue;
        outcomes[e.name] = LayerOutcome::NotStored;
        has_broken_halves = has_broken_halves || e.family == "halves";
        for (const LayerEntry& other : layout.header().layers) {
            const bool is_beside =
                e.family == "caster" && other.family == "caster" && other.group == e.group;
            if (is_beside) outcomes[other.name] = LayerOutcome::NotStored;
        }
    }
    for (const LayerEntry& e : layout.header().layers) {
        if (e.family != "halves") continue;
        const auto of = outcomes.find(e.of);
        const bool is_gone = of == outcomes.end() || of->second == LayerOutcome::NotStored;
        if (is_gone || (has_broken_halves && !gains.is_unit))
            outcomes[e.name] = LayerOutcome::NotStored;
    }
    const auto variance = outcomes.find("variance");
    if (has_broken_halves && variance != outcomes.end() &&
        variance->second == LayerOutcome::Variance && !gains.is_gray)
        variance->second = LayerOutcome::NotStored;
}

/// Of a file of another renderer.
LayerOutcome outcome_of_plain(const Gains& gains, const LayerEntry& e) {
    if (e.family == "plain") return LayerOutcome::Beside;
    if (e.name == "rgba") return LayerOutcome::Beauty;
    // Light that the rows or the beauty hold as well
    if (e.of.empty() || gains.is_unit) return LayerOutcome::Same;
    return gains.is_uniform ? LayerOutcome::Uniform : LayerOutcome::NotStored;
}

}  // namespace

std::map<std::string, LayerOutcome> layer_outcomes(const LayerStack& layout,
                                                   const MixPlan& plan,
                                                   float exposure) {
    const Gains gains = gains_of(plan, exposure);
    std::map<std::string, LayerOutcome> outcomes;
    for (const LayerEntry& e : layout.header().layers) {
        if (layout.is_plain()) {
            outcomes[e.name] = outcome_of_plain(gains, e);
        } else if (e.family != "halves") {
            outcomes[e.name] = outcome_of(layout, plan, gains, e);
        }
    }
    for (const LayerEntry& e : layout.header().layers) {
        if (e.family != "halves") continue;
        const auto of = outcomes.find(e.of);
        outcomes[e.name] = of == outcomes.end() ? LayerOutcome::NotStored : of->second;
        // Those of the beauty were rounded on their own
        if (e.of == "rgba" && gains.is_unit) outcomes[e.name] = LayerOutcome::Same;
    }
    if (!layout.is_plain()) drop_incomplete(layout, gains, outcomes);
    return outcomes;
}

std::string layers_not_stored(const LayerStack& layout, const MixPlan& plan, float exposure) {
    const auto outcomes = layer_outcomes(layout, plan, exposure);
    std::map<std::string, int> families;
    std::string list;
    const auto add = [&list](const std::string& text) {
        list += (list.empty() ? "" : ", ") + text;
    };
    for (const LayerEntry& e : layout.header().layers) {
        if (e.is_empty || outcomes.at(e.name) != LayerOutcome::NotStored) continue;
        if (!layout.is_plain() && is_incomplete(layout, e))
            add(e.name + " (channels are missing)");
        else if (e.family == "halves")
            continue;
        else if (e.family == "data")
            add(e.name);
        else
            ++families[e.family];
    }
    for (const auto& [family, count] : families)
        add(fmt::format("{} layer{} of {}", count, count == 1 ? "" : "s", family));
    const bool has_sums = std::any_of(
        layout.image().parts.begin(), layout.image().parts.end(), [](const image::Part& part) {
            return std::any_of(
                part.channels.begin(), part.channels.end(),
                [](const image::Channel& c) { return image::is_bookkeeping(c.name); });
        });
    if (has_sums && !layout.is_plain()) add("exact sums");
    for (const std::string& view : layout.views())
        if (view != layout.view()) add("view " + view);
    return list;
}

}  // namespace velatura::compositor::mix
