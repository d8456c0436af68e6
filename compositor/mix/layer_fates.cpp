// SPDX-License-Identifier: Apache-2.0
#include "compositor/mix/layer_fates.h"

#include "image/digest.h"

#include <fmt/format.h>

#include <algorithm>

namespace velatura::compositor::mix {

namespace {

using accumulate::LayerEntry;

/// What the gains of a mix have in common.
struct Gains {
    bool is_uniform = false;  ///< the same for all light
    bool is_grey = false;     ///< and for all channels
    bool is_unit = false;
};

Gains gains_of(const MixPlan& plan, float exposure) {
    Gains gains;
    if (!plan.common_gain) return gains;
    const auto& g = *plan.common_gain;
    gains.is_uniform = true;
    gains.is_grey = g[0] == g[1] && g[1] == g[2];
    gains.is_unit = gains.is_grey && g[0] == 1.0f && exposure == 1.0f;
    return gains;
}

LayerFate fate_of(const LayerStack& layout,
                  const MixPlan& plan,
                  const Gains& gains,
                  const LayerEntry& e) {
    if (e.name == "rgba") return LayerFate::Beauty;
    if (e.family == "cryptomatte") return LayerFate::Same;
    if (e.family == "data") {
        if (e.name != "variance" || gains.is_unit) return LayerFate::Same;
        const bool has_halves = layout.header().find("beauty_hA") != nullptr;
        return gains.is_grey || has_halves ? LayerFate::Variance : LayerFate::NotStored;
    }
    if (e.family == plan.family) return LayerFate::Gained;
    if (e.family == "shadow" || e.family == "caster") return LayerFate::Shadow;
    if (e.family == "unoccluded") return LayerFate::Beside;
    if (gains.is_unit) return LayerFate::Same;
    if (e.family == "clamp") {
        const LayerEntry* of = layout.header().find(e.of);
        return of && of->family == plan.family ? LayerFate::Clamp : LayerFate::NotStored;
    }
    const bool is_coarser = e.family == "bounces" || e.family == "groups";
    if (is_coarser && plan.family == "matrix") return LayerFate::Sum;
    // What adds up to the beauty was rounded on its own, and would no longer do so
    return gains.is_uniform && !e.in_sum ? LayerFate::Uniform : LayerFate::NotStored;
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
                     std::map<std::string, LayerFate>& fates) {
    bool has_broken_halves = false;
    for (const LayerEntry& e : layout.header().layers) {
        if (!is_incomplete(layout, e)) continue;
        fates[e.name] = LayerFate::NotStored;
        has_broken_halves = has_broken_halves || e.family == "halves";
        for (const LayerEntry& other : layout.header().layers) {
            const bool is_beside =
                e.family == "caster" && other.family == "caster" && other.group == e.group;
            if (is_beside) fates[other.name] = LayerFate::NotStored;
        }
    }
    for (const LayerEntry& e : layout.header().layers) {
        if (e.family != "halves") continue;
        const auto of = fates.find(e.of);
        const bool is_gone = of == fates.end() || of->second == LayerFate::NotStored;
        if (is_gone || (has_broken_halves && !gains.is_unit)) fates[e.name] = LayerFate::NotStored;
    }
    const auto variance = fates.find("variance");
    if (has_broken_halves && variance != fates.end() && variance->second == LayerFate::Variance &&
        !gains.is_grey)
        variance->second = LayerFate::NotStored;
}

/// Of a file of another renderer.
LayerFate fate_of_plain(const Gains& gains, const LayerEntry& e) {
    if (e.family == "plain") return LayerFate::Beside;
    if (e.name == "rgba") return LayerFate::Beauty;
    // Light that the rows or the beauty hold as well
    if (e.of.empty() || gains.is_unit) return LayerFate::Same;
    return gains.is_uniform ? LayerFate::Uniform : LayerFate::NotStored;
}

}  // namespace

std::map<std::string, LayerFate> layer_fates(const LayerStack& layout,
                                             const MixPlan& plan,
                                             float exposure) {
    const Gains gains = gains_of(plan, exposure);
    std::map<std::string, LayerFate> fates;
    for (const LayerEntry& e : layout.header().layers) {
        if (layout.is_plain()) {
            fates[e.name] = fate_of_plain(gains, e);
        } else if (e.family != "halves") {
            fates[e.name] = fate_of(layout, plan, gains, e);
        }
    }
    for (const LayerEntry& e : layout.header().layers) {
        if (e.family != "halves") continue;
        const auto of = fates.find(e.of);
        fates[e.name] = of == fates.end() ? LayerFate::NotStored : of->second;
        // Those of the beauty were rounded on their own
        if (e.of == "rgba" && gains.is_unit) fates[e.name] = LayerFate::Same;
    }
    if (!layout.is_plain()) drop_incomplete(layout, gains, fates);
    return fates;
}

std::string layers_not_stored(const LayerStack& layout, const MixPlan& plan, float exposure) {
    const auto fates = layer_fates(layout, plan, exposure);
    std::map<std::string, int> families;
    std::string list;
    const auto add = [&list](const std::string& text) {
        list += (list.empty() ? "" : ", ") + text;
    };
    for (const LayerEntry& e : layout.header().layers) {
        if (e.is_empty || fates.at(e.name) != LayerFate::NotStored) continue;
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
